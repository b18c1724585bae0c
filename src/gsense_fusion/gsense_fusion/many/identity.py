"""What a report rests on, as one checksum: the request, the bytes of its bags, the effects file and this program."""

from __future__ import annotations

import hashlib
import json
from errno import ENOENT
from functools import lru_cache
from pathlib import Path

import gsense_fusion
from gsense_fusion.closing import Request

_BLOCK = 1 << 20


@lru_cache(maxsize=1)
def program_digest() -> str:
    """Of this package's own sources: other code may come to another result."""
    root = Path(gsense_fusion.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(root.rglob("*")):
        if file.is_file() and file.suffix in (".py", ".j2", ".css"):
            digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def key_of(request: Request, unit_id: str | None) -> str:
    """The checksum of a session; equal keys, equal reports.

    Raises:
        OSError: a bag or the effects file cannot be read.
    """
    asked = {
        "bags": [[str(path), role.value, bag_digest(path)] for path, role in request.bags],
        "sensor": request.sensor,
        "declared": request.declared,
        "effects": None if request.effects is None else bag_digest(request.effects),
        "site": [request.latitude, request.rail_azimuth],
        "unit_id": unit_id,
        "program": program_digest(),
    }
    return hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()


def bag_digest(path: Path) -> str:
    """Of a file, or of all files in a folder with their names; raises OSError."""
    if not path.is_dir() and not path.is_file():  # reading a pipe would wait for ever
        raise FileNotFoundError(ENOENT, "no such file or folder", str(path))
    digest = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]:
        digest.update(f"{file.relative_to(path).as_posix()}\0{file.stat().st_size}\0".encode())
        with file.open("rb") as stream:
            for block in iter(lambda: stream.read(_BLOCK), b""):
                digest.update(block)
    return digest.hexdigest()
