"""An emulated MF624: a fake /sys and /dev with a register file, and the behaviour that memory alone does not have.

Made from the data of the register map, not from the driver: 50 MHz counters with reloads A and B and a toggling output,
A/D conversions that take a while and queue in a FIFO, encoder counters that wrap, inputs and outputs that share an
address. `advance` lets a simulated rail move under the pins' levels, and watches for what must never happen.
"""

import mmap
import os
import time
from dataclasses import dataclass, field

from gsense_rig.hardware.interface import MotorOutput
from gsense_rig.hardware.mf624 import CardPlace, CardRailSpec, Wiring
from gsense_rig.hardware.mf624.card import MappedWindow, Windows
from gsense_rig.hardware.sim import SimRail

PAGE = mmap.PAGESIZE
OFFSETS = (0, 0x100, 0x80)  # where each BAR begins in its page, as a kernel may choose
SIZES = (0x80, 0x80, 0x80)
POWER_ON_GPIOC = 0x024006C0
CLOCK = 50e6
OTHER_TERMINALS = 0b1100_0000  # DIN bits that nobody wired


def make_tree(root, name="mf624", raw_addresses=False):
    """A kernel's view of one card under root: sys/class/uio/uio0 and dev/uio0. Old kernels gave raw addresses."""
    folder = root / "sys/class/uio/uio0"
    for k, (offset, size) in enumerate(zip(OFFSETS, SIZES, strict=True)):
        region = folder / "maps" / f"map{k}"
        region.mkdir(parents=True)
        base = 0xFEB00000 + 0x1000 * k
        values = (base + offset, size, 0) if raw_addresses else (base, size, offset)
        for entry, value in zip(("addr", "size", "offset"), values, strict=True):
            (region / entry).write_text(f"{value:#x}\n")
    (folder / "name").write_text(f"{name}\n")
    (root / "dev").mkdir()
    (root / "dev/uio0").write_bytes(bytes(3 * PAGE))
    return CardPlace(folder.parent, root / "dev")


@dataclass
class Counter:
    mode: int = 0
    a: int = 0
    b: int = 0
    running: bool = False
    level: int = 0

    def command(self, bits):
        if bits & 1:
            self.running = True
        if bits & 2:
            self.running = False
        if bits & 0x10:
            self.level = 1
        if bits & 0x20:
            self.level = 0

    def output(self):
        """Mean level of the output and its frequency [Hz]."""
        forced = self.mode >> 4 & 3
        if forced == 2:
            return 0.0, 0.0
        if forced == 3:
            return 1.0, 0.0
        if not self.running:
            return float(self.level), 0.0
        assert self.mode == 0b1110, f"mode {self.mode:#x} is none that the emulation knows"
        ticks = self.a + self.b + 2
        return (self.a + 1) / ticks, CLOCK / ticks


