"""The picture of a run: drawn from a bag's own numbers, refused in one line where there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from gsense_rig import plot_run, simulate
from gsense_rig.recording.run_columns import read_columns
from gsense_rig.recording.typestore import typestore

PLAN = "runs: [{shape: sine, amplitude: 0.1, angular_frequency: 6, duration: 3}]"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    (folder / "plan.yaml").write_text(PLAN)
    assert simulate.main([str(folder / "plan.yaml"), "--out", str(folder / "out")]) == 0
    return folder / "out" / "run_00"


def test_columns_are_the_bags(bag: Path) -> None:
    run = read_columns(bag, "mpu6050", typestore())
    assert np.abs(run.pose[:, 1]).max() == pytest.approx(0.1, abs=2e-3)
    reference = np.interp(run.pose[:, 0], run.state[:, 0], run.state[:, 1])
    assert np.abs(run.pose[:, 1] - reference).max() < 5e-3
    middle = np.abs(run.imu[:, 0] - run.pose[-1, 0] / 2) < np.pi / 6  # a whole period
    assert np.std(run.imu[middle, 4]) == pytest.approx(0.1 * 36.0 / np.sqrt(2), rel=0.1)
    assert abs(run.imu[0, 0]) < 0.1


def test_draws_every_panel(bag: Path, tmp_path: Path) -> None:
    assert plot_run.main([str(bag), "--out", str(tmp_path / "run.png")]) == 0
    image = imread(tmp_path / "run.png")
    assert image.shape[:2] == (640, 800)
    assert [p.name for p in tmp_path.iterdir()] == ["run.png"]
    figure = plot_run.draw(read_columns(bag, "mpu6050", typestore()))
    assert [len(axes.lines) for axes in figure.axes] == [2, 2, 1, 1, 3, 3, 3, 3]


@pytest.mark.parametrize(
    ("which", "sensor", "words"),
    [("absent", "mpu6050", "plot_run: "), ("run_00", "bno056", "no messages on bno056/imu/data_raw")],
)
def test_refuses_in_one_line(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], which: str, sensor: str, words: str
) -> None:
    out = tmp_path / "run.png"
    assert plot_run.main([str(bag.parent / which), "--sensor", sensor, "--out", str(out)]) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
    assert not out.exists()


def test_a_folder_that_is_not_there_is_named(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert plot_run.main([str(bag), "--out", str(tmp_path / "none" / "run.png")]) == 2
    assert capsys.readouterr().err == f"plot_run: {tmp_path / 'none'}: no such folder\n"
