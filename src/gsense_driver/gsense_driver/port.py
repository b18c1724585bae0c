"""The serial port as a source of bytes that comes back by itself.

`Connection` knows neither pyserial nor threads: an opener and a sleep are given to it. It opens with a growing pause
between attempts, and says once when the port is lost and once when it is back.
"""

from __future__ import annotations

import errno
from collections.abc import Callable
from typing import Protocol

import serial

from gsense_driver.errors import PortLostError
from gsense_driver.usb_port import find_device

FIRST_PAUSE_S = 0.05
LONGEST_PAUSE_S = 0.5  # so that streaming resumes within 1 s of the port's return


class Port(Protocol):
    """An open port."""

    def read(self) -> bytes:
        """Return what has arrived, empty after a short wait without data; raises PortLostError."""

    def close(self) -> None:
        """Close; never raises."""


class SerialPort:
    """A port by pyserial: device, pseudo-terminal, URL or USB ids (`usb_port`)."""

    def __init__(self, url: str, baud: int, timeout_s: float = 0.1) -> None:
        url = find_device(url)
        try:
            self._serial = serial.serial_for_url(url, do_not_open=True, baudrate=baud, timeout=timeout_s)
            if "://" not in url:
                self._serial.exclusive = True  # two readers would each get half of the bytes
            self._serial.open()
        except (OSError, ValueError) as error:  # SerialException is an OSError
            taken = getattr(error, "errno", None) == errno.EAGAIN
            raise PortLostError("another program reads it" if taken else _one_line(error)) from error

    def read(self) -> bytes:
        """Wait for a first byte, then take all that is there."""
        try:
            data: bytes = self._serial.read(1)
            waiting = self._serial.in_waiting if data else 0
            if waiting:
                data += self._serial.read(waiting)
        except (OSError, ValueError, TypeError) as error:  # TypeError: pyserial's file descriptor vanished
            raise PortLostError(_one_line(error)) from error
        return data

    def close(self) -> None:
        """Close, whatever state the device is in."""
        try:
            self._serial.close()
        except OSError:
            return


class Connection:
    """Keeps a port open as well as it can."""

    def __init__(
        self,
        opener: Callable[[], Port],
        sleep: Callable[[float], object],
        log: Callable[[str, bool], object],
    ) -> None:
        """`log` takes a line and whether it is a warning."""
        self._opener = opener
        self._sleep = sleep
        self._log = log
        self._port: Port | None = None
        self._pause_s = FIRST_PAUSE_S
        self._told = False
        self.opened = 0  # times that the port was opened
        self.problem: str | None = "not opened yet"

    @property
    def connected(self) -> bool:
        """True while the port is open."""
        return self._port is not None

    def read(self) -> bytes | None:
        """Bytes that arrived (maybe none), or None where the port was opened just now or is still closed."""
        if self._port is None:
            self._open()
            return None
        try:
            return self._port.read()
        except PortLostError as error:
            self.close()
            self._lost(str(error))
            return None

    def close(self) -> None:
        """Close the port; a later read opens it again."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _open(self) -> None:
        try:
            self._port = self._opener()
        except PortLostError as error:
            self._lost(str(error))
            self._sleep(self._pause_s)
            self._pause_s = min(2.0 * self._pause_s, LONGEST_PAUSE_S)
            return
        self.opened += 1
        self._pause_s = FIRST_PAUSE_S
        self.problem = None
        self._log("port open" if self.opened == 1 else "port is back", False)
        self._told = False

    def _lost(self, reason: str) -> None:
        self.problem = reason
        if not self._told:
            self._told = True
            self._log(f"no port: {reason}; trying again until it is there", True)


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
