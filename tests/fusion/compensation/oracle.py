"""The compensation written out plainly, term by term, with numpy and scipy: slow and clear, an own way."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import expm

from gsense_fusion.compensation import CompensationFile

STALE_S, WINDOW_NS = 0.5, 60_000_000


class Oracle:
    """What `Compensator` must do."""

    def __init__(self, file: CompensationFile) -> None:
        self.file = file
        self.past: list[tuple[int, np.ndarray]] = []
        self.stamp: int | None = None
        self.reading = self.volts = self.velocity = None
        self.memory: dict[int, Any] = {}

    def update(self, stamp: int, rate: np.ndarray, force: np.ndarray) -> np.ndarray:
        dt = 0.0 if self.stamp is None else (stamp - self.stamp) * 1e-9
        self.stamp = stamp
        if dt > STALE_S:
            self.past = []
        known = bool(np.isfinite(force).all())
        if known:
            self.past = [*self.past[-400:], (stamp, force.copy())]
        wanted = stamp - max(0, round(self.file.gyro_delay_s * 1e9))
        f = self._force(wanted) if known else np.full(3, np.nan)
        out = rate.copy()
        for i, term in enumerate(self.file.terms):
            out = self._term(i, term, out, f, wanted, dt)
        self.reading = None
        return out

    def _force(self, wanted: int) -> np.ndarray:
        t = np.array([p[0] - wanted for p in self.past], dtype=float)
        f = np.array([p[1] for p in self.past])
        return np.array([np.interp(0.0, t, f[:, i]) for i in range(3)])

    def _slope(self, wanted: int, lag: float) -> np.ndarray | None:
        window = [p for p in self.past if wanted - WINDOW_NS < p[0] <= wanted]
        if len(window) < 4:
            return None
        t = np.array([(p[0] - wanted) * 1e-9 for p in window])
        parabola = np.polyfit(t, np.array([p[1] for p in window]), 2)
        return parabola[1] - 2 * parabola[0] * lag

    def _term(self, i: int, term: Any, rate: np.ndarray, f: np.ndarray, wanted: int, dt: float) -> np.ndarray:  # noqa: C901, PLR0911
        name = term.effect
        if name == "scale_misalignment":
            return np.linalg.solve(np.eye(3) + np.array(term.matrix), rate)
        if name == "temperature_bias":
            warm = self._warm(i, term.lag_s, dt)
            return rate if warm is None else rate - np.array(term.c) * (warm - term.reference)
        if name == "supply_voltage":
            return rate if self.volts is None else rate - np.array(term.c) * (self.volts - term.reference)
        if name == "speed_pickup":
            return rate if self.velocity is None else rate - np.array(term.c) * self.velocity
        if name == "friction_pickup":
            if self.velocity is None:
                return rate
            current = np.sign(self.velocity) + term.inertia * self._acceleration(i, dt)
            return rate - np.array(term.c) * current
        if not np.isfinite(f).all():
            return rate
        if name == "g_sensitivity":
            return rate - np.array(term.full_matrix) @ f
        if name == "g_resonance":
            swing, turn = self._swing(i, term, np.array(term.direction) @ f, dt)
            return rate - np.array(term.c) * swing - np.array(term.rate or (0.0, 0.0, 0.0)) * turn
        if name == "jerk_coupling":
            slope = self._slope(wanted, term.lag_s)
            if slope is None:
                return rate
            return rate - (
                np.array(term.matrix) @ slope
                if term.c is None
                else np.array(term.c) * (np.array(term.direction) @ slope)
            )
        power = {"g_squared": 2, "g_cubed": 3}[name]
        if term.c is None:
            return rate - np.array(term.matrix) @ f**power
        along = np.array(term.direction) @ f
        higher = np.zeros(3) if term.higher is None else np.array(term.higher)
        return rate - np.array(term.c) * along**power - higher * along ** (power + 2)

    def _swing(self, i: int, term: Any, u: float, dt: float) -> np.ndarray:
        """The exact solution for a ramp of input, by the exponential of the system with the ramp as states."""
        if i not in self.memory or dt > STALE_S:
            self.memory[i] = (np.array([u, 0.0]), u)
            return self.memory[i][0]
        state, before = self.memory[i]
        if dt > 0:
            w = 2 * np.pi * term.f0
            system = np.zeros((4, 4))
            system[0, 1] = system[2, 3] = 1.0
            system[1] = [-w * w, -2 * term.damping * w, w * w, 0.0]
            state = (expm(system * dt) @ np.array([*state, before, (u - before) / dt]))[:2]
        self.memory[i] = (state, u)
        return state

    def _acceleration(self, i: int, dt: float) -> float:
        """Morrison's fading-memory filter of degree 2 in scaled derivatives."""
        if i not in self.memory or dt > STALE_S:
            self.memory[i] = np.array([self.velocity, 0.0, 0.0])
            return 0.0
        if dt > 0:
            t, scale = np.exp(-dt / 0.012), np.array([1.0, dt, dt**2 / 2])
            z = np.array([[1, 1, 1], [0, 1, 2], [0, 0, 1]]) @ (self.memory[i] * scale)
            gains = np.array([1 - t**3, 1.5 * (1 - t) ** 2 * (1 + t), 0.5 * (1 - t) ** 3])
            self.memory[i] = (z + gains * (self.velocity - z[0])) / scale
        return float(self.memory[i][1])

    def _warm(self, i: int, lag: float, dt: float) -> float | None:
        """A Kalman filter in matrices; the element behind the lag is a third state."""
        if i not in self.memory:
            if self.reading is None:
                return None
            r, s = 0.1**2, 0.05**2
            P = np.array([[r, 0, r], [0, s, -lag * s], [r, -lag * s, r + lag**2 * s]])
            self.memory[i] = (np.array([self.reading, 0.0, self.reading]), P)
            return self.reading
        x, P = self.memory[i]
        e = np.exp(-dt / lag) if lag > 0 else 0.0
        F = np.array([[1, dt, 0], [0, 1, 0], [1 - e, dt - lag * (1 - e), e]])
        q = 3e-3**2
        Q = q * np.array([[dt**3 / 3, dt**2 / 2, 0], [dt**2 / 2, dt, 0], [0, 0, 0]])
        if lag == 0:
            S = np.array([[1, 0, 0], [0, 1, 0], [1, 0, 0]])
            Q = S @ Q @ S.T
        x, P = F @ x, F @ P @ F.T + Q
        if self.reading is not None:
            H = np.array([[1.0, 0.0, 0.0]])
            K = P @ H.T / (P[0, 0] + 0.1**2)
            x = x + K[:, 0] * (self.reading - x[0])
            P = (np.eye(3) - K @ H) @ P
        self.memory[i] = (x, P)
        return float(x[2])
