"""Runs a command on a machine that has no network but the loopback: a namespace of its own.

./rig exec python -m tests.graph.without_network ./rig demo --seconds 10
"""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

_GET_FLAGS, _SET_FLAGS, _UP = 0x8913, 0x8914, 0x1
_ROOT = Path(__file__).resolve().parents[2]


def why_not() -> str | None:
    """Why this machine allows no such namespace; None where it does."""
    unshare = shutil.which("unshare")
    if unshare is None:
        return "no `unshare` (util-linux) on the PATH"
    tried = subprocess.run([unshare, "-rn", "true"], capture_output=True, text=True, check=False)
    return None if tried.returncode == 0 else f"unshare -rn is not permitted here: {tried.stderr.strip()}"


def command(inner: Sequence[str]) -> list[str]:
    """The command in such a namespace."""
    return ["unshare", "-rn", sys.executable, "-m", "tests.graph.without_network", "--inside", *inner]


def main() -> int:
    """With --inside: this process is in the namespace already."""
    if sys.argv[1:2] == ["--inside"]:
        _raise_loopback()
        os.execvp(sys.argv[2], sys.argv[2:])
    reason = why_not()
    if reason is not None:
        print(reason, file=sys.stderr)
        return 2
    return subprocess.run(command(sys.argv[1:]), check=False, cwd=_ROOT).returncode


def _raise_loopback() -> None:
    others = [name for _, name in socket.if_nameindex() if name != "lo" and _flags(name) & _UP]
    if others:
        raise SystemExit(f"this is no namespace without a network: {', '.join(others)}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as handle:
        fcntl.ioctl(handle, _SET_FLAGS, struct.pack("16sh14x", b"lo", _flags("lo") | _UP))


def _flags(name: str) -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as handle:
        answer = fcntl.ioctl(handle, _GET_FLAGS, struct.pack("16sh14x", name.encode(), 0))
    return int(struct.unpack("16sh14x", answer)[1])


if __name__ == "__main__":
    sys.exit(main())
