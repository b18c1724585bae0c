"""One simulated session: rig, board and driver from switching on to the last run, without ROS and real time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.campaign.board import BNO_PERIOD, BNO_PHASE, MPU_PERIOD, BoardClock, Reads
from gsense_rig.campaign.carriage import STATE_FIELDS, Carriage, CarriageRecord
from gsense_rig.campaign.messages import Batch, RunMessages
from gsense_rig.campaign.plan import PlanRun
from gsense_rig.recording.typestore import typestore
from gsense_rig.sensors.layout import Registers
from gsense_rig.sensors.mounting import Mounting
from gsense_rig.sensors.ndof import ndof, reported_force
from gsense_rig.sensors.parameters import UnitParameters
from gsense_rig.sensors.unit import SensorUnit, UnitSpec

Array = npt.NDArray[np.float64]
PAUSE = 5.0
"""s between two runs."""
REMOUNT = 25.0
"""s that a person takes to turn the board."""
DEFAULT_START = 1_767_225_600.0
"""2026-01-01 00:00 UTC: fixed, so that a seed repeats every byte."""
BOARD_LATENCY = 2.0e-3
RIG_LATENCY = 0.5e-3
TEMPERATURE_EVERY_MPU, TEMPERATURE_EVERY_BNO, SECOND = 20, 10, 200
"""Reads from one message to the next: 10 Hz, 10 Hz, 1 Hz."""


@dataclass(frozen=True)
class SessionSpec:
    """Everything that decides the bytes of a session."""

    seed: int = 1
    effects: tuple[str, ...] = ()
    unit_seed: int | None = None
    """None: the seed."""
    start_time: float = DEFAULT_START
    """Host's time at the session's start, s since 1970."""
    unit_id: str | None = None
    """None: named after the unit's seed."""
    ndof: bool = False
    """Whether the BNO055's own fusion is in the bags, too."""

    @property
    def unit(self) -> int:
        """The unit's seed."""
        return self.seed if self.unit_seed is None else self.unit_seed

    @property
    def unit_name(self) -> str:
        """What `LinkStatus.unit_id` says."""
        return f"simulated-{self.unit}" if self.unit_id is None else self.unit_id


