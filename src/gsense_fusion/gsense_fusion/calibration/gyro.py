"""Bias, G and k of the gyro with their errors by the identification's likelihood, and what they change elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from gsense_fusion.bags.run import Run
from gsense_fusion.compensation import CompensationFile, GCubed, GSensitivity, GSquared, Matrix, Term
from gsense_fusion.identification.analysis import Analysis, Settings
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import parts_of
from gsense_fusion.identification.engine import analyse
from gsense_fusion.identification.errors.folds import make_folds
from gsense_fusion.identification.errors.metrics import Held, band_rms, pose_floor, pose_rms
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.motion.earth import EARTH_RATE, Site
from gsense_fusion.identification.outcome.assembly import assemble
from gsense_fusion.identification.outcome.parameters import effect_parameters, significant
from gsense_fusion.identification.outcome.precision import current_variance, fitted_variance
from gsense_fusion.identification.types import GRAVITY, FloatArray, IdentificationError, Role
from gsense_fusion.report.outputs import compensation

from .permutation import permutation_p_value
from .variants import EFFECTS, SAME, VARIANTS

SIGNIFICANCE = 0.01
RATE_BAND_HZ = 5.0
EARTH_ON_DIAGONAL = EARTH_RATE / float(np.sqrt(3.0)) / GRAVITY
"""(rad/s)/(m/s^2): the earth's rate about the vertical at any latitude, where up is also the specific force."""


@dataclass(frozen=True)
class Estimate:
    """Values with their standard errors, of one shape."""

    value: FloatArray
    stderr: FloatArray


@dataclass(frozen=True)
class HeldOutError:
    """Root mean squares on data that was not fitted, rad/s."""

    pose: float | None
    """Of the means of still stretches; None for fewer than six."""
    rate: float
    """Of all samples below 5 Hz."""


@dataclass(frozen=True)
class GyroCalibration:
    """What was found."""

    sensor: str
    g_sensitivity: Estimate
    """(rad/s)/(m/s^2), rows gyro axes, columns accelerometer axes, shape (3, 3)."""
    bias: Estimate
    """rad/s, of the newest session that was fitted, shape (3,)."""
    k: Estimate
    """(rad/s)/(m/s^2), shape (): the best single number of equation 7.4."""
    significant: bool
    p_value: float
    """Of the likelihood test against no g-sensitivity, drift in the model."""
    permutation_p_value: float | None
    """Of exchanging the still poses' directions; None where there is motion."""
    held_out: Mapping[str, HeldOutError]
    """`before`, `after`, and each variant of the compensation."""
    pose_floor: float | None
    """What noise and drift alone would leave of the pose means, rad/s."""
    file: CompensationFile
    """What is written."""
    notes: tuple[str, ...]


def calibrate_gyro(
    runs: Sequence[tuple[Run, Role]], sensor: str, variant: str = "matrix", site: Site | None = None
) -> tuple[GyroCalibration, Analysis]:
    """Calibrate one sensor.

    Effects of the catalogue that the runs show (temperature, a bent rail, a late gyro) are fitted beside G, so that
    they do not bend it; those that the gyro can be corrected for are in the file too.

    Args:
        runs: still poses and sweeps with their roles.
        sensor: a sensor's name or a whole topic.
        variant: one of `VARIANTS`: the form of g-compensation in the file.
        site: where the recording was made; without it the earth's turn about the vertical passes for a diagonal of G
            (0.003 deg/s/g at 50 degrees), and the errors of still poses say so.

    Returns:
        The calibration, and the analysis that it rests on.

    Raises:
        IdentificationError: the runs cannot be used, or have no accelerometer.
    """
    a = analyse(runs, Settings(sensor, site=site), lambda _text, _part: None)
    if "g_sensitivity" not in a.likelihood.columns.start:
        raise IdentificationError(
            f"{a.clean[0].path}: no accelerometer beside the gyro: nothing to calibrate G against"
        )
    result = assemble(a, lambda _text, _part: None)
    full = a.claims.full
    likelihood, claimed, fits = _variants(a)
    p_permutation = permutation_p_value(likelihood, fits["none"], earth_known=site is not None)
    real = significant(a, "g_sensitivity") and (p_permutation is None or p_permutation < SIGNIFICANCE)
    chosen = variant if real else "none"
    held, floor = _judged(a, likelihood, fits)
    earth_unknown = site is None and not any(w.moving for r in a.campaign.fit for w in r.windows)
    turning = frozenset({"earth_vertical"} if earth_unknown else ())
    k_fit = _fit(likelihood, VARIANTS["k"] | claimed | turning, full)
    k = effect_parameters(likelihood, k_fit, EFFECTS[0])["k"]
    whole = chosen == "matrix"
    bias = session_bias(a.likelihood if whole else likelihood, full if whole else fits[chosen])
    calibration = GyroCalibration(
        sensor=sensor,
        g_sensitivity=_matrix_estimate(a, earth_unknown),
        bias=bias,
        k=Estimate(np.array(k.value), np.array(k.stderr)),
        significant=real,
        p_value=a.selection.p_value(full, "g_sensitivity"),
        permutation_p_value=p_permutation,
        held_out={**held, "after": held[chosen]},
        pose_floor=floor,
        file=_file(compensation(result), likelihood, k_fit if chosen == "k" else fits[chosen], chosen, bias),
        notes=result.notes + result.undecided,
    )
    return calibration, a


