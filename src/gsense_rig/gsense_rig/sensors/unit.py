"""One simulated board: parameters, effects, mounting, configuration, and the state of its physics."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from gsense_rig.sensors import filters, layout
from gsense_rig.sensors.chip_config import LISY_FILTER, ChipConfig
from gsense_rig.sensors.constants import FULL_CELL, REFERENCE_TEMPERATURE, STEP
from gsense_rig.sensors.drivers import GyroDriver
from gsense_rig.sensors.effects import parse_effects
from gsense_rig.sensors.kernel import INT16_MAX, advance
from gsense_rig.sensors.layout import Array, Registers, Settings
from gsense_rig.sensors.model import SignalModel
from gsense_rig.sensors.mounting import Mounting, Site
from gsense_rig.sensors.parameters import UnitParameters

SHORTEST_REST = 0.2
"""Steps."""


@dataclass(frozen=True)
class UnitSpec:
    """Everything that decides what a simulated board measures; picklable."""

    unit_seed: int = 1
    """Draws the unit: its biases, G, temperatures."""
    noise_seed: int = 1
    """Draws the noise."""
    effects: tuple[str, ...] = ()
    """NAME=VALUE each."""
    mounting: str = "0"
    site: Site = field(default_factory=Site)


class SensorUnit:
    """Advances the physics of one board; `configure` and `mount` take effect from the next step."""

    def __init__(self, spec: UnitSpec, parameters: UnitParameters | None = None) -> None:
        self.spec = spec
        self.parameters = UnitParameters.draw(spec.unit_seed) if parameters is None else parameters
        self.model = SignalModel.of_unit(self.parameters)
        for effect in parse_effects(spec.effects):
            effect.apply(self.model)
        self.config = ChipConfig()
        self.state = layout.fresh_state()
        self._rng = np.random.default_rng([spec.noise_seed, 0x6E6F6973])
        self._rattle_rng = np.random.default_rng([spec.noise_seed, 0x72617474])
        self._rattles = bool(np.any(self.model.gyro_terms[:, :, GyroDriver.RATTLE_X : GyroDriver.RATTLE_Z + 1]))
        self._mounting = Mounting(spec.mounting, seed=spec.unit_seed)
        self.settings = self._settings()

    def mount(self, mounting: Mounting) -> None:
        """Turns the board on the carriage."""
        self._mounting = mounting
        self.settings = self.settings._replace(board=mounting.board_from_carriage())

    def configure(self, config: ChipConfig) -> None:
        """Takes over new configuration registers."""
        self.config = config
        self.settings = self._settings()

    def advance(self, history: Array) -> Registers:
        """The registers after each of the n steps of `history` (n, 5: t, s, v, a, motor current; SI, 1 ms apart)."""
        n = history.shape[0]
        out = Registers(
            time=np.empty(n),
            mpu=np.empty((n, 7), dtype=np.int16),
            bno=np.empty((n, 22), dtype=np.int16),
            bno_temperature=np.empty(n, dtype=np.int8),
            bno_time=np.empty(n),
            lisy=np.empty((n, 16), dtype=np.uint16),
            battery=np.empty(n, dtype=np.uint16),
        )
        noise = self._rng.standard_normal((n, layout.NOISE_COLUMNS))
        if self._rattles:
            noise = np.hstack([noise, self._rattle_rng.standard_normal((n, layout.RATTLE_COLUMNS))])
        advance(np.ascontiguousarray(history), noise, self.settings, self.state, out)
        return out

    def _settings(self) -> Settings:
        unit, model, site = self.parameters, self.model, self.spec.site
        keep, drive = _flicker([gyro.flicker for gyro in unit.gyros])
        low_pass, delay = _filters(self.config, model.gyro_delay)
        mpu, bno = self.config.mpu, self.config.bno
        return Settings(
            board=self._mounting.board_from_carriage(),
            gravity=site.gravity_reaction(),
            earth=site.rotation_rate(),
            field=site.magnetic_field(),
            tilt=model.tilt,
            field_terms=model.field,
            terms=model.gyro_terms,
            gyro_matrix=np.stack([gyro.matrix for gyro in unit.gyros]),
            accel_matrix=np.stack([unit.mpu_accelerometer.matrix, unit.bno_accelerometer.matrix]),
            accel_bias=np.stack([unit.mpu_accelerometer.bias, unit.bno_accelerometer.bias]),
            mag_matrix=unit.magnetometer.matrix,
            hard_iron=unit.magnetometer.hard_iron,
            white=_white(unit),
            flicker_keep=keep,
            flicker_drive=drive,
            walk=model.random_walk * math.sqrt(STEP),
            mag_noise=unit.magnetometer.noise,
            thermal=_thermal(unit, model),
            supply=_supply(unit),
            tone=np.array([2.0 * math.pi * model.tone_frequency, model.tone_phase]),
            jump_time=model.jump_time,
            sway=_coefficients(filters.mode(model.sway_frequency, model.sway_damping)),
            tooth=np.array([2.0 * math.pi / model.tooth_pitch, model.tooth_phase]),
            play=model.play,
            rattle=_rattle(model.rattle_bandwidth),
            filters=low_pass,
            delay=delay,
            hold_step=_hold_steps(self.config, unit),
            scale=np.array([mpu.gyro_scale, mpu.accel_scale, bno.gyro_scale, bno.accel_scale, 16e6]),
            limit=_limits(self.config, model),
            coarse=np.maximum(1.0, np.rint(model.gyro_step * np.array([mpu.gyro_scale, bno.gyro_scale]))),
            asleep=mpu.asleep,
            fuses=bno.fuses,
        )


def _supply(unit: UnitParameters) -> Array:
    supply = unit.supply
    return np.array([supply.regulator, supply.converter_noise, supply.cell, supply.discharge * STEP, FULL_CELL])


def _limits(config: ChipConfig, model: SignalModel) -> Array:
    """Largest values of the MPU's gyro and accelerometer and the BNO's, LSB."""
    mpu, bno = config.mpu, config.bno
    gyros = np.array([mpu.gyro_scale, bno.gyro_scale]) * [model.gyro_limit, min(model.gyro_limit, bno.gyro_range)]
    accels = np.array([mpu.accel_scale, bno.accel_scale]) * [model.accel_limit, min(model.accel_limit, bno.accel_range)]
    return np.asarray(np.minimum(INT16_MAX, np.rint([gyros[0], accels[0], gyros[1], accels[1]])), dtype=np.float64)


def _rattle(bandwidth: float) -> Array:
    """First-order process of unit variance: what is kept and what is driven in a step."""
    keep = math.exp(-2.0 * math.pi * bandwidth * STEP)
    return np.array([keep, math.sqrt(1.0 - keep**2)])


def _hold_steps(config: ChipConfig, unit: UnitParameters) -> Array:
    """Samples a step of the four sample-and-hold clocks; no chip samples faster than the physics steps."""
    bno = np.array([config.bno.gyro_rate, config.bno.accel_rate, config.bno.mag_rate]) * (1.0 + unit.bno_clock_skew)
    return np.minimum(1.0, STEP * np.array([config.mpu.rate * (1.0 + unit.mpu_clock_skew), *bno]))


def _white(unit: UnitParameters) -> Array:
    """Standard deviation a step at 1 kHz: a one-sided density N has the variance N^2 / (2 step)."""
    gyro = [unit.gyros[chip].noise_density for chip in layout.GYRO_CHIP]
    accel = [unit.mpu_accelerometer.noise_density] * 3 + [unit.bno_accelerometer.noise_density] * 3
    return np.array(gyro + accel) * math.sqrt(0.5 / STEP)


def _flicker(floors: list[float]) -> tuple[Array, Array]:
    """First-order processes with a common variance, a decade apart, sum to a 1/f spectrum.

    An Allan floor F belongs to the one-sided density h / f with h = F^2 / (2 ln 2); a process has the variance h ln 10.
    """
    times = np.array(layout.FLICKER_TIMES)
    keep = np.exp(-STEP / times)
    sigma = np.array(floors) * math.sqrt(math.log(10.0) / (2.0 * math.log(2.0)))
    return keep, np.outer(sigma, np.sqrt(1.0 - keep**2))


def _coefficients(low_pass: filters.LowPass) -> Array:
    return np.array([*low_pass.b, low_pass.a1, low_pass.a2])


def _filters(config: ChipConfig, gyro_delay: float) -> tuple[Array, Array]:
    """Biquads (5, 5), and the delays (13, 2) of the channels: whole steps and the rest."""
    mpu, bno = config.mpu, config.bno
    specs = (mpu.gyro_filter, bno.gyro_filter, LISY_FILTER, mpu.accel_filter, bno.accel_filter)
    designs = [filters.design(spec) for spec in specs]
    biquads = np.array([_coefficients(low_pass) for low_pass in designs])
    delay: Array = np.array([designs[f].pure_delay for f in layout.FILTER_OF])
    delay[: layout.GYROS] += gyro_delay
    # A rest below 0.2 steps would make the all-pass ring: it takes a whole step with it, or is left out at the start.
    steps = np.round(delay / STEP, 9)
    whole = np.maximum(0.0, np.floor(steps - SHORTEST_REST))
    rest = steps - whole
    return biquads, np.column_stack([whole, np.where(rest < SHORTEST_REST, 0.0, rest)])


def _thermal(unit: UnitParameters, model: SignalModel) -> Array:
    th = unit.thermal
    lag = -math.expm1(-STEP / model.temperature_lag) if model.temperature_lag > 0 else 1.0
    return np.array(
        [
            th.ambient,
            th.rise,
            -math.expm1(-STEP / th.time_constant),
            th.wander * math.sqrt(STEP),
            lag,
            th.bno_offset,
            th.register_noise,
            REFERENCE_TEMPERATURE,
        ]
    )
