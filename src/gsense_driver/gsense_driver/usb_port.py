"""Finds a serial port by its USB ids: `usb:VID:PID` or `usb:VID:PID:SERIAL`, hexadecimal ids, e.g. usb:10C4:EA60.

The ids stay when the cable moves to another socket, where /dev/ttyUSB0 becomes another name. Asked anew each time the
port is opened. Pure but for the list of ports, which is given.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import NamedTuple, Protocol

from serial.tools import list_ports

from gsense_driver.errors import PortLostError, SettingError

_PREFIX = "usb:"
_PATTERN = re.compile(r"usb:([0-9a-f]{4}):([0-9a-f]{4})(?::(.+))?", re.IGNORECASE)


class UsbIds(NamedTuple):
    """Vendor and product of a USB device, and its serial number where that is asked for."""

    vid: int
    pid: int
    serial: str | None

    def __str__(self) -> str:
        return f"{_PREFIX}{self.vid:04X}:{self.pid:04X}" + (f":{self.serial}" if self.serial else "")


class PortInfo(Protocol):
    """What pyserial's list says of a port; ids are None where it is not on USB."""

    device: str
    vid: int | None
    pid: int | None
    serial_number: str | None


def parse_usb(port: str) -> UsbIds | None:
    """Ids of a `usb:` port, None for any other; raises SettingError where they cannot be read."""
    if not port.lower().startswith(_PREFIX):
        return None
    match = _PATTERN.fullmatch(port)
    if match is None:
        raise SettingError(f"port: '{port}' is not usb:VID:PID or usb:VID:PID:SERIAL with four hexadecimal digits each")
    return UsbIds(int(match[1], 16), int(match[2], 16), match[3])


def find_device(port: str, ports: Callable[[], Iterable[PortInfo]] = list_ports.comports) -> str:
    """Device of a `usb:` port; any other port as it is. Raises PortLostError where no or more than one device fits."""
    wanted = parse_usb(port)
    if wanted is None:
        return port
    on_usb = [info for info in ports() if info.vid is not None and info.pid is not None]
    found = [
        info for info in on_usb if (info.vid, info.pid) == wanted[:2] and wanted.serial in (None, info.serial_number)
    ]
    if len(found) == 1:
        return found[0].device
    if found:
        serials = ", ".join(f"{info.serial_number or 'no serial number'} ({info.device})" for info in found)
        raise PortLostError(f"{len(found)} devices are {wanted}: add the serial number of one: {serials}")
    there = ", ".join(f"{UsbIds(info.vid or 0, info.pid or 0, info.serial_number)}" for info in on_usb)
    raise PortLostError(f"no USB device is {wanted}; there is: {there or 'none'}")
