"""Checked reading of a YAML document, and whole-or-nothing writing."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Mapping
from contextlib import suppress
from math import isfinite
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class Section:
    """A mapping of the document: every key is asked for by kind, and what nobody asked for is an error.

    All methods raise ValueError with the path of the key.
    """

    def __init__(self, path: str, content: Any) -> None:
        if not isinstance(content, dict):
            raise ValueError(f"{path.rstrip('.') or 'the document'}: a mapping is needed, not {_kind(content)}")  # noqa: TRY004
        self.path = path
        self._content: dict[Any, Any] = content
        self._asked: set[Any] = set()

    def has(self, key: str) -> bool:
        """Whether the key is there and not null."""
        self._asked.add(key)
        return self._content.get(key) is not None

    def _get(self, key: str) -> Any:
        if not self.has(key):
            raise ValueError(f"{self.path}{key}: missing")
        return self._content[key]

    def text(self, key: str) -> str:
        """A text that is not empty."""
        value = self._get(key)
        if not _is_text(value):
            raise ValueError(f"{self.path}{key}: a text is needed, not {_short(value)}")
        return str(value)

    def optional_text(self, key: str) -> str | None:
        """A text, or None where the key is null or absent."""
        return self.text(key) if self.has(key) else None

    def texts(self, key: str) -> tuple[str, ...]:
        """A text, or a list of texts."""
        value = self._get(key)
        found = value if isinstance(value, list) else [value]
        if not found or not all(_is_text(v) for v in found):
            raise ValueError(f"{self.path}{key}: a text or a list of texts is needed, not {_short(value)}")
        return tuple(found)

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number."""
        if default is not None and not self.has(key):
            return default
        return _number(self._get(key), f"{self.path}{key}")

    def vector(self, key: str) -> Vector:
        """Three numbers."""
        return _vector(self._get(key), f"{self.path}{key}")

    def number_or_vector(self, key: str) -> float | Vector:
        """A finite number, or three."""
        return self.vector(key) if isinstance(self._get(key), list) else self.number(key)

    def matrix(self, key: str) -> Matrix:
        """Three rows of three numbers."""
        rows = self._get(key)
        where = f"{self.path}{key}"
        if not isinstance(rows, list) or len(rows) != 3:
            raise ValueError(f"{where}: three rows of three numbers are needed")
        return (_vector(rows[0], where), _vector(rows[1], where), _vector(rows[2], where))

    def unit(self, expected: str) -> None:
        """The key `unit`, where it is there, is this one."""
        if self.has("unit") and self._content["unit"] != expected:
            raise ValueError(f"{self.path}unit: {_short(self._content['unit'])}, must be {expected!r}")

    def section(self, key: str) -> Section:
        """A mapping inside."""
        return Section(f"{self.path}{key}.", self._get(key))

    def sections(self, key: str) -> list[Section]:
        """A list of mappings; empty where the key is absent or null."""
        if not self.has(key):
            return []
        items = self._content[key]
        if not isinstance(items, list):
            raise ValueError(f"{self.path}{key}: a list is needed, not {_kind(items)}")  # noqa: TRY004
        return [Section(f"{self.path}{key}[{i}].", item) for i, item in enumerate(items)]

    def other_keys(self) -> list[str]:
        """Keys that nobody has asked for yet, in order."""
        return [str(key) for key in self._content if key not in self._asked]

    def no_others(self) -> None:
        """There is no key that nobody has asked for (a typing mistake would be ignored silently)."""
        others = self.other_keys()
        if others:
            raise ValueError(f"{self.path}{others[0]}: not a key of this schema")


def _is_finite(value: Any) -> bool:
    try:
        return isfinite(value)
    except OverflowError:  # an integer of 400 digits
        return False


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not _is_finite(value):
        hint = " (YAML reads 1e-5 as a text: write 1.0e-5)" if isinstance(value, str) else ""
        raise ValueError(f"{where}: a finite number is needed, not {_short(value)}{hint}")
    return float(value)


def _vector(value: Any, where: str) -> Vector:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError(f"{where}: three numbers are needed, not {_short(value)}")
    return (_number(value[0], where), _number(value[1], where), _number(value[2], where))


def _is_text(value: Any) -> bool:
    """Whether it is one that is not empty, and can be a path, without the null character that an escape can make."""
    return isinstance(value, str) and bool(value) and "\0" not in value


def _short(value: Any) -> str:
    """As Python writes it, never long: a few lines of YAML can name a value a million times."""
    return reprlib.repr(value)


def _kind(value: Any) -> str:
    return "nothing" if value is None else f"a {type(value).__name__}"


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write to a temporary name in the same folder, then rename: readers see the old file or the whole new one.

    Raises:
        OSError: the folder is not there or not writable.
    """
    write_together(path.parent, {path.name: content})


def write_together(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Write several files as `write_atomically`; none takes its name before all are on the disk.

    Raises:
        OSError: the folder is not there or not writable, the disk is full; every file is then as it was.
    """
    written: list[tuple[Path, Path]] = []
    try:
        for name, content in contents.items():
            with NamedTemporaryFile(dir=folder, prefix=f".{name}.", delete=False) as sink:
                written.append((Path(sink.name), folder / name))
                sink.write(content.encode() if isinstance(content, str) else content)
                sink.flush()
                os.fsync(sink.fileno())
        for temporary, path in written:
            temporary.chmod(0o644)
            temporary.replace(path)
    except BaseException:
        for temporary, _ in written:
            with suppress(OSError):
                temporary.unlink()
        raise
