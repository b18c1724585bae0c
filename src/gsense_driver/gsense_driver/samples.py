"""From frames to samples in SI units.

Axes are the sensor's own unless a mounting says otherwise; accelerations are specific force (+9.81 m/s^2 up at rest).
Each frame gives several readings, all with one stamp.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gsense_driver import scaling
from gsense_driver.frames import (
    FLAG_BATTERY_LOW,
    FLAG_READ_FAILED,
    TYPE_BNO_AMG,
    TYPE_BNO_NDOF,
    TYPE_MPU,
    TYPE_STATUS,
    Frame,
    StatusBody,
    bno_amg_fields,
    decode_bno_ndof,
    decode_status,
    mpu_registers,
    mpu_rest,
)
from gsense_driver.mounting import Mounting, Vector
from gsense_driver.scaling import Scales, ScaleSettings, scales_before_status, scales_from_status

MPU = "mpu6050"
BNO = "bno055"
LISY = "lisy300"
SENSORS = (MPU, BNO, LISY)
Quaternion = tuple[float, float, float, float]

_SENSOR_OF_TYPE = {TYPE_MPU: MPU, TYPE_BNO_AMG: BNO, TYPE_BNO_NDOF: BNO}
_TEMPERATURE_PERIOD_NS = 100_000_000
_SAME_INSTANT_NS = 1_000_000  # a BNO sample is 10 ms; what goes back by more is a clock that was set
_BATTERY_PERIOD_NS = 1_000_000_000


class ImuReading(NamedTuple):
    """Raw rate in rad/s (3,) and specific force in m/s^2 (3,), None where the sensor has none."""

    sensor: str
    stamp_ns: int
    rate: Vector | None
    force: Vector | None


class OrientationReading(NamedTuple):
    """The BNO055's own fusion: orientation (w, x, y, z) in its world frame, and specific force in m/s^2 (3,)."""

    stamp_ns: int
    quaternion: Quaternion
    force: Vector


class FieldReading(NamedTuple):
    """Magnetic field in tesla (3,)."""

    stamp_ns: int
    field: Vector


class TemperatureReading(NamedTuple):
    """Die temperature in degrees Celsius."""

    sensor: str
    stamp_ns: int
    celsius: float


class BatteryReading(NamedTuple):
    """Voltage of the board's cell in V, and the board's own verdict on it."""

    stamp_ns: int
    volts: float
    low: bool


Reading = ImuReading | OrientationReading | FieldReading | TemperatureReading | BatteryReading


@dataclass
class SampleCounts:
    """Counts since the node started."""

    samples: dict[str, int] = field(default_factory=lambda: dict.fromkeys(SENSORS, 0))
    read_failed: dict[str, int] = field(default_factory=lambda: dict.fromkeys(SENSORS, 0))
    repeated: int = 0  # BNO055 frames whose sample is the previous one
    unknown_type: int = 0


@dataclass
class BoardState:
    """The newest of what the board says about itself."""

    status: StatusBody | None = None
    battery_v: float | None = None
    battery_low: bool = False
    radio_given_up: int = 0  # u8 on the wire; wraps
    i2c_errors: int = 0  # u8 on the wire; wraps
    retransmissions: int = 0
    calib_stat: int | None = None


class Every:
    """True once per period of stamps, keeping the phase."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._due_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether something is due at this stamp."""
        if self._due_ns is not None and 0 < self._due_ns - stamp_ns <= self._period_ns:
            return False
        if self._due_ns is None or abs(stamp_ns - self._due_ns) > 2 * self._period_ns:
            self._due_ns = stamp_ns
        if stamp_ns < self._due_ns:
            return False
        self._due_ns += self._period_ns
        return True


def gravity_in_sensor(q: Quaternion) -> Vector:
    """Specific force at rest in the sensor's axes, m/s^2: the world's (0, 0, g) rotated back by the unit q."""
    w, x, y, z = q
    g = scaling.G
    return 2.0 * g * (x * z - w * y), 2.0 * g * (y * z + w * x), g * (w * w - x * x - y * y + z * z)


