"""What the declared model may lack, each by a physical mechanism: what it adds to the angular rate at 1 kHz."""

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
    rng: np.random.Generator


def temperature(scene: Scene, size: float) -> Array:
    """Size in rad/s/K; follows the element, not the thermometer."""
    return np.outer(size * scene.element, scene.direction)


def rectification(scene: Scene, size: float) -> Array:
    """A proof mass on an asymmetric spring, x + 0.01 x^2 = a: what is not linear. Size in (rad/s)/(m/s^2)^2."""
    soft = 0.01
    x = (np.sqrt(1.0 + 4.0 * soft * scene.travel.acceleration) - 1.0) / (2.0 * soft)
    return np.outer(size / soft * (x - scene.travel.acceleration), scene.direction)


def mount_resonance(scene: Scene, size: float) -> Array:
    """Board rocking on its glue in two modes (3.1, 11 Hz) under acceleration: true rotation. Size in rad/(m/s^2)."""
    angle = np.zeros_like(scene.travel.acceleration)
    for f0, damping, part in ((3.1, 0.08, 0.7), (11.0, 0.05, 0.3)):
        w = 2 * np.pi * f0
        num, den, _ = cont2discrete(([w * w], [1.0, 2 * damping * w, w * w]), 1.0 / RATE_HZ, "bilinear")
        angle += part * lfilter(num[0], den, scene.travel.acceleration)
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


MECHANISMS: dict[str, Callable[[Scene, float], Array]] = {
    "temperature_bias": temperature,
    "rectification": rectification,
    "mount_resonance": mount_resonance,
    "motor_pickup": motor_pickup,
    "bias_jump": jump,
    "motion_tone": motion_tone,
    "speed_noise": speed_noise,
}
OUTSIDE = tuple(k for k in MECHANISMS if k != "temperature_bias")
"""What the identification's first catalogue cannot name."""
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
}
"""A size at which each can be seen: where scaling to an energy starts."""
