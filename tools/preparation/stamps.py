"""Stamps: what was prepared, and from what. Written last, so that an interrupted step leaves none."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from preparation.progress import say


def digest_files(files: Iterable[Path], *more: str) -> str:
    """Hash of the files' names and contents (not of times, which a clone or checkout changes) and of `more`."""
    total = hashlib.sha256("\0".join(more).encode())
    for file in files:
        total.update(f"\0{file.name}\0".encode())
        total.update(file.read_bytes())
    return total.hexdigest()


def read(folder: Path, name: str) -> str:
    """A stamp's text, empty where there is none."""
    try:
        return (folder / name).read_text(encoding="utf-8")
    except FileNotFoundError:
        return ""


def write(folder: Path, name: str, text: str) -> None:
    """Set a stamp in one step."""
    folder.mkdir(parents=True, exist_ok=True)
    new = folder / f".{name}.new"
    new.write_text(text, encoding="utf-8")
    new.replace(folder / name)


def remove(folder: Path, name: str) -> None:
    """Take a stamp away, before what it vouches for is changed."""
    with contextlib.suppress(FileNotFoundError):
        (folder / name).unlink()


@contextlib.contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Let one set-up at a time work in a checkout. The kernel frees the lock of a process that was killed."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("another ./rig is setting up; waiting for it")
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
