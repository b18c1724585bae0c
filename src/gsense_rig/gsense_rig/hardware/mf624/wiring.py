"""Which terminal of the card goes where. The thesis does not say; these defaults are ours and can be replaced."""

from __future__ import annotations

import typing
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_rig.hardware.interface import HardwareError

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Wiring:
    """Terminals of the MF624. None: not wired.

    The inductive switches are NPN and normally open: their output is low where they see the flag (Omron TL-W sheet).
    """

    encoder: int = 0  # IRC channel
    encoder_filter: bool = True
    encoder_reversed: bool = False
    counts_per_metre: float = 20_000.0
    pwm: int = 0  # CTR channel
    direction: int = 0  # DOUT bit; 1 pushes to the right
    disable: int = 1  # DOUT bit; 1 opens the bridge
    green: int | None = 2  # DOUT bits of the traffic light
    amber: int | None = 3
    red: int | None = 4
    left: int = 0  # DIN bits of the switches
    centre: int = 1
    right: int = 2
    optical: int = 3
    switches_active_low: bool = True
    bridge_fault: int | None = 4  # DIN bit; low: the bridge reports a fault
    emergency_stop: int | None = 5  # DIN bit; high: pressed (a normally closed contact to ground with a pull-up)
    current: int | None = 0  # A/D channel of the motor's current
    amperes_per_volt: float = 2.0
    current_zero: float = 0.0  # V at no current


def load_wiring(path: Path) -> Wiring:
    """Read a YAML file that maps names of `Wiring` to values; what it does not name keeps its default.

    Raises:
        HardwareError: unreadable file, unknown name or wrong value; the message is one line.
    """
    try:
        content = parse_yaml(path.read_text(encoding="utf-8")) or {}
    except (OSError, ValueError) as error:
        raise HardwareError(f"wiring file {path}: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise HardwareError(f"wiring file {path}: expected 'name: value' lines")
    names = {f.name for f in fields(Wiring)}
    hints = typing.get_type_hints(Wiring)
    for name, value in content.items():
        if name not in names:
            raise HardwareError(f"wiring file {path}: '{name}' is unknown; known are {', '.join(sorted(names))}")
        if not _fits(value, hints[name]):
            raise HardwareError(f"wiring file {path}: '{name}' cannot be {value!r}")
    return Wiring(**content)


def _fits(value: object, kind: object) -> bool:
    if kind is bool:
        return isinstance(value, bool)
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    if value is None:
        return kind is not int
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 7