def _variants(a: Analysis) -> tuple[Likelihood, frozenset[str], dict[str, Fit]]:
    """The likelihood with every form of g-compensation, what was claimed beside G, and each form's fit beside it."""
    full = a.claims.full
    others = tuple(e for n in a.claims.names for e in parts_of(a.likelihood.effects, n, full.names))
    effects = EFFECTS + tuple(e for e in others if e.name != "g_sensitivity")
    likelihood = Likelihood(a.campaign, DriverSource(a.campaign), effects, a.noise)
    claimed = frozenset(e.name for e in others if "g_sensitivity" not in e.needs)
    fits = {name: _fit(likelihood, part | (claimed - _doubled(part)), full) for name, part in VARIANTS.items()}
    return likelihood, claimed, fits


def _judged(
    a: Analysis, likelihood: Likelihood, fits: Mapping[str, Fit]
) -> tuple[dict[str, HeldOutError], float | None]:
    """Held-out errors before and after each variant, and what noise and drift alone would leave of still poses."""
    full = a.claims.full
    ladder = {**fits, "before": _fit(likelihood, frozenset(), full)}
    folds = make_folds(a.campaign, a.likelihood.source, likelihood.effects, a.noise, ladder, lambda _text: None)
    held = {name: _held_out(folds, name) for name in ("before", *fits)}
    if held["before"].pose is None:
        return held, None
    return held, pose_floor(folds, a.noise, a.likelihood.drift_at_rest(full))


def _matrix_estimate(a: Analysis, earth_unknown: bool) -> Estimate:
    """G of the full model; the earth's turn, where nothing tells it apart, is in the errors of the diagonal."""
    added = fitted_variance(a) + current_variance(a)
    g = effect_parameters(a.likelihood, a.claims.full, a.selection.effects["g_sensitivity"], added)
    names = [f"g_{r}{c}" for r in "xyz" for c in "xyz"]
    value, stderr = (np.array(x).reshape(3, 3) for x in ([g[n].value for n in names], [g[n].stderr for n in names]))
    return Estimate(value, np.sqrt(stderr**2 + np.eye(3) * EARTH_ON_DIAGONAL**2) if earth_unknown else stderr)


def _doubled(part: frozenset[str]) -> frozenset[str]:
    """Effects of the catalogue that a variant has in a wider form."""
    return frozenset(SAME[name] for name in part if name in SAME)


def _fit(likelihood: Likelihood, names: frozenset[str], full: Fit) -> Fit:
    return likelihood.evaluate(names, full.templates)


def _held_out(folds: Sequence[Held], label: str) -> HeldOutError:
    return HeldOutError(pose_rms(folds, label), band_rms(folds, label, RATE_BAND_HZ))


def session_bias(likelihood: Likelihood, fit: Fit) -> Estimate:
    """Mean bias over the newest fitted session's stretches by generalised least squares, rad/s.

    Its error: white noise and earth rate through the weights of the estimate, drift through their difference from those
    of the mean, and the errors of the effects' parameters.
    """
    blocks = likelihood.blocks
    newest = int(np.argmax(np.unique(blocks.session)))
    X = likelihood.block_columns(fit.templates, fit.names)
    inside = blocks.session == np.unique(blocks.session)[newest]
    mean = np.where(inside, blocks.duration, 0.0) / blocks.duration[inside].sum()
    value, stderr = np.zeros(3), np.full(3, np.nan)
    for axis, slow in likelihood.slow.items():
        K = slow.covariance(fit.drift[axis])
        H = slow.sessions
        KiH = np.linalg.solve(K, H)
        inverse = np.linalg.inv(H.T @ KiH)
        weights = (inverse @ KiH.T)[newest]
        value[axis] = weights @ (blocks.rate[:, axis] - X[:, axis, :] @ fit.expected)
        carried, off = weights @ X[:, axis, :], weights - mean
        own = weights @ slow.white @ weights + off @ (K - slow.white) @ off
        stderr[axis] = np.sqrt(own + carried @ fit.covariance @ carried)
    return Estimate(value, stderr)


def _file(base: CompensationFile, likelihood: Likelihood, fit: Fit, variant: str, bias: Estimate) -> CompensationFile:
    """The file of the identification with the chosen form of g-compensation in the first place."""
    read = partial(_matrix, likelihood, fit)
    terms: list[Term] = []
    if variant == "k":
        terms.append(GSensitivity(k=float(fit.expected[likelihood.columns.start["cyclic_k"]])))
    elif variant != "none":
        # the matrix of the identification itself where it is the variant: one number, one place
        own = [t for t in base.terms if isinstance(t, GSensitivity)]
        terms.append(own[0] if variant == "matrix" and own else GSensitivity(matrix=read("g_sensitivity")))
    if variant in ("matrix_squares", "polynomial"):
        terms.append(GSquared(matrix=read("squares")))
    if variant == "polynomial":
        terms.append(GCubed(matrix=read("cubes")))
    doubled = _doubled(VARIANTS[variant]) | {"g_sensitivity"}
    rest = tuple(t for t in base.terms if t.effect not in doubled)
    x, y, z = (float(v) for v in bias.value)
    return CompensationFile(
        sensor=base.sensor,
        unit_id=base.unit_id,
        bias=(x, y, z),
        terms=(*terms, *rest),
        gyro_delay_s=base.gyro_delay_s,
        reference=base.reference,
    )


def _matrix(likelihood: Likelihood, fit: Fit, name: str) -> Matrix:
    first = likelihood.columns.start[name]
    rows = [tuple(float(v) for v in row) for row in fit.expected[first : first + 9].reshape(3, 3)]
    return (rows[0], rows[1], rows[2])  # type: ignore[return-value]
