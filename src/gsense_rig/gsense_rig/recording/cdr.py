"""Batch serialisation: many messages of one fixed size from one template.

A message whose strings and sequences keep their lengths always serialises to the same layout. The library serialises
one message; this module finds where its numbers lie, and numpy writes the fields of thousands of copies at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

_HEADER = 4
"""Bytes of the CDR encapsulation; alignment counts from behind it."""


class _Walk:
    """Follows a message through its definition and notes the offset of every number."""

    def __init__(self, store: Typestore) -> None:
        self._store = store
        self.at = 0
        self.fields: dict[str, tuple[Any, int]] = {}

    def message(self, msgtype: str, message: Any, path: str) -> None:
        for name, desc in self._store.fielddefs[msgtype][1]:
            self.field(desc, getattr(message, name), f"{path}.{name}" if path else name)

    def field(self, desc: Any, value: Any, path: str) -> None:
        kind, args = desc
        if kind == Nodetype.NAME:
            self.message(args, value, path)
        elif kind == Nodetype.BASE:
            self.base(args[0], value, path)
        else:
            self.items(args[0], value, path, sequence=kind == Nodetype.SEQUENCE)

    def base(self, name: str, value: Any, path: str) -> None:
        if name == "string":
            self.align(4)
            self.at += 4 + len(value.encode()) + 1
            return
        dtype = np.dtype({"bool": "u1", "byte": "u1", "octet": "u1", "char": "u1"}.get(name, name)).newbyteorder("<")
        self.align(dtype.itemsize)
        self.fields[path] = (dtype, self.at)
        self.at += dtype.itemsize

    def items(self, desc: Any, value: Any, path: str, *, sequence: bool) -> None:
        if sequence:
            self.align(4)
            self.at += 4
        for index, item in enumerate(value):
            self.field(desc, item, f"{path}.{index}")

    def align(self, size: int) -> None:
        self.at = -(-self.at // size) * size


class Template:
    """Serialises n messages that differ from one example only in their numbers."""

    def __init__(self, store: Typestore, example: Any) -> None:
        """Takes any message of rosbags' classes, its strings and sequences as they shall stay."""
        self.msgtype: str = example.__msgtype__
        self._bytes = bytes(store.serialize_cdr(example, self.msgtype))
        walk = _Walk(store)
        walk.message(self.msgtype, example, "")
        if _HEADER + walk.at > len(self._bytes):
            raise ValueError(
                f"{self.msgtype}: layout of {walk.at} bytes does not fit {len(self._bytes)} serialised ones"
            )
        self.fields = tuple(walk.fields)
        """Names of the numbers: `header.stamp.sec`, `position.0`, ..."""
        self._dtype = np.dtype(
            {
                "names": list(walk.fields),
                "formats": [dtype for dtype, _ in walk.fields.values()],
                "offsets": [_HEADER + offset for _, offset in walk.fields.values()],
                "itemsize": len(self._bytes),
            }
        )

    def fill(self, stamps_ns: npt.NDArray[np.int64], values: Mapping[str, npt.ArrayLike]) -> npt.NDArray[np.uint8]:
        """One serialised message per stamp, shape (n, size).

        `values` maps a field's name to a number or an array of shape (n,).
        """
        rows = np.tile(np.frombuffer(self._bytes, dtype=np.uint8), (stamps_ns.shape[0], 1))
        fields = rows.view(self._dtype)[:, 0]
        fields["header.stamp.sec"] = stamps_ns // 1_000_000_000
        fields["header.stamp.nanosec"] = stamps_ns % 1_000_000_000
        for name, value in values.items():
            fields[name] = value
        return rows
