"""`noise`: Allan deviation of a still bag, as densities for the bridge's covariances and as a picture."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_fusion.bags import load_run
from gsense_fusion.calibration.allan import pooled_density
from gsense_fusion.calibration.rest_noise import (
    allan_picture,
    bridge_parameters,
    kalibr_imu,
    noise_json,
    rest_noise,
)
from gsense_fusion.cli import guarded
from gsense_fusion.compensation.document import write_atomically


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code: 0, or 2 for unusable input (one line on stderr)."""
    arguments = _parser().parse_args(argv)

    def work() -> None:
        noise = rest_noise([load_run(path, arguments.sensor) for path in arguments.bags], arguments.sensor)
        out: Path = arguments.out
        out.mkdir(parents=True, exist_ok=True)
        written = [out / "bridge_noise.yaml", out / "noise.json", out / "allan.png", out / "kalibr_imu.yaml"]
        write_atomically(written[0], bridge_parameters(noise))
        write_atomically(written[1], noise_json(noise))
        write_atomically(written[2], allan_picture(noise))
        write_atomically(written[3], kalibr_imu(noise))
        lines = [f"{noise.sensor}: {noise.seconds:.0f} s of rest in {noise.bag}"]
        gyro = list(noise.gyro.values())
        lines.append(
            f"gyro: white {np.degrees(pooled_density(gyro)):.5f} deg/s/sqrt(Hz), bias instability "
            f"{np.degrees(max(p.instability for p in gyro)):.5f} deg/s, rate random walk "
            f"{np.degrees(max(p.rate_random_walk for p in gyro)):.2e} deg/s/sqrt(s)"
        )
        if noise.accelerometer:
            density = pooled_density(list(noise.accelerometer.values()))
            lines.append(f"accelerometer: white {density:.5f} m/s^2/sqrt(Hz)")
        sys.stdout.write("\n".join([*lines, *(str(path) for path in written)]) + "\n")

    return guarded("noise", arguments.bags[0], arguments.out, work)


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(prog="noise", description="Noise parameters of a sensor from bags at rest.")
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="bags; the longest rest in them is used")
    parser.add_argument("--sensor", default="mpu6050", help="a sensor's name or a whole topic (default: mpu6050)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    return parser


if __name__ == "__main__":
    sys.exit(main())
