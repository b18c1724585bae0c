"""How much of a disturbance this noise lets one see: whitened energy, without what the declared model imitates."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .disturbances import UNIT_SIZE
from .markov import whiten
from .parameters import Disturbance, SessionParameters
from .session import RunTruth, Session, simulate

Array = NDArray[np.float64]
AVERAGED_TO_HZ = 50.0


def whitened_energy(session: Session, reference: Session) -> float:
    """lambda: squared norm, over the noise's covariance, of what the disturbances add to the fit runs.

    A bias and G f (with the force of each session itself: a delay shifts it) are projected out of the difference. The
    covariance is exact for white noise and Markov processes; energy above 25 Hz (averages over 20 ms) and what the
    accelerometer could add are not counted.

    Args:
        session: With the disturbances.
        reference: The same seed without them.

    """
    noise = session.parameters.noise
    pairs = [
        (a, b) for a, b, (_, role) in zip(session.truth, reference.truth, session.runs, strict=True) if role == "fit"
    ]
    time = np.concatenate([_average(a.time[:, None], a)[:, 0] for a, _ in pairs])
    added = np.concatenate([_average(a.signal - b.signal, a) for a, b in pairs])
    # the accelerometer's clock is the reference: G f is imitated in the undelayed force
    force = np.concatenate([_average(b.force, a) for a, b in pairs])
    span_s = 1.0 / AVERAGED_TO_HZ
    total = 0.0
    for axis in range(3):
        columns = np.column_stack([added[:, axis], np.ones(len(time)), force - force.mean(axis=0)])
        white = whiten(time, noise.markov_tau_s, noise.markov_sigma, noise.white**2 / (2 * span_s), columns)
        y, X = white[:, 0], white[:, 1:]
        beta, *_ = np.linalg.lstsq(X, y, rcond=1e-10)
        total += float(np.sum((y - X @ beta) ** 2))
    return total


def _average(series: Array, run: RunTruth) -> Array:
    rate = 1.0 / float(np.median(np.diff(run.time)))
    width = max(1, round(rate / AVERAGED_TO_HZ))
    n = len(series) // width * width
    return np.asarray(series[:n].reshape(-1, width, series.shape[1]).mean(axis=1))


def scaled(parameters: SessionParameters, kind: str, energy: float) -> tuple[Disturbance, float]:
    """A disturbance of (nearly) the wanted whitened energy in this session, and the energy that it has.

    Noise that grows with speed has no signal to whiten: its size is set so that its density at 0.5 m/s is
    (energy / 4000)^(1/4) of the gyro's white noise, and its energy is nominal.
    """
    if kind == "speed_noise":
        return Disturbance(kind, 2.0 * parameters.noise.white * (energy / 4000) ** 0.25), energy
    reference = _without_disturbances(replace(parameters, disturbances=()))
    size, reached = UNIT_SIZE[kind], 0.0
    for _ in range(2 if kind == "rail_curvature" else 1):  # the others are linear in their size
        session = simulate(replace(parameters, disturbances=(Disturbance(kind, size),)))
        reached = whitened_energy(session, reference)
        size *= float(np.sqrt(energy / reached))
    return Disturbance(kind, size), energy


_without_disturbances = lru_cache(maxsize=1)(simulate)
"""Both of a pair are scaled against the same session."""