@dataclass
class EmulatedCard:
    """The card's insides and the rail on its terminals.

    Attributes:
        violations: what must never happen, as text.
        writes: (region, offset, value) in order.
    """

    rail: SimRail
    wiring: Wiring = field(default_factory=Wiring)
    first_count: int = 0x7FFFFF00  # close to the wrap
    conversion_reads: int = 3
    gone: bool = False  # pulled out: all reads are ones
    adc_stuck: bool = False

    def __post_init__(self):
        self.plant = self.rail.plant
        self.counters = [Counter(mode=0b1110, a=99, b=99, running=True) for _ in range(5)]  # left on by somebody
        self.dout, self.gpioc, self.mask = 0, POWER_ON_GPIOC, 0
        self.fifo, self.busy, self.dac = [], 0, {}
        self.irc_control, self.irc_zero = 0, [0] * 4
        self.violations, self.writes, self.started = [], [], False
        self._pins()

    # ---- the terminals

    def _pins(self):
        """Bridge inputs from the pins' levels."""
        w = self.wiring
        share, _ = self.counters[w.pwm].output()
        sign = 1.0 if self.dout >> w.direction & 1 else -1.0
        light = next((n for n, bit in ((1, w.green), (2, w.amber), (3, w.red)) if self.dout >> bit & 1), 0)
        self.rail.write(MotorOutput(sign * share, bool(self.dout >> w.disable & 1), light))

    def _inputs(self):
        reading, w = self.rail.read(), self.wiring
        levels = OTHER_TERMINALS
        for bit, seen in zip((w.left, w.centre, w.right, w.optical), reading.switches, strict=True):
            levels |= (not seen) << bit
        return levels | reading.bridge_ok << w.bridge_fault | reading.emergency_stop << w.emergency_stop

    def advance(self, until):
        """Let the rail run to a time [s]."""
        return self.rail.advance(until)

    # ---- registers

    def read(self, region, offset, width):
        if self.gone:
            return (1 << width) - 1
        if (region, offset) == (0, 0x54):
            self.busy = max(self.busy - 1, 1 if self.adc_stuck else 0)
            return self.gpioc & ~(1 << 17) | bool(self.busy) << 17
        if region == 1:
            return self._read_io(offset)
        if region == 2 and 0x70 <= offset < 0x80:
            return self._encoder((offset - 0x70) // 4)
        if region == 2 and offset < 0x50:
            return int(self.counters[offset // 0x10].running)
        raise AssertionError(f"nobody reads region {region} at {offset:#x}")

    def _read_io(self, offset):
        if offset == 0x10:
            return self._inputs()
        if offset == 0x20:
            self._convert()
            return 0
        assert offset == 0, f"nobody reads region 1 at {offset:#x}"
        return self.fifo.pop(0) if self.fifo and not self.busy else 0x1234

    def write(self, region, offset, value):
        self.writes.append((region, offset, value))
        if (region, offset) == (0, 0x54):
            if (value ^ POWER_ON_GPIOC) & ~(1 << 23 | 1 << 26 | 1 << 17):
                self.violations.append(f"GPIOC {value:#010x}: bits changed that are not ours")
            self.gpioc = value
        elif (region, offset) == (1, 0x00):
            self.mask = value
        elif (region, offset) == (1, 0x10):
            self._write_dout(value)
        elif region == 1 and 0x20 <= offset < 0x30:
            self.dac[(offset - 0x20) // 2] = value
        elif region == 2:
            self._write_counters(offset, value)
        else:
            raise AssertionError(f"nobody writes region {region} at {offset:#x}")
        self._pins()

    def _write_dout(self, value):
        w = self.wiring
        share, _ = self.counters[w.pwm].output()
        turned = (value ^ self.dout) >> w.direction & 1
        was_on = not self.dout >> w.disable & 1 and self.started
        on = not value >> w.disable & 1
        if share > 0.0 and ((turned and was_on and on) or (on and not was_on)):
            self.violations.append(f"DOUT {value:#04x} changes the bridge's path while PWM is at {share:.2f}")
        if not self.started and on:
            self.violations.append("the first levels enable the bridge")
        self.dout, self.started = value, True

    def _write_counters(self, offset, value):
        if offset == 0x60:
            for n, counter in enumerate(self.counters):
                counter.command(value >> 6 * n & 0x3F)
        elif offset == 0x6C:
            for k in range(4):
                if value >> 8 * k & 0x70 == 0x10:
                    self.irc_zero[k] = self.rail.read().counts
            self.irc_control = value
        elif offset < 0x50:
            counter, part = self.counters[offset // 0x10], offset % 0x10
            setattr(counter, {0: "mode", 4: "a", 8: "b"}[part], value)
        else:
            raise AssertionError(f"nobody writes region 2 at {offset:#x}")

    def _encoder(self, channel):
        assert self.irc_control >> 8 * channel & 0x7F == 0, "the encoder is held or gated"
        if channel != self.wiring.encoder:
            return 0
        return (self.first_count + self.rail.read().counts - self.irc_zero[channel]) & 0xFFFFFFFF

    def _convert(self):
        self.fifo, self.busy = [], self.conversion_reads
        for channel in range(8):
            if self.mask >> channel & 1:
                volts = (
                    self.rail.read().current / self.wiring.amperes_per_volt if channel == self.wiring.current else 9.0
                )
                self.fifo.append(max(min(round(volts / 10.0 * 8192), 8191), -8192) & 0x3FFF)


class EmulatedWindow:
    """A mapped region with the card's behaviour; the file behind it holds what was read and written last."""

    def __init__(self, card, index, mapped):
        self.card, self.index, self.mapped = card, index, mapped

    def read16(self, offset):
        value = self.card.read(self.index, offset, 16)
        self.mapped.write16(offset, value)
        return self.mapped.read16(offset)

    def read32(self, offset):
        value = self.card.read(self.index, offset, 32)
        self.mapped.write32(offset, value)
        return self.mapped.read32(offset)

    def write16(self, offset, value):
        self.mapped.write16(offset, value)
        self.card.write(self.index, offset, self.mapped.read16(offset))

    def write32(self, offset, value):
        self.mapped.write32(offset, value)
        self.card.write(self.index, offset, self.mapped.read32(offset))

    def close(self):
        self.mapped.close()


@dataclass(frozen=True)
class EmulatedPlace(CardPlace):
    """Opens the fake device as the driver does, and puts the behaviour between."""

    card: EmulatedCard = None

    def open(self, exclusive=False):
        return Windows(*(EmulatedWindow(self.card, k, w) for k, w in enumerate(super().open(exclusive))))


def emulated_rail(root, **options):
    """A card with a rail in a fake system under root: the card, and the spec that opens it."""
    rail_options = {k: options.pop(k) for k in ("seed", "position") if k in options}
    place = make_tree(root)
    card = EmulatedCard(SimRail(**rail_options), **options)
    return card, CardRailSpec(EmulatedPlace(place.uio_class, place.devices, card), card.wiring)


class LiveCard(EmulatedCard):
    """Runs by the wall clock: each access finds the rail where it is by then."""

    def read(self, region, offset, width):
        self.advance(time.monotonic())
        return super().read(region, offset, width)

    def write(self, region, offset, value):
        self.advance(time.monotonic())
        super().write(region, offset, value)


@dataclass(frozen=True)
class LivePlace(CardPlace):
    """For processes: each has a card of its own; what is in the registers they share, by the fake device's file."""

    def open(self, exclusive=False):
        card = LiveCard(SimRail(seed=3, position=-0.1, time=time.monotonic()))
        return Windows(*(EmulatedWindow(card, k, w) for k, w in enumerate(super().open(exclusive))))


def page_of(root, index):
    """What the fake device's file holds for a region."""
    fd = os.open(root / "dev/uio0", os.O_RDWR)
    window = MappedWindow(fd, index, OFFSETS[index], SIZES[index])
    os.close(fd)
    return window
