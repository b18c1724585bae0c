"""The thesis's own protocol: lines "counter;raw;raw;..." closed by CRLF, decimal counts, columns by parameter.

There is no CRC and no board time. The counter serves as the sequence and, times a nominal period, as the board's
time; the clock model finds the true period. A line whose fields are not all integers in range, or too few or many, is
rejected.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from gsense_driver import scaling
from gsense_driver.errors import SettingError
from gsense_driver.frames import Frame
from gsense_driver.mounting import Vector
from gsense_driver.samples import BNO, LISY, MPU, FieldReading, ImuReading, Reading, Sampler, TemperatureReading
from gsense_driver.stream import Reject, Splitter

COLUMNS = (
    "-",  # a column that is not used
    *(f"{MPU}.{name}" for name in ("ax", "ay", "az", "temperature", "gx", "gy", "gz")),
    *(f"{BNO}.{name}" for name in ("ax", "ay", "az", "mx", "my", "mz", "gx", "gy", "gz", "temperature")),
    f"{LISY}.z",  # one conversion of 10 bits
)
DEFAULT_COLUMNS = (
    *(f"{MPU}.{name}" for name in ("ax", "ay", "az", "gx", "gy", "gz")),
    *(f"{BNO}.{name}" for name in ("ax", "ay", "az", "gx", "gy", "gz")),
    f"{LISY}.z",
)
_LINE_LIMIT = 512
TYPE_TEXT = 31  # frame type of a text row: no radio frame has it


class Row(NamedTuple):
    """One accepted line: its counter and the raw counts in the order of the columns."""

    counter: int
    values: tuple[int, ...]


def parse_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Check column names; raises SettingError for an unknown or a repeated one."""
    for name in names:
        if name not in COLUMNS:
            raise SettingError(f"text.columns: unknown column '{name}'; known are {', '.join(COLUMNS)}")
    used = [name for name in names if name != "-"]
    if not used or len(set(used)) != len(used):
        raise SettingError("text.columns: name each column once, and at least one")
    return tuple(names)


class TextStream(Splitter):
    """Splits a byte stream into rows and rejects, in order of their arrival; never raises on data."""

    def __init__(self, columns: Sequence[str], counter_bits: int) -> None:
        super().__init__(b"\n")
        self._columns = len(columns)
        self._counter_limit = 1 << counter_bits

    def feed(self, data: bytes) -> list[Row | Reject]:
        """Take bytes as they arrived; returns every row and reject that they complete."""
        items: list[Row | Reject] = []
        for line in self._pieces(data):
            row = self._parse(line)
            if row is not None and self._synchronised:
                items.append(row)
            elif line.strip() and self._synchronised:
                items.append(self._reject("text", len(line) + 1))
            else:  # the first line may be the tail of one that began before, and still look sound
                self.skipped_bytes += len(line) + 1
            self._synchronised = True
        if len(self._pending) > _LINE_LIMIT:
            items.append(self._reject("text", len(self._pending)))
            self._pending = b""
        return items

    def _parse(self, line: bytes) -> Row | None:
        fields = line.rstrip(b"\r").rstrip(b";").split(b";")
        if len(fields) != self._columns + 1:
            return None
        values = [_integer(field) for field in fields]
        if any(value is None for value in values):
            return None
        counter, *counts = (value for value in values if value is not None)
        if not 0 <= counter < self._counter_limit:
            return None
        return Row(counter, tuple(counts))


def _integer(field: bytes) -> int | None:
    text = field.strip()
    digits = text[1:] if text[:1] in (b"-", b"+") else text
    if not digits.isdigit() or len(digits) > 10:
        return None
    value = int(text)
    return value if -(1 << 31) <= value < 1 << 32 else None


class TextSampler:
    """Turns rows into readings; rows carry a pseudo frame (`frame_of`) through link and clock."""

    def __init__(self, sampler: Sampler, columns: Sequence[str], period_s: float, counter_bits: int) -> None:
        self._sampler = sampler
        self._index = {name: i for i, name in enumerate(columns) if name != "-"}
        self._period_s = period_s
        self._turn = 1 << counter_bits
        self._last_counter: int | None = None
        self._turns = 0

    def frame_of(self, row: Row) -> Frame:
        """A frame with the row's unwrapped counter as sequence, and times the nominal period as board time."""
        if self._last_counter is not None and row.counter < self._last_counter - self._turn // 2:
            self._turns += 1
        self._last_counter = row.counter
        counter = row.counter + self._turns * self._turn
        return Frame(TYPE_TEXT, 0, counter & 0xFFFF, round(counter * self._period_s * 1e6) & 0xFFFFFFFF, b"")

    def readings(self, row: Row, stamp_ns: int) -> list[Reading]:
        """All readings of one row."""
        sampler, scales = self._sampler, self._sampler.scales
        out: list[Reading] = []
        for sensor, accel, gyro in (
            (MPU, scales.mpu_accel, scales.mpu_gyro),
            (BNO, scales.bno_accel, scales.bno_gyro),
        ):
            rate, force = self._vector(row, sensor, "g", gyro), self._vector(row, sensor, "a", accel)
            if rate is not None or force is not None:
                sampler.counts.samples[sensor] += 1
                out.append(ImuReading(sensor, stamp_ns, rate, force))
        field = self._vector(row, BNO, "m", scales.bno_mag)
        if field is not None:
            out.append(FieldReading(stamp_ns, field))
        if f"{LISY}.z" in self._index:
            sampler.counts.samples[LISY] += 1
            rate_z = scaling.lisy_rate(16 * row.values[self._index[f"{LISY}.z"]])
            out.append(ImuReading(LISY, stamp_ns, sampler.mounted(LISY, (0.0, 0.0, rate_z)), None))
        self._temperatures(row, stamp_ns, out)
        return out

    def _temperatures(self, row: Row, stamp_ns: int, out: list[Reading]) -> None:
        for sensor in (MPU, BNO):
            index = self._index.get(f"{sensor}.temperature")
            if index is not None and self._sampler.temperature_due(sensor, stamp_ns):
                raw = row.values[index]
                out.append(TemperatureReading(sensor, stamp_ns, scaling.mpu_temperature(raw) if sensor == MPU else raw))

    def _vector(self, row: Row, sensor: str, kind: str, scale: float) -> Vector | None:
        """The three axes of a kind ("a", "g", "m"), or None where a column is missing."""
        places = [self._index.get(f"{sensor}.{kind}{axis}") for axis in "xyz"]
        x, y, z = (None if place is None else scale * row.values[place] for place in places)
        if x is None or y is None or z is None:
            return None
        return self._sampler.mounted(sensor, (x, y, z))
