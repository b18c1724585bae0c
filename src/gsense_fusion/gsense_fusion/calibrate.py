"""`calibrate`: from still poses and sweeps to bias, G, k, accelerometer and magnetometer, with their errors."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_fusion.bags import load_run
from gsense_fusion.bags.run import Run
from gsense_fusion.calibration.accelerometer import AccelerometerCalibration, calibrate_accelerometer, pose_means
from gsense_fusion.calibration.document import Calibration, calibration_json, words
from gsense_fusion.calibration.export import FORMATS, export
from gsense_fusion.calibration.gyro import GyroCalibration, calibrate_gyro
from gsense_fusion.calibration.magnetometer import MagnetometerCalibration, calibrate_magnetometer
from gsense_fusion.calibration.turns import ScaleCalibration, calibrate_scale, find_turns
from gsense_fusion.calibration.variants import VARIANTS, WITH_SCALE
from gsense_fusion.cli import add_bag_arguments, guarded, named_roles
from gsense_fusion.compensation import CompensationFile, ScaleMisalignment
from gsense_fusion.compensation.document import write_together
from gsense_fusion.compensation.model import compensation_yaml
from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.motion.earth import Site
from gsense_fusion.identification.types import GRAVITY, IdentificationError, Role


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code: 0, or 2 for unusable input (one line on stderr)."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    named = [*arguments.campaign, *arguments.fit]
    if not named:
        parser.error("--campaign or --fit is needed")

    def work() -> None:
        calibration = _calibrate(arguments)
        file = _file(calibration, scaled=arguments.variant in WITH_SCALE)
        out: Path = arguments.out
        out.mkdir(parents=True, exist_ok=True)
        texts = {"calibration.json": calibration_json(calibration), "compensation.yaml": compensation_yaml(file)}
        texts |= {f"{name}.yaml": export(file, name) for name in arguments.export}
        write_together(out, texts)
        print("\n".join([*words(calibration), *(str(out / name) for name in texts)]))

    return guarded("calibrate", named[0], arguments.out, work)


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(
        prog="calibrate",
        description="Bias, G and k of a gyro from still poses and sweeps; its accelerometer and magnetometer.",
    )
    add_bag_arguments(parser)
    parser.add_argument("--sensor", default="mpu6050", help="a sensor's name or a whole topic (default: mpu6050)")
    parser.add_argument(
        "--variant",
        choices=[*VARIANTS, *WITH_SCALE],
        default="matrix",
        help="form of the g-compensation (default: matrix)",
    )
    parser.add_argument(
        "--gravity", type=float, default=GRAVITY, help=f"of the place, m/s^2 (default: standard, {GRAVITY})"
    )
    parser.add_argument("--latitude", type=float, metavar="DEG", help="of the place: earth rate is then subtracted")
    parser.add_argument("--rail-azimuth", type=float, metavar="DEG", help="of the rail, from north over east")
    parser.add_argument("--export", nargs="+", choices=FORMATS, default=[], help="also write the layout of ...")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the results")
    return parser


def _calibrate(arguments: argparse.Namespace) -> Calibration:
    runs = [(load_run(path, arguments.sensor), role) for path, role in named_roles(arguments)]
    variant = WITH_SCALE.get(arguments.variant, arguments.variant)
    gyro, analysis = calibrate_gyro(runs, arguments.sensor, variant, _site(arguments))
    accelerometer = calibrate_accelerometer(pose_means(analysis.campaign.fit), arguments.gravity)
    return Calibration(gyro, accelerometer, _magnetometer(runs), *_scale(gyro, analysis, accelerometer))


def _scale(
    gyro: GyroCalibration, analysis: Analysis, accelerometer: AccelerometerCalibration | str
) -> tuple[ScaleCalibration | str, ScaleCalibration | str]:
    """Scale and misalignment from turns, with G (where it is significant) and without it."""
    fit = [run for run in analysis.clean if run.role is Role.FIT]
    correction = None if isinstance(accelerometer, str) else accelerometer.correction
    g = np.asarray(gyro.g_sensitivity.value * float(gyro.significant), dtype=np.float64)
    with_g, without = (calibrate_scale(find_turns(fit, matrix, correction)) for matrix in (g, np.zeros((3, 3))))
    return with_g, without


def _site(arguments: argparse.Namespace) -> Site | None:
    if arguments.latitude is None:
        if arguments.rail_azimuth is not None:
            raise IdentificationError("--rail-azimuth says nothing without --latitude: give both")
        return None
    if not -90.0 <= arguments.latitude <= 90.0:
        raise IdentificationError(f"--latitude {arguments.latitude:g}: degrees from -90 to 90")
    return Site(arguments.latitude, arguments.rail_azimuth)


def _magnetometer(runs: Sequence[tuple[Run, Role]]) -> MagnetometerCalibration | str | None:
    fields = [run.mag.field for run, role in runs if role is Role.FIT and run.mag is not None]
    return calibrate_magnetometer(np.concatenate(fields)) if fields else None


def _file(calibration: Calibration, scaled: bool) -> CompensationFile:
    """What the fusion node loads: only what was found."""
    file, scale = calibration.gyro.file, calibration.scale
    if scaled and isinstance(scale, ScaleCalibration) and scale.significant:
        file = replace(file, terms=(*file.terms, ScaleMisalignment(scale.rows)))
    accelerometer, magnetometer = calibration.accelerometer, calibration.magnetometer
    return replace(
        file,
        accelerometer=None if isinstance(accelerometer, str) else accelerometer.correction,
        magnetometer=magnetometer.correction if isinstance(magnetometer, MagnetometerCalibration) else None,
    )


if __name__ == "__main__":
    sys.exit(main())
