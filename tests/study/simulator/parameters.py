"""What a simulated session is made of. SI units unless a name says otherwise."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

DEG = float(np.pi / 180)
FIT_FREQUENCIES = (1.0, 1.5, 2.2, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
HELD_OUT_FREQUENCIES = (1.25, 2.6, 3.5, 4.5, 6.5, 7.5)


@dataclass(frozen=True)
class PlannedRun:
    """One run: `angular_frequency` 0 for a static one."""

    angular_frequency: float
    duration_s: float = 22.0
    amplitude: float = 0.15
    role: str = "fit"
    position: float = 0.0
    turned: bool = False
    """The board turned by 180 degrees about the vertical."""
    turned_deg: float = 0.0
    """By how much more it is turned."""


@dataclass(frozen=True)
class Disturbance:
    """Something that the declared model lacks. `size` in the unit that the kind's function names."""

    kind: str
    size: float


@dataclass(frozen=True)
class NoiseParameters:
    """Gyro noise: white, Markov processes, and a relaxation that has nothing to do with temperature."""

    white: float = 0.005 * DEG
    """rad/s/sqrt(Hz)."""
    markov_tau_s: tuple[float, ...] = (1.2, 8.0, 55.0, 350.0, 3000.0)
    markov_sigma: tuple[float, ...] = tuple(x * DEG for x in (0.0007, 0.0010, 0.0010, 0.0010, 0.0030))
    """rad/s; the last one is a random walk of about 1e-4 deg/s/sqrt(s) for as long as a session lasts."""
    relaxation: float = 0.0015 * DEG
    """rad/s, with `relaxation_tau_s`: mechanical stress after switching on."""
    relaxation_tau_s: float = 130.0


@dataclass(frozen=True)
class ThermalParameters:
    """Die, board and ambient as capacities behind resistances; the mechanical element lags the die."""

    ambient_degc: float = 23.0
    ambient_swing_k: float = 0.4
    ambient_period_s: float = 700.0
    board_rise_k: float = 6.0
    board_tau_s: float = 140.0
    die_rise_k: float = 1.5
    die_tau_s: float = 7.0
    element_tau_s: float = 4.0
    warm_for_s: float = 20.0
    """How long the board had been on when the session begins."""
    thermometer_noise_k: float = 0.06
    thermometer_lsb_k: float = 1 / 340
    thermometer_hz: float = 10.0


@dataclass(frozen=True)
class ChainParameters:
    """Sampling, filters, encoder."""

    rate_hz: float = 200.0
    clock_ppm: float = 30.0
    stamp_jitter_s: float = 3e-5
    encoder_hz: float = 200.0
    encoder_quantum: float = 5e-5
    encoder_jitter_s: float = 5e-5
    encoder_scale: float = 0.0
    """What the encoder reads too much of every metre."""
    belt_hz: float = float("inf")
    """Where the carriage would ring on the belt between it and the encoder, which is on the carriage by default."""
    filter_hz: float = 42.0
    """Second-order low-pass of both sensors: 5.4 ms of delay against the encoder."""
    gyro_lsb: float = DEG / 65.5
    accel_lsb: float = 9.80665 / 8192
    accel_white: float = 4e-3
    """m/s^2/sqrt(Hz)."""
    accel_scale: float = 0.01
    accel_misalignment: float = 0.5 * DEG
    accel_bias: float = 0.2
    loss: float = 0.0
    """Probability of a lost sample; a quarter of the losses come in bursts."""


@dataclass(frozen=True)
class MagneticParameters:
    """A magnetometer on the board, and what bends its field."""

    steel: float = 0.0
    """Standard deviation of the moments of four magnetised pieces beside the rail, A m^2."""
    turns: float = 0.0
    """How many times the motor's pair of leads runs along the rail."""
    rate_hz: float = 20.0
    average_s: float = 0.05
    noise: float = 4e-7
    """T."""
    lsb: float = 1e-6 / 16
    current_topic: bool = False
    """Whether rig/state tells the motor's current."""


@dataclass(frozen=True)
class SessionParameters:
    """A session; everything random follows `seed`."""

    seed: int = 0
    plan: tuple[PlannedRun, ...] = ()
    disturbances: tuple[Disturbance, ...] = ()
    g_typical: float = 0.1 * DEG / 9.80665
    """Standard deviation of G's elements, (rad/s)/(m/s^2)."""
    g_matrix: tuple[tuple[float, float, float], ...] | None = None
    mounting_error: float = 3 * DEG
    frame: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    """Nominal rotation from carriage (x along the rail, z up) to sensor axes."""
    rail_shape: str = "arc"
    """`arc` (a constant curvature and twist), `spline` (that with uneven knots) or `wavy` (more so, a hand apart)."""
    temperature_topic: bool = True
    start_s: float = 0.0
    """Moves the whole session in time."""
    noise: NoiseParameters = field(default_factory=NoiseParameters)
    magnetics: MagneticParameters | None = None
    thermal: ThermalParameters = field(default_factory=ThermalParameters)
    chain: ChainParameters = field(default_factory=ChainParameters)


def sweep_plan(seed: int, statics: int = 2, held_out: bool = True) -> tuple[PlannedRun, ...]:
    """A plain sweep: nine frequencies to fit, six held out, statics, in random order."""
    rng = np.random.default_rng([seed, 991])
    runs = [PlannedRun(w, 22.0 if w > 1.2 else 26.0) for w in FIT_FREQUENCIES]
    if held_out:
        runs += [PlannedRun(w, role="held_out") for w in HELD_OUT_FREQUENCIES]
    runs += [PlannedRun(0.0, duration_s=60.0) for _ in range(statics)]
    return tuple(runs[i] for i in rng.permutation(len(runs)))


def turned_plan(seed: int) -> tuple[PlannedRun, ...]:
    """Twelve minutes: a sweep, a short stroke, the board turned by 180 degrees, statics at three places."""
    rng = np.random.default_rng([seed, 993])
    runs = [PlannedRun(w, 30.0) for w in (1.0, 2.0, 5.0, 6.0, 8.0)]
    runs += [PlannedRun(8.0, 30.0, amplitude=0.05), PlannedRun(0.0, 40.0), PlannedRun(0.0, 40.0, position=0.2)]
    runs += [PlannedRun(w, 30.0, role="held_out") for w in (3.0, 4.0, 7.0)]
    order = rng.permutation(len(runs))
    turned = [PlannedRun(w, 30.0, turned=True) for w in (3.0, 7.0)]
    turned += [PlannedRun(5.0, 30.0, role="held_out", turned=True), PlannedRun(0.0, 36.0, turned=True)]
    return tuple([runs[i] for i in order] + turned)
