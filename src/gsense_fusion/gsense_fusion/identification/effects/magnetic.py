"""What bends the magnetometer's field in motion: steel along the rail, the motor's current."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.kept import once_for
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.recording.magnetometer import HIGHEST_ORDER, LAGS_S, PROXIES, FieldFit, Magnetometer
from gsense_fusion.identification.types import AXES, FloatArray, Owner, Parameter

SURE = 40.0
"""Least gain in twice the log-likelihood: orders and lags are sought, and a lab's field has other causes to change."""
RIVAL = 10.0
LOCKED_ALPHA = 1e-6
LOCKED_ALPHA_CLAIMED = 1e-2
"""Where something is claimed anyway, the question is only whether it is the right thing."""
LOCKED_PART = 0.8
"""Of the energy at the drive's orders, that a claim has to remove."""
BINS = 25
MICRO = 1e6
POSITION, MOTOR = "mag_position", "mag_motor"
PROXY_UNITS = ("T/(m/s^2)", "T", "T/(m/s)")
ADVICE = {
    POSITION: "steel or magnets beside the rail: remove them, or leave the magnetometer out of the heading there "
    "(use_mag: false)",
    MOTOR: "the motor's current: twist its leads, lead them away from the board, or leave the magnetometer out of the "
    "heading while it runs (use_mag: false)",
}


class MagPosition(RecordedEffect):
    """p(s): steel along the rail."""

    name = POSITION
    owner = Owner.RIG
    equation = "B = B0 + p(s)"
    source = "steel of rail and frame magnetised by the earth's field"

    def look(self, recording: Recording) -> Seen:
        """Field over position."""
        return _only(_both(recording), self.name)


class MagMotor(RecordedEffect):
    """M i: leads and stray field of the motor."""

    name = MOTOR
    owner = Owner.CHAIN
    equation = "B = B0 + M i"
    source = "field of the motor's leads and magnets, in proportion to its current"

    def look(self, recording: Recording) -> Seen:
        """Field over current, or over what stands for it."""
        return _only(_both(recording), self.name)


def _only(seen: Seen, name: str) -> Seen:
    """One of the two; what has no name, and what could not be decided, is told once by whoever comes first."""
    return Seen({n: r for n, r in seen.readings.items() if n == name}, seen.unnamed, seen.notes, seen.undecided)


@once_for
def _both(recording: Recording) -> Seen:
    """Position and motor are chosen together: at one speed they look alike."""
    if all(r.magnetic is None for r in recording.clean):
        return Seen()
    magnetometer = Magnetometer.of(recording.campaign)
    if magnetometer is None:
        reason = f"{POSITION} and {MOTOR} could not be decided: too few messages of the magnetometer in motion"
        return Seen(undecided=(reason,))
    known = recording.names & {POSITION, MOTOR}
    sets = [frozenset[str](), *(frozenset({n}) for n in sorted(known)), *([known] if len(known) == 2 else [])]
    fits = {s: magnetometer.best(POSITION in s, MOTOR in s) for s in sets}
    chosen = max(sets, key=lambda s: fits[s].score)
    claimed = frozenset(n for n in chosen if _claimed(magnetometer, fits, chosen, n))
    if claimed not in fits:
        claimed = frozenset()
    best, none = fits[claimed], fits[frozenset()]
    left, degrees = magnetometer.locked(best)
    before, _ = magnetometer.locked(none)
    alpha = LOCKED_ALPHA_CLAIMED if claimed else LOCKED_ALPHA
    p_left = float(chi2.sf(left, max(degrees, 1)))
    if p_left < alpha and left - degrees > (1.0 - LOCKED_PART) * max(before - degrees, 0.0):
        return Seen(unnamed=(_unexplained(p_left, claimed),))
    readings = {n: _reading(magnetometer, fits, claimed, n) for n in (POSITION, MOTOR) if n in claimed}
    return Seen(readings)


def _claimed(m: Magnetometer, fits: dict[frozenset[str], FieldFit], chosen: frozenset[str], name: str) -> bool:
    """Whether an effect of the best set gains enough and holds on runs left out."""
    without = fits[chosen - {name}]
    return 2 * (fits[chosen].loglik - without.loglik) > SURE and m.holds(fits[chosen], without)


def _unexplained(p: float, tried: frozenset[str]) -> Reading:
    text = "the magnetometer's field follows the carriage, and neither position nor motor explains it"
    if tried:
        text += f" (partly like {', '.join(sorted(tried))})"
    return Reading({}, (), p, text, "")


def _reading(m: Magnetometer, fits: dict[frozenset[str], FieldFit], claimed: frozenset[str], name: str) -> Reading:
    best = fits[claimed]
    without = fits[claimed - {name}]
    other = MOTOR if name == POSITION else POSITION
    swapped = fits.get((claimed - {name}) | {other})
    rivals = swapped is not None and other not in claimed and 2 * (best.loglik - swapped.loglik) < RIVAL
    ratio = 2 * (best.loglik - without.loglik)
    parameters = _parameters(m, best, name)
    axes = tuple(x for x in AXES if any(n.endswith(f"_{x}") and p.significant for n, p in parameters.items()))
    heading = parameters.get("heading")
    turn = "" if heading is None else f", which turns the heading by {np.degrees(heading.value):.2g} deg"
    what = "with the carriage's position" if name == POSITION else "with the motor's current"
    return Reading(
        parameters,
        axes,
        float(chi2.sf(ratio, 3 * max(1, len(m.index(best.model)) - len(m.index(without.model))))),
        f"the magnetometer's field changes {what}{turn}",
        ADVICE[name],
        (other,) if rivals else (),
        "motor_beside_board" if rivals else None,
        _curve(m, best, name),
    )


