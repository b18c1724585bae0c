"""What close_loop finds goes into the live fusion node, and the same bag's topics before and after show the gain.

An effect of the sensor and one of the chain (timing) come off the gyro; one of the rig is a true rotation: the gyro
stays, and the reference is what it corrects.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from tests.fusion.test_next_plan import SWEEP, UNIT

from gsense_fusion.bags import load_run
from gsense_fusion.bags.imu_message import parse_imu
from gsense_fusion.campaigns import campaign_bags
from gsense_fusion.close_loop import main as close_loop
from gsense_fusion.compensation import load_compensation
from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.types import Role
from gsense_fusion.watch.reference import true_rate
from gsense_fusion.watch.window import Samples, steady_part
from gsense_rig.simulate import main as simulate

from .player import played

pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

pytestmark = [pytest.mark.graph, pytest.mark.slow, pytest.mark.usefixtures("domain"), pytest.mark.timeout(900)]

Array = NDArray[np.float64]
DEG = np.degrees(1.0)
HELD_OUT = 7.0
RUNS = [run | {"angular_frequency": HELD_OUT} if run.get("role") == "held_out" else run for run in SWEEP]


@dataclass(frozen=True)
class Closed:
    """One closed loop: the report, the live node's rates in the steady motion of a run that was not fitted."""

    report: dict[str, Any]
    folder: Path
    time: Array
    """s, shape (n,)."""
    plain: Array
    """Angular rate without compensation, rad/s, shape (n, 3)."""
    compensated: Array
    reference: Array
    """Rate of the true rotation that compensation.yaml knows, rad/s, shape (n, 3)."""


def closed(folder: Path, effect: str) -> Closed:
    """Simulate a session with an effect, close the loop, play its held-out run into a fusion node."""
    plan = folder / "sweep.yaml"
    plan.write_text(yaml.safe_dump({"runs": RUNS}), encoding="utf-8")
    assert simulate([str(plan), "--out", str(folder / "bags"), "--effect", effect, "--seed", "3", *UNIT]) == 0
    bags = campaign_bags(folder / "bags")
    fit, held = ([str(b) for b, r in bags if r is role] for role in (Role.FIT, Role.HELD_OUT))
    assert close_loop(["--fit", *fit, "--held-out", *held, "--out", str(folder)]) == 0
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    file = folder / "compensation.yaml"
    count, heard = played(Path(held[0]), file, ("madgwick",), ("madgwick", "madgwick_gcomp"))
    before, after = ([parse_imu(m) for m in heard[name]] for name in ("madgwick", "madgwick_gcomp"))
    assert [m.stamp_ns for m in before] == [m.stamp_ns for m in after]
    assert len(before) == count
    run = load_run(held[0], "mpu6050")
    assert run.pose is not None
    start = before[0].stamp_ns
    time = np.array([(m.stamp_ns - start) * 1e-9 for m in before])
    rates = [np.array([m.rate for m in side]) for side in (before, after)]
    force = np.array([m.force for m in before])
    encoder = ((run.pose.stamp_ns - start) * 1e-9, run.pose.position)
    swinging = (encoder[0] > 0) & (encoder[0] < time[-1] - 2.5)  # the ramp at the end is no sine
    inside = time < time[-1] - 2.5
    steady = steady_part(
        Samples(time[inside], rates[0][inside], force[inside], encoder[0][swinging], encoder[1][swinging])
    )
    assert steady is not None
    assert steady.moving
    at = np.isin(time, steady.time)
    known = true_rate(load_compensation(file).reference, steady.drivers, REGRESSED)
    return Closed(report, folder, time[at], rates[0][at], rates[1][at], known)


def low_passed(rate: Array, rate_hz: float) -> Array:
    """Below 5 Hz, mean removed."""
    spectrum = np.fft.rfft(rate - rate.mean(axis=0), axis=0)
    spectrum[np.fft.rfftfreq(len(rate), 1 / rate_hz) > 5.0] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(rate), axis=0))


def residual(case: Closed, rate: Array) -> float:
    """Root mean square below 5 Hz, deg/s."""
    return float(np.sqrt(np.mean(low_passed(rate, 1 / float(np.median(np.diff(case.time)))) ** 2))) * DEG


def tilt(case: Closed, rate: Array) -> float:
    """What the gyro alone integrates about the horizontal axes in step with the drive, root mean square, deg."""
    angle = np.cumsum(rate - rate.mean(axis=0), axis=0)[:, :2] * float(np.median(np.diff(case.time)))
    t = case.time - case.time.mean()
    phase = np.outer(t, HELD_OUT * np.arange(1.0, 4.0))
    columns = np.column_stack([np.cos(phase), np.sin(phase), np.vander(t / t[-1], 4)])
    beta = np.linalg.lstsq(columns, angle, rcond=None)[0][:6]
    return float(np.sqrt(np.sum(beta**2) / 4)) * DEG


def left(case: Closed, after: Array, before: Array) -> float:
    """Part of the mean square above the noise floor that stays."""
    floor = case.report["rate_rms"]["noise_floor"] * DEG
    return (residual(case, after) ** 2 - floor**2) / (residual(case, before) ** 2 - floor**2)


def test_an_effect_of_the_sensor_comes_off_the_gyro(tmp_path: Path) -> None:
    case = closed(tmp_path, "g_squared=2e-5")
    (finding,) = case.report["findings"]
    assert (finding["effect"], finding["owner"]) == ("g_squared", "sensor")
    assert left(case, case.compensated, case.plain) < 0.15
    assert tilt(case, case.compensated) < 0.2 * tilt(case, case.plain)


def test_a_late_gyro_is_shifted_by_the_chain_s_delay(tmp_path: Path) -> None:
    case = closed(tmp_path, "time_offset=0.03")
    (finding,) = case.report["findings"]
    assert (finding["effect"], finding["owner"]) == ("time_offset", "chain")
    file = load_compensation(case.folder / "compensation.yaml")
    assert file.gyro_delay_s == pytest.approx(0.03, abs=0.006)
    assert left(case, case.compensated, case.plain) < 0.15


def test_a_true_rotation_of_the_rig_corrects_the_reference_and_not_the_gyro(tmp_path: Path) -> None:
    case = closed(tmp_path, "rail_curvature=3e-3")
    (finding,) = case.report["findings"]
    assert (finding["effect"], finding["owner"]) == ("rail_curvature", "rig")
    file = load_compensation(case.folder / "compensation.yaml")
    assert [term.effect for term in file.terms] == ["g_sensitivity"]
    assert [term.effect for term in file.reference] == ["rail_curvature"]
    against_level, against_true = case.compensated, case.compensated - case.reference
    assert left(case, against_true, against_level) < 0.15
    assert tilt(case, against_true) < 0.2 * tilt(case, against_level)  # the gyro was right, the level reference was not
    # what the node took off is G alone: subtracting the rotation would make an error of its size
    taken = case.plain - case.compensated
    assert abs(np.corrcoef(low_passed(taken, 200.0)[:, 1], low_passed(case.reference, 200.0)[:, 1])[0, 1]) < 0.5
