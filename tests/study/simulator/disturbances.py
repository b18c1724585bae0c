"""What the declared model may lack, each by a physical mechanism, at 1 kHz."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from .carriage import RATE_HZ, Travel

Array = NDArray[np.float64]

IN_GEOMETRY = ("rail_curvature",)
"""Kinds that the rail itself makes."""
IN_CHAIN = ("time_offset",)
"""Kinds that the sampling makes."""


@dataclass(frozen=True)
class Scene:
    """What a mechanism may see; sensor axes."""

    time: Array
    """Session time, shape (n,)."""
    travel: Travel
    element: Array
    """Temperature of the gyro's element above 25 degC, K, shape (n,)."""
    along: Array
    """The rail's direction, shape (3,)."""
    direction: Array
    """Unit vector of this session: how the mechanism acts on the axes."""
    session_s: float
    volts: Array
    """The board's cell, V, shape (n,)."""
    crept: Array
    """A walk of unit strength that goes on only while the motor runs, sqrt(s), shape (n, 3)."""
    rng: np.random.Generator

    @property
    def swayed(self) -> Array:
        """Acceleration along the sensor's axis nearest to the rail: what the board and its parts sway with, (n,)."""
        return np.asarray(np.sign(self.along[np.argmax(np.abs(self.along))]) * self.travel.acceleration)


def temperature(scene: Scene, size: float) -> Array:
    """Size in rad/s/K; follows the element, not the thermometer."""
    return np.outer(size * scene.element, scene.direction)


def rectification(scene: Scene, size: float) -> Array:
    """A proof mass on an asymmetric spring, x + 0.003 x^2 = a: what is not linear. Size in (rad/s)/(m/s^2)^2."""
    soft = 0.003
    x = (np.sqrt(1.0 + 4.0 * soft * scene.swayed) - 1.0) / (2.0 * soft)
    return np.outer(size / soft * (x - scene.swayed), scene.direction)


def mount_resonance(scene: Scene, size: float) -> Array:
    """Board rocking on its glue in two modes (3.1, 11 Hz) under acceleration: true rotation. Size in rad/(m/s^2)."""
    angle = np.zeros_like(scene.swayed)
    for f0, damping, part in ((3.1, 0.08, 0.7), (11.0, 0.05, 0.3)):
        w = 2 * np.pi * f0
        num, den, _ = cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), 1.0 / RATE_HZ, "bilinear")
        angle += part * lfilter(num[0], den, scene.swayed)
    return np.outer(size * np.gradient(angle, 1.0 / RATE_HZ), scene.direction)


def motor_pickup(scene: Scene, size: float) -> Array:
    """The motor's current, which overcomes friction and inertia. Size in (rad/s)/N."""
    return np.outer(size * scene.travel.force, scene.direction)


def jump(scene: Scene, size: float) -> Array:
    """The bias steps once, somewhere in the middle half of the session. Size in rad/s."""
    when = scene.session_s * (0.25 + 0.5 * abs(float(scene.direction[0])))
    return np.outer(size * (scene.time > when), scene.direction)


def motion_tone(scene: Scene, size: float) -> Array:
    """A tone at 17.3 Hz only in motion (a fan that the motor's current switches on). Size in rad/s."""
    moving = np.convolve(np.abs(scene.travel.velocity) > 5e-3, np.ones(1001), "same") > 0
    return np.outer(size * np.sin(2 * np.pi * 17.3 * scene.time) * moving, scene.direction)


def speed_noise(scene: Scene, size: float) -> Array:
    """White noise that grows with speed, up to 500 Hz. Size: rad/s/sqrt(Hz) at 1 m/s."""
    draws = scene.rng.standard_normal((len(scene.time), 3)) * np.sqrt(RATE_HZ / 2)
    return size * np.abs(scene.travel.velocity)[:, None] * draws


def hard_spring(scene: Scene, size: float) -> Array:
    """A proof mass whose spring hardens like tan: odd orders. Size in rad/s at 10 m/s^2."""
    x = scene.swayed / 10.0
    return np.outer(size * (np.arctan(0.8 * x) / 0.8 - x), scene.direction)


def back_emf(scene: Scene, size: float) -> Array:
    """The motor's terminal voltage through a 20 Hz input filter, without its resistive part. Size in rad/s at 1 m/s."""
    return np.outer(size * _first_order(scene.travel.velocity, 20.0), scene.direction)


def brush_current(scene: Scene, size: float) -> Array:
    """The current that overcomes friction alone, slower than the reversal. Size in rad/s."""
    return np.outer(size * np.tanh(scene.travel.velocity / 0.01), scene.direction)


def feedthrough(scene: Scene, size: float) -> Array:
    """A capacitive coupling: acceleration through a 60 Hz high-pass. Size in rad/s at 100 m/s^3."""
    a = scene.swayed
    return np.outer(size * 2 * np.pi * 60.0 / 100.0 * (a - _first_order(a, 60.0)), scene.direction)


def air_drag(scene: Scene, size: float) -> Array:
    """A plate in the wind of its own motion. Size in rad/s at 1 m/s."""
    v = scene.travel.velocity
    return np.outer(size * v * np.abs(v), scene.direction)


def power_drawn(scene: Scene, size: float) -> Array:
    """The motor's power heats and unheats a resistor beside the gyro: a v. Size in rad/s at 10 W/kg."""
    return np.outer(size / 10.0 * scene.travel.acceleration * scene.travel.velocity, scene.direction)


