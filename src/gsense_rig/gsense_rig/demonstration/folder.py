"""The demonstration's folder: what is where, and whether it may be written.

A folder that an earlier demo made is used again: what that demo wrote is replaced, anything else in it is left alone.
"""

from __future__ import annotations

import fcntl
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import yaml

SCHEMA = "gsense-demo/1"
_MARK = "demo.yaml"
_OWN = ("bags", "campaign", "report", "log", "hidden.yaml")


class FolderError(RuntimeError):
    """The folder cannot be used; the message is one line."""


@dataclass
class DemoFolder:
    """A folder that belongs to this demo; locked until `close`."""

    root: Path
    _lock: IO[str] | None = field(default=None, repr=False)

    @property
    def live_bag(self) -> Path:
        """Bag of the live run."""
        return self.root / "bags" / "live"

    @property
    def campaign(self) -> Path:
        """The simulated campaign."""
        return self.root / "campaign"

    @property
    def report(self) -> Path:
        """What close_loop writes."""
        return self.root / "report"

    @property
    def log(self) -> Path:
        """What each process said."""
        return self.root / "log"

    @property
    def hidden(self) -> Path:
        """The truth, written at the end."""
        return self.root / "hidden.yaml"

    @property
    def summary(self) -> Path:
        """What happened; also the mark that a demo wrote here."""
        return self.root / _MARK

    def write(self, path: Path, data: dict[str, Any]) -> None:
        """Writes YAML under a temporary name and renames."""
        temporary = path.with_name(path.name + ".tmp")
        temporary.write_text(yaml.safe_dump({"schema": SCHEMA, **data}, sort_keys=False, width=120), encoding="utf-8")
        temporary.replace(path)

    def close(self) -> None:
        """Gives the folder free."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None


def open_folder(root: Path, seed: int) -> DemoFolder:
    """Makes the folder, or empties an earlier demo's.

    Raises:
        FolderError: it holds something else, another demo is at work in it, or it cannot be written.
    """
    folder = DemoFolder(root)
    try:
        if root.exists() and not root.is_dir():
            raise FolderError(f"{root}: is a file; give a folder")
        if root.is_dir() and any(root.iterdir()) and not _is_demo(folder.summary):
            raise FolderError(f"{root}: is not empty and no demo wrote it; give another --out")
        folder.log.mkdir(parents=True, exist_ok=True)
        folder._lock = _locked(folder.log / ".lock", root)  # noqa: SLF001
        for name in _OWN:
            _remove(root / name, keep=folder.log)
        folder.write(folder.summary, {"seed": seed, "state": "begun"})
    except OSError as error:
        raise FolderError(f"{error.filename or root}: {error.strerror or error}; give another --out") from error
    return folder


def _is_demo(mark: Path) -> bool:
    try:
        data = yaml.safe_load(mark.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return False
    return isinstance(data, dict) and data.get("schema") == SCHEMA


def _locked(path: Path, root: Path) -> IO[str]:
    lock = path.open("w", encoding="utf-8")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        lock.close()
        raise FolderError(f"{root}: another demo is at work in it; give another --out, or wait") from error
    return lock


def _remove(path: Path, keep: Path) -> None:
    if path == keep:
        for entry in path.iterdir():
            if entry.name != ".lock":
                _remove(entry, keep)
    elif path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
