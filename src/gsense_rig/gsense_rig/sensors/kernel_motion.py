"""The kernel's mechanics: how the carriage truly moves, turns and leans, and what the board on it feels."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from gsense_rig.sensors.constants import STEP
from gsense_rig.sensors.layout import Array, Settings, State

# Only compiled code calls the inner functions: without wrappers for Python they compile in a fraction of the time.
inner = njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
RATE, FORCE, FIELD, TILT = 0, 1, 2, 3
STILL = 0.002
"""m/s: half width of the change of direction at a reversal."""


@inner
def _rotation_transposed(phi: Array, C: Array) -> None:
    """Rodrigues: C = exp([phi]x)^T, the carriage's axes from the rail's."""
    angle = math.sqrt(phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2)
    s = 1.0 if angle < 1e-9 else math.sin(angle) / angle
    c = 0.5 if angle < 1e-9 else (1.0 - math.cos(angle)) / angle**2
    for i in range(3):
        for j in range(3):
            C[i, j] = c * phi[i] * phi[j]
        C[i, i] += math.cos(angle)
    C[0, 1] += s * phi[2]
    C[1, 0] -= s * phi[2]
    C[1, 2] += s * phi[0]
    C[2, 1] -= s * phi[0]
    C[2, 0] += s * phi[1]
    C[0, 2] -= s * phi[1]


@inner
def _lean(s: float, cfg: Settings, state: State) -> float:
    """Stop operator: the carriage leans over with the first of its way after a reversal, and stays there."""
    moved = s - state.previous[4] if state.steps[0] > 0 else 0.0
    state.previous[4] = s
    state.play[0] = min(1.0, max(-1.0, state.play[0] + moved / cfg.play))
    return state.play[0]


@inner
def true_motion(sample: Array, cfg: Settings, state: State, B: Array) -> None:
    """True rate, specific force and field on the board; B becomes board-from-rail."""
    s, v, a = sample[1], sample[2], sample[3]
    jerk = (a - state.previous[3]) / STEP if state.steps[0] > 0 else 0.0
    state.previous[3] = a
    before = state.play[0]
    lean = _lean(s, cfg, state)
    leaning = (lean - before) / STEP
    tooth = math.sin(cfg.tooth[0] * s + cfg.tooth[1]) * abs(math.tanh(v / STILL))  # at rest nothing turns
    truth = state.truth
    spin = np.empty(3)
    for i in range(3):
        t = cfg.tilt[i]
        truth[TILT, i] = t[0] * s + t[1] * v + t[2] * a + t[3] * lean
        spin[i] = t[0] * v + t[1] * a + t[2] * jerk + t[3] * leaning + t[4] * tooth
    C = np.empty((3, 3))
    _rotation_transposed(truth[TILT], C)
    # A carriage that follows a bow is also accelerated towards its centre: v^2 d(tangent)/ds.
    push = (a, v * v * cfg.tilt[2, 0], -v * v * cfg.tilt[1, 0])
    for i in range(3):
        for j in range(3):
            B[i, j] = 0.0
            for m in range(3):
                B[i, j] += cfg.board[i, m] * C[m, j]
    for i in range(3):
        truth[RATE, i] = truth[FORCE, i] = truth[FIELD, i] = 0.0
        for j in range(3):
            truth[RATE, i] += cfg.board[i, j] * spin[j] + B[i, j] * cfg.earth[j]
            truth[FORCE, i] += cfg.board[i, j] * push[j] + B[i, j] * cfg.gravity[j]
            truth[FIELD, i] += B[i, j] * (cfg.field[j] + cfg.field_terms[j, 0] * s + cfg.field_terms[j, 1] * sample[4])