def supply(scene: Scene, size: float) -> Array:
    """The zero-rate output follows the board's cell. Size in rad/s/V."""
    return np.outer(size * (scene.volts - 3.9), scene.direction)


def creep(scene: Scene, size: float) -> Array:
    """Shaking lets the gyro's mount creep: its bias walks while the motor runs. Size in rad/s/sqrt(s)."""
    return size * scene.crept


def _first_order(series: Array, corner_hz: float) -> Array:
    k = 1.0 - np.exp(-2 * np.pi * corner_hz / RATE_HZ)
    return np.asarray(lfilter([k], [1.0, k - 1.0], series, zi=[series[0] * (1 - k)])[0])


def bearing_play(scene: Scene, size: float) -> Array:
    """Bouc-Wen hysteresis of the bearings over 0.4 mm of travel. Size: half the turn in rad."""
    z = np.zeros(len(scene.time))
    travel = np.diff(scene.travel.position) / 4e-4
    state = 0.0
    for i, step in enumerate(travel):
        state += step - abs(step) * state  # z' = s' (1 - |z| sign(s' z)) of exponent one, exactly at the limit
        state = min(max(state, -1.0), 1.0)
        z[i + 1] = state
    return np.outer(size * z, scene.direction)


def belt_lever(scene: Scene, size: float) -> Array:
    """The belt pulls above the centre of mass of a carriage on elastic bearings (35 Hz). Size in rad at 10 m/s^2."""
    w = 2 * np.pi * 35.0
    num, den, _ = cont2discrete(([w * w], [1.0, 0.3 * w, w * w]), 1.0 / RATE_HZ, "bilinear")
    return np.outer(size / 10.0 * lfilter(num[0], den, scene.travel.acceleration), scene.direction)


def drag_lever(scene: Scene, size: float) -> Array:
    """Grease drags below the centre of mass and thins a little with speed. Size in rad at 1 m/s."""
    v = scene.travel.velocity
    return np.outer(size * 20.0 * np.arcsinh(v / 20.0), scene.direction)


def teeth(scene: Scene, size: float) -> Array:
    """A ripple of 5.08 mm with a second harmonic: the angle that makes a rate of the size in rad/s at 0.1 m/s."""
    k = 2 * np.pi / 5.08e-3
    s = scene.travel.position
    return np.outer(size / (0.1 * k) * (np.sin(k * s + 1.0) + 0.1 * np.sin(2 * k * s)), scene.direction)


MECHANISMS: dict[str, Callable[[Scene, float], Array]] = {
    "temperature_bias": temperature,
    "rectification": rectification,
    "mount_resonance": mount_resonance,
    "motor_pickup": motor_pickup,
    "bias_jump": jump,
    "motion_tone": motion_tone,
    "speed_noise": speed_noise,
    "hard_spring": hard_spring,
    "back_emf": back_emf,
    "brush_current": brush_current,
    "feedthrough": feedthrough,
    "supply": supply,
    "air_drag": air_drag,
    "power_drawn": power_drawn,
    "creep": creep,
}
"""What each adds to the gyro, rad/s."""
TURNS: dict[str, Callable[[Scene, float], Array]] = {
    "bearing_play": bearing_play,
    "belt_lever": belt_lever,
    "drag_lever": drag_lever,
    "teeth": teeth,
}
"""How each truly turns the carriage, rad about the carriage's axes: the gyro sees the rate, gravity tilts."""
NAMED = {
    "temperature_bias": "temperature_bias",
    "rail_curvature": "rail_curvature",
    "time_offset": "time_offset",
    "rectification": "g_squared",
    "hard_spring": "g_cubed",
    "back_emf": "speed_pickup",
    "brush_current": "friction_pickup",
    "feedthrough": "jerk_coupling",
    "supply": "supply_voltage",
    "bearing_play": "reversal_rock",
    "belt_lever": "belt_tilt",
    "teeth": "belt_tooth",
    "bias_jump": "bias_jump",
    "motion_tone": "line_tone",
    "speed_noise": "speed_noise",
    "creep": "bias_drift",
    "mount_resonance": "g_resonance",
    "motor_pickup": "friction_pickup",
    "drag_lever": "viscous_tilt",
}
"""The catalogue's name of each mechanism that it has one for."""
RANDOM = ("speed_noise", "creep")
"""What is drawn anew in every run: it can be named, and nothing of it taken off."""
TURNED_ONLY = ("drag_lever",)
"""In one mounting it hides in G: only the turned board shows it."""
BESIDE = {"motor_pickup": frozenset({"speed_pickup"})}
"""What may be named too: a motor's current overcomes drag as well as friction."""
OUTSIDE = tuple(k for k in MECHANISMS if k not in NAMED)
"""What the catalogue cannot name."""
UNIT_SIZE = {
    "temperature_bias": 2e-4,
    "rail_curvature": 1e-3,
    "time_offset": 0.01,
    "rectification": 2e-5,
    "mount_resonance": 1e-5,
    "motor_pickup": 2e-5,
    "bias_jump": 3e-4,
    "motion_tone": 3e-5,
    "speed_noise": 1e-4,
    "hard_spring": 1e-4,
    "back_emf": 1e-4,
    "brush_current": 1e-4,
    "feedthrough": 1e-4,
    "supply": 1e-2,
    "bearing_play": 1e-5,
    "belt_lever": 1e-5,
    "drag_lever": 1e-5,
    "teeth": 1e-3,
    "air_drag": 1e-4,
    "power_drawn": 1e-4,
    "creep": 5e-6,
}
"""A size at which each can be seen: where scaling to an energy starts."""