class Session:
    """Makes runs in order; temperature and drift go on through the pauses between them."""

    def __init__(self, spec: SessionSpec) -> None:
        self.spec = spec
        self.parameters = UnitParameters.draw(spec.unit)
        unit_spec = UnitSpec(unit_seed=spec.unit, noise_seed=spec.seed, effects=spec.effects)
        self.unit = SensorUnit(unit_spec, self.parameters)
        self._messages = RunMessages(typestore(), spec.unit_name, round(spec.start_time * 1e9))
        model = self.unit.model
        self._clock = BoardClock(self.parameters.clock_skew, spec.seed, model.clock_error, model.lost)
        self._carriage = Carriage(spec.seed)
        self._mounting: str | None = None
        self.unit.advance(self._carriage.home().history)

    def make_run(self, run: PlanRun) -> list[Batch]:
        """Pause, turn the board where the run wants it, and the run; its messages by topic."""
        if self._mounting not in (None, run.mounting):
            self._pass(self._carriage.rest(REMOUNT))
        if self._mounting != run.mounting:
            self.unit.mount(Mounting(run.mounting, seed=self.spec.unit))
            self._mounting = run.mounting
        self._pass(self._carriage.prepare(run))
        self._pass(self._carriage.rest(PAUSE))
        record = self._carriage.perform(run)
        registers = self.unit.advance(record.history)
        return self._board_batches(registers) + self._rig_batches(record)

    def _pass(self, record: CarriageRecord) -> None:
        if record.history.shape[0]:
            self.unit.advance(record.history)

    def _board_batches(self, registers: Registers) -> list[Batch]:
        mpu = self._clock.reads(registers, MPU_PERIOD)
        bno = self._clock.reads(registers, BNO_PERIOD, BNO_PHASE)
        return [
            *self._mpu_batches(registers, mpu),
            *self._bno_batches(registers, bno),
            *self._slow_batches(registers, mpu, mpu.time.shape[0] + bno.time.shape[0], mpu.lost + bno.lost),
        ]

    def _mpu_batches(self, registers: Registers, reads: Reads) -> list[Batch]:
        latency = self._clock.board_latency(reads.stamp, BOARD_LATENCY)
        config = self.unit.config.mpu
        raw = registers.mpu[reads.index].astype(np.float64)
        total = registers.lisy[reads.index].sum(axis=1, dtype=np.int64)
        rate = np.zeros((total.shape[0], 3))
        rate[:, 2] = np.radians((total * 3.3 / 16384.0 - 1.65) / 0.0033)
        make = self._messages
        every = slice(None, None, TEMPERATURE_EVERY_MPU)
        celsius = raw[:, 3] / 340.0 + 36.53
        return [
            make.imu("mpu6050", reads.stamp, latency, raw[:, 4:] / config.gyro_scale, raw[:, :3] / config.accel_scale),
            make.imu("lisy300", reads.stamp, latency + 2e-5, rate, None),
            make.temperature("mpu6050", reads.stamp[every], latency[every] + 4e-5, celsius[every]),
        ]

    def _bno_batches(self, registers: Registers, reads: Reads) -> list[Batch]:
        age = self._clock.bno_age(registers, reads)
        stamp = reads.stamp - age
        latency = self._clock.board_latency(stamp, BOARD_LATENCY) + age
        config = self.unit.config.bno
        raw = registers.bno[reads.index].astype(np.float64)
        changed = np.any(np.diff(raw[:, 3:6], axis=0, prepend=np.nan) != 0, axis=1)
        every = slice(None, None, TEMPERATURE_EVERY_BNO)
        celsius = registers.bno_temperature[reads.index].astype(np.float64)
        make = self._messages
        own = []
        if self.spec.ndof:
            rate, force = raw[:, 6:9] / config.gyro_scale, raw[:, :3] / config.accel_scale
            attitude = ndof(stamp, rate, force, raw[:, 3:6] / 16e6)
            own = [make.own_attitude(stamp, latency + 1e-5, attitude, reported_force(attitude, force))]
        return [
            *own,
            make.imu("bno055", stamp, latency, raw[:, 6:9] / config.gyro_scale, raw[:, :3] / config.accel_scale),
            make.magnetic_field(stamp[changed], latency[changed] + 2e-5, raw[changed, 3:6] / 16e6),
            make.temperature("bno055", stamp[every], latency[every] + 4e-5, celsius[every]),
        ]

    def _slow_batches(self, registers: Registers, reads: Reads, frames: int, lost: int) -> list[Batch]:
        """Battery and link, once a second."""
        every = slice(SECOND - 1, None, SECOND)
        stamp = reads.stamp[every]
        latency = self._clock.board_latency(stamp, BOARD_LATENCY)
        volts = registers.battery[reads.index][every].astype(np.float64) * 1e-3
        status = max(1.0, reads.time[-1] - reads.time[0])
        rate = frames / status + 1.0
        values = {
            "received": np.rint((stamp - reads.time[0]) * rate).astype(np.int64),
            "lost": np.rint((stamp - reads.time[0]) * (lost / status)).astype(np.int64),
            "rate_hz": rate,
            "clock_offset_s": self.spec.start_time + stamp * self._clock.skew,
            "clock_skew_ppm": self._clock.skew * 1e6,
            "uptime_s": reads.time[every] * (1.0 + self._clock.skew),
        }
        return [self._messages.battery(stamp, latency, volts), self._messages.link(stamp, latency + 1e-4, values)]

    def _rig_batches(self, record: CarriageRecord) -> list[Batch]:
        make = self._messages
        stamp, position, velocity, force = record.poses.T
        counted = 1.0 + self.unit.model.encoder_scale
        latency = self._clock.latency(stamp.shape[0], RIG_LATENCY)
        values = {name: record.states[:, 1 + i] for i, name in enumerate(STATE_FIELDS)}
        state_latency = self._clock.latency(record.states.shape[0], RIG_LATENCY)
        return [
            make.pose(stamp, latency, position * counted),
            make.joint_states(stamp, latency + 2e-5, position * counted, velocity * counted, force),
            make.rig_state(record.states[:, 0], state_latency, values),
        ]
