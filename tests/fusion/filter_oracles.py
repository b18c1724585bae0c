"""The filters, slow and clear: matrices, scipy's rotations, filterpy. Oracles of the compiled ones."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from filterpy.kalman import KalmanFilter
from scipy.spatial.transform import Rotation

from gsense_fusion.attitude.complementary import ComplementaryParameters
from gsense_fusion.attitude.kalman import KalmanParameters
from gsense_fusion.attitude.mahony import MahonyParameters

Array = np.ndarray[Any, np.dtype[np.float64]]
UP = np.array([0.0, 0.0, 1.0])


def usable(vector: Array | None) -> bool:
    return vector is not None and bool(np.isfinite(vector).all()) and bool(np.any(vector != 0.0))


def smallest_turn(turn: Rotation, force: Array) -> Array:
    """Rotation vector in the earth frame that brings the measured vertical to the true one."""
    up = turn.apply(force / np.linalg.norm(force))
    axis = np.cross(up, UP)
    length = np.linalg.norm(axis)
    angle = np.arctan2(length, up[2])
    return axis / length * angle if length > 0 else np.array([angle, 0.0, 0.0])


def to_north(turn: Rotation, mag: Array) -> float:
    east, north, _ = turn.apply(mag)
    return float(np.arctan2(east, north))


@dataclass
class Complementary:
    """Equations 5.1, 5.2 with the gate of figure 5.2."""

    turn: Rotation
    p: ComplementaryParameters = field(default_factory=ComplementaryParameters)
    age: float = 0.0

    def step(self, dt: float, rate: Array, force: Array, mag: Array | None) -> Rotation:
        self.turn = self.turn * Rotation.from_rotvec(rate * dt)
        self.age += dt
        if usable(force) and abs(np.linalg.norm(force) - self.p.gravity) <= self.p.gate:
            alpha = self.p.tau_s / (self.p.tau_s + dt)
            self.turn = Rotation.from_rotvec((1 - alpha) * smallest_turn(self.turn, force)) * self.turn
        if mag is not None and usable(mag):
            alpha = self.p.heading_tau_s / (self.p.heading_tau_s + self.age)
            self.turn = Rotation.from_rotvec((1 - alpha) * to_north(self.turn, mag) * UP) * self.turn
            self.age = 0.0
        return self.turn


@dataclass
class Mahony:
    """Explicit complementary filter."""

    turn: Rotation
    p: MahonyParameters = field(default_factory=MahonyParameters)
    bias: Array = field(default_factory=lambda: np.zeros(3))
    age: float = 0.0

    def step(self, dt: float, rate: Array, force: Array, mag: Array | None) -> Rotation:
        self.age += dt
        correction = np.zeros(3)
        if usable(force):
            correction += dt * np.cross(force / np.linalg.norm(force), self.turn.inv().apply(UP))
        if mag is not None and usable(mag):
            m = mag / np.linalg.norm(mag)
            h = self.turn.apply(m)
            b = np.array([0.0, np.hypot(h[0], h[1]), h[2]])
            correction += min(self.age, self.p.longest_field_s) * np.cross(m, self.turn.inv().apply(b))
            self.age = 0.0
        self.bias = self.bias - self.p.ki * correction
        self.turn = self.turn * Rotation.from_rotvec((rate - self.bias) * dt + self.p.kp * correction)
        return self.turn


class Kalman:
    """Equations 5.5 to 5.15 by filterpy, one filter an axis of the body."""

    def __init__(self, turn: Rotation, p: KalmanParameters | None = None) -> None:
        self.turn, self.p = turn, p or KalmanParameters()
        self.axes = [axis_filter(self.p) for _ in range(3)]

    def step(self, dt: float, rate: Array, force: Array, mag: Array | None) -> Rotation:
        for kf, w in zip(self.axes, rate, strict=True):
            kf.x[0] = 0.0  # the angle counts from the last correction
            predict(kf, self.p, dt, w)
        self.turn = self.turn * Rotation.from_rotvec([kf.x[0] for kf in self.axes])
        for kf in self.axes:
            kf.x[0] = 0.0
        up = self.turn.inv().apply(UP)
        innovations = []
        if usable(force):
            tilt = self.turn.inv().apply(smallest_turn(self.turn, force))
            innovations.append((tilt, self.p.angle_deviation**2 / np.maximum(1 - up**2, 1e-6)))
        if mag is not None and usable(mag):
            heading = to_north(self.turn, mag) * up
            innovations.append((heading, self.p.heading_deviation**2 / np.maximum(up**2, 1e-6)))
        total = np.zeros(3)
        for values, variances in innovations:
            for i, kf in enumerate(self.axes):
                kf.x[0] = 0.0
                kf.update(values[i], R=variances[i])
                total[i] += kf.x[0]
        self.turn = self.turn * Rotation.from_rotvec(total)
        return self.turn


def axis_filter(p: KalmanParameters) -> Any:
    kf = KalmanFilter(dim_x=2, dim_z=1, dim_u=1)
    kf.x = np.zeros(2)
    kf.P = np.diag([p.initial_angle_deviation**2, p.initial_bias_deviation**2])
    kf.H = np.array([[1.0, 0.0]])  # C, equation 5.13
    return kf


def predict(kf: Any, p: KalmanParameters, dt: float, rate: float) -> None:
    kf.predict(
        u=np.array([rate]),
        F=np.array([[1.0, -dt], [0.0, 1.0]]),  # A, equation 5.11
        B=np.array([[dt], [0.0]]),  # equation 5.12
        Q=np.diag([p.angle_density**2, p.bias_density**2]) * dt,  # equation 5.9
    )