def _columns(fit: FieldFit, name: str) -> FloatArray:
    """Coefficients of one effect, the other's zero, shape (p, 3)."""
    own = np.arange(len(fit.beta)) < HIGHEST_ORDER
    return np.where((own if name == POSITION else ~own)[:, None], fit.beta, 0.0)


def _to_sensor(m: Magnetometer) -> FloatArray:
    """Rotation from the axes of the fit to the sensor's in the first run's mounting."""
    mounting = m.runs[0].data.mounting
    rotation = None if mounting is None else mounting.sensor_from_rail
    return np.asarray(np.eye(3)) if rotation is None else rotation


def _parameters(m: Magnetometer, fit: FieldFit, name: str) -> dict[str, Parameter]:
    turn, lag = _to_sensor(m), fit.model.lag
    stacked = np.concatenate([m.columns(r, lag) for r in m.runs])
    beta = _columns(fit, name)
    out: dict[str, Parameter] = {}
    if name == POSITION:
        ends = _largest_change(stacked, beta)
        out |= _vector("d", ends @ beta @ turn.T, ends, fit, "T")
    else:
        units = ("T/A" if m.motor_unit == "A" else "T/N",) if m.motor_unit is not None else PROXY_UNITS
        names = ("m",) if m.motor_unit is not None else tuple(p[0] for p in PROXIES)
        for k, (letter, unit) in enumerate(zip(names, units, strict=True)):
            pick = np.zeros(len(beta))
            pick[HIGHEST_ORDER + k] = 1.0
            out |= _vector(letter, pick @ beta @ turn.T, pick, fit, unit)
    heading = _heading(m, fit, stacked, beta)
    if heading is not None:
        out["heading"] = heading
    out["lag_s"] = Parameter(LAGS_S[lag], m.lag_error(fit), "s")
    return out


def _vector(letter: str, value: FloatArray, pick: FloatArray, fit: FieldFit, unit: str) -> dict[str, Parameter]:
    error = float(np.sqrt(max(float(pick @ fit.covariance @ pick), 0.0)))
    return {f"{letter}_{x}": Parameter(float(value[i]), error, unit) for i, x in enumerate(AXES)}


def _largest_change(stacked: FloatArray, beta: FloatArray) -> FloatArray:
    """Difference of the columns between the two places whose fields differ most along their main direction."""
    field = stacked @ beta
    main = np.linalg.svd(field - field.mean(axis=0), full_matrices=False)[2][0]
    along = field @ main
    first, last = sorted((int(np.argmin(along)), int(np.argmax(along))), key=lambda i: stacked[i, 0])
    return np.asarray(stacked[last] - stacked[first])


def _heading(m: Magnetometer, fit: FieldFit, stacked: FloatArray, beta: FloatArray) -> Parameter | None:
    """Range of the heading over the motion, rad, from the measured field (hard iron in it); None without gravity."""
    if any(r.data.mounting is None or r.data.mounting.sensor_from_rail is None for r in m.runs):
        return None
    mean = np.mean([r.field.mean(axis=0) for r in m.runs], axis=0)
    level = float(np.hypot(mean[0], mean[1]))
    if level <= 0:
        return None
    bent = mean[None] + stacked @ beta
    angle = np.arctan2(bent[:, 0] * mean[1] - bent[:, 1] * mean[0], bent[:, 0] * mean[0] + bent[:, 1] * mean[1])
    low, high = stacked[int(np.argmin(angle))], stacked[int(np.argmax(angle))]
    error = float(np.sqrt(max(float((high - low) @ fit.covariance @ (high - low)), 0.0)))
    return Parameter(float(np.ptp(angle)), error / level, "rad")


def _curve(m: Magnetometer, fit: FieldFit, name: str) -> Curve:
    """Means of the field without the other effect over position or current, and the fitted curve, microtesla."""
    own, lag, turn = _columns(fit, name), fit.model.lag, _to_sensor(m)
    driver = [_abscissa(m, m.columns(r, lag), own, name) for r in m.runs]
    fitted = [(m.columns(r, lag) @ own) @ turn.T for r in m.runs]
    measured = [m.residual(r, fit) @ turn.T + f for r, f in zip(m.runs, fitted, strict=True)]
    x, measured_means, fitted_means = _binned(driver, measured, fitted)
    unit = {"A": "motor current, A", "N": "motor force, N", None: "what stands for the motor's current"}[m.motor_unit]
    return Curve(
        x=x,
        measured=measured_means * MICRO,
        fitted=fitted_means * MICRO,
        series=AXES,
        x_label="position, m" if name == POSITION else unit,
        y_label="field beside its mean, \N{MICRO SIGN}T",
        how_to_read="Dots are means of the magnetometer in the sensor's axes; the curve is what the finding says.",
    )


def _abscissa(m: Magnetometer, columns: FloatArray, own: FloatArray, name: str) -> FloatArray:
    if name == POSITION:
        return np.asarray(columns[:, 0] * m.reach)
    if m.motor_unit is not None:
        return np.asarray(columns[:, HIGHEST_ORDER])
    main = np.linalg.svd(own[HIGHEST_ORDER:], full_matrices=False)[0][:, 0]
    return np.asarray(columns[:, HIGHEST_ORDER:] @ main)


def _binned(
    driver: Sequence[FloatArray], measured: Sequence[FloatArray], fitted: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    x, y, f = (np.concatenate(list(part)) for part in (driver, measured, fitted))
    edges = np.linspace(float(x.min()), float(x.max()), BINS + 1)
    cell = np.clip(np.digitize(x, edges) - 1, 0, BINS - 1)
    full = [k for k in range(BINS) if (cell == k).any()]
    means = [np.array([part[cell == k].mean(axis=0) for k in full]) for part in (x[:, None], y, f)]
    return means[0][:, 0], means[1], means[2]
