"""Finding and mapping the card, and its functions one by one: digital lines, PWM, encoder, A/D."""

from __future__ import annotations

import mmap
import os
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

from gsense_rig.exclusive import own
from gsense_rig.hardware.interface import HardwareError
from gsense_rig.hardware.mf624 import registers as r

PWM_FREQUENCY = 24_000.0  # Hz (thesis, section 6.3)
PWM_STEPS = int(r.CTR_CLOCK / PWM_FREQUENCY)  # 2083 ticks: 24.004 kHz, one of them each way at least
_CONVERSION_POLLS = 2000  # reads; a conversion takes some microseconds, a read one


class Window(Protocol):
    """One mapped region; offsets in bytes."""

    def read16(self, offset: int) -> int:
        """One 16-bit read."""

    def read32(self, offset: int) -> int:
        """One 32-bit read."""

    def write16(self, offset: int, value: int) -> None:
        """One 16-bit write."""

    def write32(self, offset: int, value: int) -> None:
        """One 32-bit write."""

    def close(self) -> None:
        """Unmap."""


class Windows(NamedTuple):
    """The three regions."""

    badr0: Window
    badr1: Window
    badr2: Window


@dataclass(frozen=True)
class CardPlace:
    """Where the kernel shows UIO devices."""

    uio_class: Path = Path("/sys/class/uio")
    devices: Path = Path("/dev")

    def open(self, exclusive: bool = False) -> Windows:
        """Find the card and map it; exclusive: as the only loop that drives it.

        Raises:
            HardwareError: no card, another loop has it, or it cannot be mapped; the message is one line.
        """
        return map_card(require_card(self.uio_class), self.devices, exclusive)


def find_card(uio_class: Path) -> Path | None:
    """Return the sysfs folder of the first MF624 that the kernel's UIO driver serves, or None."""
    for folder in sorted(uio_class.glob("uio*")):
        try:
            name = (folder / "name").read_text(encoding="ascii").strip()
        except (OSError, UnicodeDecodeError):
            continue
        if name == r.UIO_NAME:
            return folder
    return None


def require_card(uio_class: Path) -> Path:
    """Find the card.

    Raises:
        HardwareError: there is none; the message says what to do.
    """
    card = find_card(uio_class)
    if card is None:
        raise HardwareError(
            f"no MF624 card: no device named '{r.UIO_NAME}' under {uio_class} (load the kernel module uio_mf624, "
            "blacklist mf6x4), or use hardware:=sim"
        )
    return card


