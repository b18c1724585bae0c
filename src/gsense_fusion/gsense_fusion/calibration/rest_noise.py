"""Noise of a sensor from the longest rest of its bags: parameters for the bridge, and the curve as a picture."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import yaml
from matplotlib.figure import Figure

from gsense_fusion.bags.run import Run
from gsense_fusion.bags.topics import raw_topic, sensor_name
from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.recording.integrity import CleanRun, clean_runs
from gsense_fusion.identification.recording.stillness import still_stretches
from gsense_fusion.identification.types import AXES, IdentificationError, Role

from .allan import NoiseParameters, noise_parameters, pooled_density


@dataclass(frozen=True)
class RestNoise:
    """Noise of one sensor."""

    sensor: str
    bag: str
    seconds: float
    rate_hz: float
    gyro: dict[str, NoiseParameters]
    """By axis; rad/s."""
    accelerometer: dict[str, NoiseParameters]
    """By axis; m/s^2; empty where there is none."""


def rest_noise(runs: Sequence[Run], sensor: str) -> RestNoise:
    """Noise from the longest stretch at rest.

    Raises:
        IdentificationError: no rest of half a minute.
    """
    clean = clean_runs([(run, Role.FIT) for run in runs])
    stretches = [s for run in clean for s in _rests(run)]
    if not stretches:
        raise IdentificationError(f"{clean[0].path}: no rest in it; leave the board alone for some minutes and record")
    longest = max(stretches, key=len)
    seconds = len(longest) / longest.rate_hz
    try:
        gyro = {
            AXES[i]: noise_parameters(np.asarray(longest.angular_rate[:, i], np.float64), longest.rate_hz)
            for i in longest.axes
        }
        has_force = bool(np.isfinite(longest.specific_force).all())
        force = (
            {
                x: noise_parameters(np.asarray(longest.specific_force[:, i], np.float64), longest.rate_hz)
                for i, x in enumerate(AXES)
            }
            if has_force
            else {}
        )
    except ValueError as error:
        raise IdentificationError(f"{longest.path}: {error}") from error
    return RestNoise(sensor, longest.path, seconds, longest.rate_hz, gyro, force)


def _rests(run: CleanRun) -> list[CleanRun]:
    if not run.has_rig and np.isfinite(run.specific_force).all():
        return still_stretches(run)
    if not run.has_rig:  # neither rig nor accelerometer: the user says that it rests
        return [run]
    (data,) = build_campaign([run]).runs
    return [
        replace(
            run,
            time=run.time[w.start : w.stop],
            angular_rate=run.angular_rate[w.start : w.stop],
            specific_force=run.specific_force[w.start : w.stop],
        )
        for w in data.windows
        if not w.moving
    ]


def bridge_parameters(noise: RestNoise) -> str:
    """ROS parameters for the bridge: its densities of this sensor."""
    name = sensor_name(noise.sensor).strip("/")
    values = {f"{name}.gyro_noise_density": float(f"{pooled_density(list(noise.gyro.values())):.4g}")}
    if noise.accelerometer:
        values[f"{name}.accel_noise_density"] = float(f"{pooled_density(list(noise.accelerometer.values())):.4g}")
    head = (
        f"# from {noise.seconds:.0f} s of rest in {noise.bag}; ros2 run gsense_driver bridge --ros-args --params-file\n"
    )
    return head + yaml.safe_dump({"/**/bridge": {"ros__parameters": values}}, sort_keys=False)


def kalibr_imu(noise: RestNoise) -> str:
    """Kalibr's imu.yaml, also read by VINS programs: N and K of the Allan deviation, its worst axis.

    Kalibr's density is N itself, the deviation at 1 s; the bridge's is sqrt(2) N, one-sided. A rate random walk that
    the rest was too short to see is written as the largest that the end of the curve allows.
    """
    values: dict[str, object] = {}
    bounded = []
    for kind, found in (("accelerometer", noise.accelerometer), ("gyroscope", noise.gyro)):
        if not found:
            continue
        walk = max(p.rate_random_walk for p in found.values())
        if walk == 0.0:
            bounded.append(kind)
            walk = max(float(p.curve.deviation[-1] * np.sqrt(3.0 / p.curve.tau[-1])) for p in found.values())
        values[f"{kind}_noise_density"] = float(f"{max(p.random_walk for p in found.values()):.4g}")
        values[f"{kind}_random_walk"] = float(f"{walk:.4g}")
    values |= {"rostopic": raw_topic(noise.sensor), "update_rate": round(noise.rate_hz, 2)}
    head = f"# from {noise.seconds:.0f} s of rest in {noise.bag}; in motion there is more: Kalibr advises ten times\n"
    head += f"# upper bound, not seen in this time: random walk of {' and '.join(bounded)}\n" if bounded else ""
    return head + yaml.safe_dump(values, sort_keys=False)


def noise_json(noise: RestNoise) -> str:
    """Everything that was found."""

    def axes(found: dict[str, NoiseParameters]) -> dict[str, object]:
        return {
            x: {
                "density": p.density,
                "random_walk": p.random_walk,
                "random_walk_stderr": p.random_walk_stderr,
                "bias_instability": p.instability,
                "rate_random_walk": p.rate_random_walk,
            }
            for x, p in found.items()
        }

    document = {
        "schema": "gsense-noise/1",
        "sensor": noise.sensor,
        "bag": noise.bag,
        "seconds": noise.seconds,
        "rate_hz": noise.rate_hz,
        "gyro": {"unit": "rad/s", "axes": axes(noise.gyro)},
        "accelerometer": {"unit": "m/s^2", "axes": axes(noise.accelerometer)} if noise.accelerometer else None,
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def allan_picture(noise: RestNoise) -> bytes:
    """The Allan curves with their models, PNG."""
    kinds = [("gyro, deg/s", noise.gyro, 180 / np.pi), ("accelerometer, m/s^2", noise.accelerometer, 1.0)]
    kinds = [k for k in kinds if k[1]]
    figure = Figure(figsize=(6.0 * len(kinds), 4.2), layout="constrained")
    for number, (title, found, scale) in enumerate(kinds):
        plot = figure.add_subplot(1, len(kinds), number + 1)
        for colour, (axis, p) in enumerate(found.items()):
            c = p.curve
            plot.errorbar(
                c.tau, c.deviation * scale, c.stderr * scale, fmt=".", ms=4, lw=0.8, color=f"C{colour}", label=axis
            )
            plot.plot(c.tau, p.model(c.tau) * scale, "-", lw=1, color=f"C{colour}")
        plot.set_xscale("log")
        plot.set_yscale("log")
        plot.set_xlabel("averaging time, s")
        plot.set_title(f"Allan deviation, {title}", fontsize=10)
        plot.grid(visible=True, which="both", alpha=0.3)
        plot.legend()
    sink = io.BytesIO()
    figure.savefig(sink, format="png", dpi=130)
    return sink.getvalue()
