"""Runs a module's main() on a host whose clock was set: `python -m tests.graph.set_clock FILE MODULE [ARGS]`.

FILE holds by how much, in ns, as 8 bytes; it may change while the module runs. What the programs read by
`time.time_ns` follows it, and from that come all stamps of samples and of reception; the steady clock does not.
"""

from __future__ import annotations

import importlib
import mmap
import struct
import sys
import time
from pathlib import Path


def set_by(file: Path, offset_ns: int) -> None:
    """Sets the clock of whoever looks at the file, from its true time."""
    with file.open("r+b" if file.exists() else "w+b") as stream:
        stream.write(struct.pack("<q", offset_ns))


def main() -> int:
    """Never returns but with what the module's main() returns."""
    with Path(sys.argv[1]).open("rb") as stream:
        page = mmap.mmap(stream.fileno(), 8, access=mmap.ACCESS_READ)
    true = time.time_ns
    time.time_ns = lambda: true() + struct.unpack("<q", page[:8])[0]
    module = importlib.import_module(sys.argv[2])
    sys.argv[:] = sys.argv[2:]
    return int(module.main())


if __name__ == "__main__":
    sys.exit(main())