class Sampler:
    """Turns frames into readings, by the newest STATUS."""

    def __init__(self, settings: ScaleSettings, mountings: Mapping[str, Mounting] | None = None) -> None:
        self.counts = SampleCounts()
        self.board = BoardState()
        self.configure(settings, mountings or {})
        self._last_inertial: bytes | None = None
        self._last_bno_ns = 0
        self._last_field = bytes(6)  # zeros: the magnetometer has not measured yet
        self._battery = Every(_BATTERY_PERIOD_NS)
        self._temperature = {MPU: Every(_TEMPERATURE_PERIOD_NS), BNO: Every(_TEMPERATURE_PERIOD_NS)}

    def configure(self, settings: ScaleSettings, mountings: Mapping[str, Mounting]) -> None:
        """Take new parameters; the configuration known from STATUS stays in force."""
        self._settings = settings
        self._mountings = {name: m for name, m in mountings.items() if not m.identity}
        self._rescale()

    @property
    def scales(self) -> Scales:
        """The scales in force."""
        return self._scales

    def restart(self) -> None:
        """The board started anew: nothing of before is a predecessor of its samples."""
        self._last_inertial = None

    def take_status(self, frame: Frame) -> None:
        """Note the configuration in a STATUS frame."""
        status = decode_status(frame.body)
        changed = self.board.status is None or status[:12] != self.board.status[:12]
        self.board.status = status
        self.board.battery_low = bool(frame.flags & FLAG_BATTERY_LOW)
        if changed:
            self._rescale()

    def readings(self, frame: Frame, stamp_ns: int) -> list[Reading]:
        """All readings of one frame. `stamp_ns`: host time of the frame's board time."""
        kind = frame.type
        if kind == TYPE_STATUS:
            return []
        if kind not in _SENSOR_OF_TYPE:
            self.counts.unknown_type += 1
            return []
        if frame.flags & FLAG_READ_FAILED:
            self._count_failed(kind)
            return []
        if kind == TYPE_MPU:
            return self._mpu(frame, stamp_ns)
        if kind == TYPE_BNO_AMG:
            return self._bno_amg(frame.body, stamp_ns)
        return self._bno_ndof(frame.body, stamp_ns)

    def _rescale(self) -> None:
        status = self.board.status
        settings = self._settings
        self._scales = scales_from_status(status, settings) if status else scales_before_status(settings)

    def _count_failed(self, kind: int) -> None:
        self.counts.read_failed[_SENSOR_OF_TYPE[kind]] += 1
        if kind == TYPE_MPU:
            self.counts.read_failed[LISY] += 1  # it shares the body, which is not valid

    def temperature_due(self, sensor: str, stamp_ns: int) -> bool:
        """Whether a temperature is to be published with this stamp (10 Hz)."""
        return self._temperature[sensor].due(stamp_ns)

    def mounted(self, sensor: str, v: Vector) -> Vector:
        """Rotate a vector by the sensor's mounting."""
        mounting = self._mountings.get(sensor)
        return v if mounting is None else mounting.apply(v)

    def _mpu(self, frame: Frame, stamp_ns: int) -> list[Reading]:
        ax, ay, az, raw_t, gx, gy, gz = mpu_registers(frame.body)
        lisy, battery_mv, given_up, i2c, retries, _ = mpu_rest(frame.body, 14)
        board = self.board
        board.radio_given_up, board.i2c_errors, board.retransmissions = given_up, i2c, retries
        board.battery_v, board.battery_low = battery_mv * 1e-3, bool(frame.flags & FLAG_BATTERY_LOW)
        a, g = self._scales.mpu_accel, self._scales.mpu_gyro
        force, rate = (a * ax, a * ay, a * az), (g * gx, g * gy, g * gz)
        yaw = (0.0, 0.0, scaling.lisy_rate(lisy))
        if self._mountings:
            force, rate, yaw = self.mounted(MPU, force), self.mounted(MPU, rate), self.mounted(LISY, yaw)
        samples = self.counts.samples
        samples[MPU] += 1
        samples[LISY] += 1
        out: list[Reading] = [ImuReading(MPU, stamp_ns, rate, force), ImuReading(LISY, stamp_ns, yaw, None)]
        if self._temperature[MPU].due(stamp_ns):
            out.append(TemperatureReading(MPU, stamp_ns, scaling.mpu_temperature(raw_t)))
        if self._battery.due(stamp_ns):
            out.append(BatteryReading(stamp_ns, board.battery_v, board.battery_low))
        return out

    def _bno_amg(self, body: bytes, stamp_ns: int) -> list[Reading]:
        ax, ay, az, mx, my, mz, gx, gy, gz, calib_stat, temperature, age_us = bno_amg_fields(body)
        stamp_ns -= age_us * 1000
        inertial = body[0:6] + body[12:18]
        if inertial == self._last_inertial:
            self.counts.repeated += 1
        # Often only the gyro's or the accelerometer's part repeats, at the same instant: age and clock are known to
        # microseconds, and a stamp does not go back by them.
        if 0 < self._last_bno_ns - stamp_ns < _SAME_INSTANT_NS:
            stamp_ns = self._last_bno_ns
        self._last_inertial = inertial
        self._last_bno_ns = stamp_ns
        scales = self._scales
        a, g, m = scales.bno_accel, scales.bno_gyro, scales.bno_mag
        force, rate = (a * ax, a * ay, a * az), (g * gx, g * gy, g * gz)
        if self._mountings:
            force, rate = self.mounted(BNO, force), self.mounted(BNO, rate)
        self.counts.samples[BNO] += 1
        out: list[Reading] = [ImuReading(BNO, stamp_ns, rate, force)]
        field_bytes = body[6:12]
        if field_bytes != self._last_field:
            self._last_field = field_bytes
            out.append(FieldReading(stamp_ns, self.mounted(BNO, (m * mx, m * my, m * mz))))
        self._bno_common(out, stamp_ns, calib_stat, temperature)
        return out

    def _bno_ndof(self, body: bytes, stamp_ns: int) -> list[Reading]:
        counts = decode_bno_ndof(body)
        norm = (counts.qw**2 + counts.qx**2 + counts.qy**2 + counts.qz**2) ** 0.5
        if norm < 8192.0:  # half of 2^14: the chip's fusion does not run yet
            self.counts.read_failed[BNO] += 1
            return []
        if body[6:20] == self._last_inertial:
            self.counts.repeated += 1
        self._last_inertial = body[6:20]
        q = (counts.qw / norm, counts.qx / norm, counts.qy / norm, counts.qz / norm)
        a = self._scales.bno_accel
        gx, gy, gz = gravity_in_sensor(q)
        force = (a * counts.lx + gx, a * counts.ly + gy, a * counts.lz + gz)
        self.counts.samples[BNO] += 1
        out: list[Reading] = [OrientationReading(stamp_ns, q, force)]
        self._bno_common(out, stamp_ns, counts.calib_stat, counts.temperature)
        return out

    def _bno_common(self, out: list[Reading], stamp_ns: int, calib_stat: int, temperature: int) -> None:
        self.board.calib_stat = calib_stat
        if self._temperature[BNO].due(stamp_ns):
            out.append(TemperatureReading(BNO, stamp_ns, self._celsius(temperature)))

    def _celsius(self, raw: int) -> float:
        if self._scales.bno_temperature == 2.0:  # Fahrenheit, 2 degrees per count
            return (2.0 * raw - 32.0) / 1.8
        return float(raw)
