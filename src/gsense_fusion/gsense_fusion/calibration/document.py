"""calibration.json (schema gsense-calibration/1) and what the command says in words."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from .accelerometer import AccelerometerCalibration
from .ellipsoid import EllipsoidFit
from .gyro import Estimate, GyroCalibration
from .magnetometer import MagnetometerCalibration
from .turns import ScaleCalibration
from .variants import VARIANTS

SCHEMA = "gsense-calibration/1"
_G = "(rad/s)/(m/s^2)"


@dataclass(frozen=True)
class Calibration:
    """Everything that one calibration found; words where something could not be found."""

    gyro: GyroCalibration
    accelerometer: AccelerometerCalibration | str
    magnetometer: MagnetometerCalibration | str | None
    """None: there is none."""
    scale: ScaleCalibration | str
    """With the gyro's g-sensitivity taken out."""
    scale_without_g: ScaleCalibration | str


def calibration_json(c: Calibration) -> str:
    """The document."""
    gyro = c.gyro
    before, after = gyro.held_out["before"], gyro.held_out["after"]
    pose = None
    if before.pose is not None and after.pose is not None:
        pose = {"before": before.pose, "after": after.pose, "noise_floor": gyro.pose_floor, "unit": "rad/s"}
    document = {
        "schema": SCHEMA,
        "sensor": gyro.sensor,
        "unit_id": gyro.file.unit_id,
        "significant": gyro.significant,
        "p_value": gyro.p_value,
        "permutation_p_value": gyro.permutation_p_value,
        "g_sensitivity": _estimate(gyro.g_sensitivity, _G),
        "bias": _estimate(gyro.bias, "rad/s"),
        "k": _estimate(gyro.k, _G),
        "pose_rms": pose,
        "rate_rms": {"before": before.rate, "after": after.rate, "unit": "rad/s"},
        "variants": {n: {"pose_rms": gyro.held_out[n].pose, "rate_rms": gyro.held_out[n].rate} for n in VARIANTS},
        "scale_misalignment": _scale(c),
        "accelerometer": _accelerometer(c.accelerometer),
        "magnetometer": _magnetometer(c.magnetometer),
        "notes": list(gyro.notes),
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def _estimate(estimate: Estimate, unit: str) -> dict[str, Any]:
    return {"value": _numbers(estimate.value), "stderr": _numbers(estimate.stderr), "unit": unit}


def _numbers(values: Any) -> Any:
    """Plain numbers; null where there is none (an axis that the gyro does not have)."""
    if np.ndim(values):
        return [_numbers(v) for v in values]
    return float(values) if np.isfinite(values) else None


def _triad(fit: EllipsoidFit, unit: str) -> dict[str, Any]:
    return {
        "bias": {"value": _numbers(fit.offset), "stderr": _numbers(fit.offset_stderr), "unit": unit},
        "matrix": {"value": _numbers(fit.shape), "stderr": _numbers(fit.shape_stderr), "unit": "1"},
        "residual_rms": fit.residual_rms,
    }


def _accelerometer(found: AccelerometerCalibration | str) -> dict[str, Any]:
    if isinstance(found, str):
        return {"calibrated": False, "reason": found}
    return {"calibrated": True, **_triad(found.fit, "m/s^2"), "poses": found.poses}


def _magnetometer(found: MagnetometerCalibration | str | None) -> dict[str, Any] | None:
    if found is None:
        return None
    if isinstance(found, str):
        return {"calibrated": False, "reason": found}
    fit = found.fit
    return {
        "calibrated": True,
        "hard_iron": {"value": _numbers(fit.offset), "stderr": _numbers(fit.offset_stderr), "unit": "T"},
        "soft_iron": {"value": _numbers(fit.shape), "stderr": _numbers(fit.shape_stderr), "unit": "1"},
        "residual_rms": fit.residual_rms,
        "field": found.field,
        "directions": found.directions,
        "spread_before": found.spread_before,
        "spread_after": found.spread_after,
    }


def _scale(c: Calibration) -> dict[str, Any]:
    found, plain = c.scale, c.scale_without_g
    if isinstance(found, str):
        return {"calibrated": False, "reason": found}
    rms = {"none": found.rms_before if isinstance(plain, str) else plain.rms_before, "matrix": found.rms_before}
    rms |= {} if isinstance(plain, str) else {"scale": plain.rms_after}
    return {
        "calibrated": True,
        "significant": found.significant,
        "value": _numbers(found.matrix),
        "stderr": _numbers(found.stderr),
        "unit": "1",
        "turns": found.turns,
        "p_value": found.p_value,
        "turn_rms": {**rms, "groves": found.rms_after, "unit": "rad"},
    }


def words(c: Calibration) -> list[str]:
    """What was found, a line each."""
    gyro = c.gyro
    g, stderr = (np.degrees(x) * 9.80665 for x in (gyro.g_sensitivity.value, gyro.g_sensitivity.stderr))
    strongest = np.unravel_index(np.argmax(np.abs(g)), g.shape)
    if gyro.significant:
        size = f"up to {abs(g[strongest]):.3f} +- {stderr[strongest]:.3f} deg/s/g (p = {gyro.p_value:.2g})"
        lines = [f"{gyro.sensor}: g-sensitivity {size}"]
    else:
        limit = np.max(np.abs(g) + 1.96 * stderr)
        size = f"(p = {gyro.p_value:.2g}; with 95 % under {limit:.3f} deg/s/g)"
        lines = [f"{gyro.sensor}: g-sensitivity not significant {size}: nothing is compensated"]
    k, k_stderr = (float(np.degrees(x)) * 9.80665 for x in (gyro.k.value, gyro.k.stderr))
    lines.append(f"k of equation 7.4: {k:.4f} +- {k_stderr:.4f} deg/s/g")
    before, after = gyro.held_out["before"], gyro.held_out["after"]
    if before.pose is not None and after.pose is not None:
        text = f"{np.degrees(before.pose):.4f} -> {np.degrees(after.pose):.4f} deg/s"
        lines.append(f"pose means not fitted: {text}" + _floor(gyro))
    lines.append(f"rate below 5 Hz not fitted: {np.degrees(before.rate):.4f} -> {np.degrees(after.rate):.4f} deg/s")
    lines.append(_accelerometer_words(c.accelerometer))
    lines.append(_scale_words(c.scale, c.scale_without_g))
    if c.magnetometer is not None:
        lines.append(_magnetometer_words(c.magnetometer))
    return lines


def _floor(gyro: GyroCalibration) -> str:
    return "" if gyro.pose_floor is None else f" (noise and drift alone: {np.degrees(gyro.pose_floor):.4f})"


def _accelerometer_words(found: AccelerometerCalibration | str) -> str:
    if isinstance(found, str):
        return f"accelerometer not calibrated: {found}"
    scale = float(np.abs(np.diag(found.fit.shape) - 1).max())
    return (
        f"accelerometer from {found.poses} poses: scale off by up to {100 * scale:.2f} %, bias up to "
        f"{np.abs(found.fit.offset).max():.3f} m/s^2, left {found.fit.residual_rms:.4f} m/s^2"
    )


def _scale_words(found: ScaleCalibration | str, plain: ScaleCalibration | str) -> str:
    if isinstance(found, str):
        return f"gyro scale not calibrated: {found}"
    none, scale = (f"{np.degrees(x):.2f}" for x in _turn_errors(found, plain))
    g, both = (f"{np.degrees(x):.2f}" for x in (found.rms_before, found.rms_after))
    return (
        f"gyro scale and misalignment from {found.turns} turns, up to {100 * np.abs(found.matrix).max():.2f} %; "
        f"gravity after a turn not fitted is off by {none} deg, with G {g}, with scale {scale}, with both {both}"
    )


def _turn_errors(found: ScaleCalibration, plain: ScaleCalibration | str) -> tuple[float, float]:
    """Without anything, and with scale alone."""
    return (found.rms_before, found.rms_after) if isinstance(plain, str) else (plain.rms_before, plain.rms_after)


def _magnetometer_words(found: MagnetometerCalibration | str) -> str:
    if isinstance(found, str):
        return f"magnetometer not calibrated: {found}"
    return (
        f"magnetometer from {found.directions} directions: hard iron {1e6 * np.linalg.norm(found.fit.offset):.2f} uT, "
        f"spread of the strength {100 * found.spread_before:.2f} -> {100 * found.spread_after:.2f} %"
    )
