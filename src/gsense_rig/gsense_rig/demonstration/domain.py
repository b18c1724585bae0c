"""A ROS domain that nobody on this machine uses: the demonstration's graph meets no other."""

from __future__ import annotations

import random
from collections.abc import Iterable
from pathlib import Path

LARGEST = 101
"""Above it, DDS's ports reach into those that Linux hands out."""
_BASE, _GAIN = 7400, 250
"""Ports of a domain, by the RTPS specification (section 9.6.1)."""


def free_domain() -> int:
    """A number from 1 to 101 none of whose ports is open on this machine."""
    busy = busy_domains(_open_ports())
    free = [domain for domain in range(1, LARGEST + 1) if domain not in busy]
    return random.SystemRandom().choice(free or list(range(1, LARGEST + 1)))


def busy_domains(ports: Iterable[int]) -> set[int]:
    """The domains to which UDP ports belong."""
    return {(port - _BASE) // _GAIN for port in ports if _BASE <= port < _BASE + _GAIN * (LARGEST + 1)}


def _open_ports() -> list[int]:
    ports = []
    for name in ("udp", "udp6"):
        try:
            lines = (Path("/proc/net") / name).read_text(encoding="ascii").splitlines()[1:]
        except OSError:
            continue
        ports += [int(line.split()[1].rsplit(":", 1)[1], 16) for line in lines]
    return ports