class MappedWindow:
    """A region of a UIO device. Each access is one aligned load or store of its width.

    Args:
        fd: of the device.
        index: of the map; UIO selects it by the file offset index * page size.
        offset: where the region begins in its first page.
        size: bytes.
    """

    def __init__(self, fd: int, index: int, offset: int, size: int) -> None:
        page = mmap.PAGESIZE
        length = -(-(offset + size) // page) * page
        self._map = mmap.mmap(fd, length, offset=index * page)
        region = memoryview(self._map)[offset : offset + size // 4 * 4]
        self._half, self._word = region.cast("H"), region.cast("I")

    def read16(self, offset: int) -> int:
        """One 16-bit read."""
        return self._half[offset >> 1]

    def read32(self, offset: int) -> int:
        """One 32-bit read."""
        return self._word[offset >> 2]

    def write16(self, offset: int, value: int) -> None:
        """One 16-bit write."""
        self._half[offset >> 1] = value

    def write32(self, offset: int, value: int) -> None:
        """One 32-bit write."""
        self._word[offset >> 2] = value

    def close(self) -> None:
        """Unmap."""
        self._half.release()
        self._word.release()
        self._map.close()


def map_card(folder: Path, devices: Path, exclusive: bool = False) -> Windows:
    """Map the three regions of a card found at a sysfs folder; the maps keep an exclusive one locked.

    Raises:
        HardwareError: a region is missing, the device cannot be opened, or is another's; the message is one line.
    """
    device = devices / folder.name
    try:
        fd = os.open(device, os.O_RDWR | os.O_SYNC)
    except OSError as error:
        hint = '; allow it by a udev rule for SUBSYSTEM=="uio"' if isinstance(error, PermissionError) else ""
        raise HardwareError(f"cannot open {device}: {error.strerror}{hint}") from error
    try:
        if exclusive and not own(fd):
            raise HardwareError(f"{device} is driven by another rig node: end that one first")
        first, second, third = (MappedWindow(fd, k, *_region(folder / "maps" / f"map{k}")) for k in range(3))
    except (OSError, ValueError) as error:
        raise HardwareError(f"cannot map the MF624's registers at {device}: {error}") from error
    finally:
        os.close(fd)
    return Windows(first, second, third)


def _region(folder: Path) -> tuple[int, int]:
    """Offset in the page and size of a map. Old kernels gave the raw address and no offset."""
    address, size, offset = (int((folder / n).read_text(encoding="ascii"), 0) for n in ("addr", "size", "offset"))
    return offset or address & (mmap.PAGESIZE - 1), size


class Card:
    """The card's functions. Several handles may be open; only `start` resets anything."""

    def __init__(self, windows: Windows) -> None:
        self._control, self._io, self._counters = windows
        self._ticks: int | None = None  # high ticks of the running PWM; None: its output is forced or unknown
        self._raw: dict[int, int] = {}
        self._counts: dict[int, int] = {}

    def start(self, outputs: int, encoder: int, input_filter: bool) -> None:
        """Bring the card into a safe state: given DOUT levels, counters stopped and low, D/A at 0 V, encoder at 0."""
        self._io.write16(r.DOUT, outputs)
        self.check()
        for n in range(r.CTR_COUNT):
            self.force_low(n)
        for n in range(r.DA_CHANNELS):
            self._io.write16(r.DA0 + 2 * n, r.DA_ZERO)
        kept = self._control.read32(r.GPIOC)
        self._control.write32(r.GPIOC, (kept & ~r.GPIOC_LDAC) | r.GPIOC_DACEN)
        self._counters.write32(r.IRCCTRL, r.IRC_RESET_ALL)
        self._counters.write32(r.IRCCTRL, (r.IRC_FILTER if input_filter else r.IRC_RUN) << 8 * encoder)

    def check(self) -> None:
        """See that a card answers.

        Raises:
            HardwareError: it does not.
        """
        if self._control.read32(r.GPIOC) == r.ALL_ONES:
            raise HardwareError("the MF624 does not answer: its registers read all ones")

    def write_outputs(self, levels: int) -> None:
        """Set all eight digital outputs; they cannot be read back."""
        self._io.write16(r.DOUT, levels)

    def read_inputs(self) -> int:
        """Levels of the eight digital inputs."""
        return self._io.read16(r.DIN)

    def force_low(self, counter: int) -> None:
        """Output low at once, counter stopped."""
        self._counters.write32(r.CTR_SPACING * counter + r.CTR_MODE, r.MODE_FORCED_LOW)
        self._counters.write32(r.CTRXCTRL, r.CTR_STOP << 6 * counter)
        self._ticks = None

    def pwm(self, counter: int, share: float) -> None:
        """Pulse width from 0 to 1 of the period at 24 kHz; a running one changes at its next edges.

        Source: HUD's recipe, A high ticks less one, B low ticks less one.
        """
        base, high = r.CTR_SPACING * counter, round(share * PWM_STEPS)
        if high <= 0:
            self.force_low(counter)
            return
        if high >= PWM_STEPS:
            self._counters.write32(base + r.CTR_MODE, r.MODE_FORCED_HIGH)
            self._ticks = None
            return
        if high != self._ticks:
            self._counters.write32(base + r.CTR_A, high - 1)
            self._counters.write32(base + r.CTR_B, PWM_STEPS - high - 1)
        if self._ticks is None:
            self._counters.write32(r.CTRXCTRL, r.CTR_RESTART << 6 * counter)
            self._counters.write32(base + r.CTR_MODE, r.MODE_PWM)
            self._counters.write32(r.CTRXCTRL, r.CTR_START << 6 * counter)
        self._ticks = high

    def encoder(self, channel: int) -> int:
        """Counts since the first read; the 32-bit counter may wrap in between."""
        raw = self._counters.read32(r.IRC0 + 4 * channel)
        step = (raw - self._raw.get(channel, raw) + 0x80000000) % 0x100000000 - 0x80000000
        self._raw[channel] = raw
        self._counts[channel] = self._counts.get(channel, 0) + step
        return self._counts[channel]

    def select(self, channel: int) -> None:
        """Choose the A/D channel that `voltage` converts."""
        self._io.write16(r.ADCTRL, 1 << channel)

    def voltage(self) -> float:
        """Convert the selected channel [V], within 10 V either way.

        Raises:
            HardwareError: the conversion does not end.
        """
        self._io.read16(r.ADSTART)
        for _ in range(_CONVERSION_POLLS):
            if not self._control.read32(r.GPIOC) & r.GPIOC_EOLC:
                code = self._io.read16(r.ADDATA) & 0x3FFF
                return (code - 0x4000 if code & 0x2000 else code) * 10.0 / 0x2000
        raise HardwareError("the MF624's A/D conversion does not end")

    def close(self) -> None:
        """Unmap; changes no output."""
        for window in (self._control, self._io, self._counters):
            window.close()
