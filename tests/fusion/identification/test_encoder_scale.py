"""The encoder's metres against gravity: what poses decide, what they leave open, a belt that stretches."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.study.judge import analyse
from tests.study.simulator import PlannedRun, Session, simulate

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.campaign import Campaign
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.recording.rail_scale import RailScale, rail_scale
from gsense_fusion.identification.types import Owner
from gsense_fusion.report.figures import figures

from .sessions import BASE, SETTINGS, analysed, finding, made, names

NAME = "encoder_scale"
LEVEL, TURNED = (0.0, 0.0, 0.0), (0.0, 0.0, 180.0)
SIDES = ((90.0, 0.0, 0.0), (-90.0, 0.0, 0.0), (0.0, 90.0, 0.0), (0.0, -90.0, 0.0), (180.0, 0.0, 0.0))
"""How the board lies beside level, Euler angles in degrees."""


def felt(poses: tuple[tuple[float, ...], ...], moving: int, seed: int, scale: float, ring_hz: float = 1e3) -> RailScale:
    """A board of its own scale, cross-axis and bias, in poses of which the first `moving` ran along a sloping rail."""
    rng = np.random.default_rng(seed)
    sensor = np.eye(3) + np.diag(rng.normal(0, 0.01, 3)) + rng.normal(0, 0.005, (3, 3))
    bias, rail = rng.normal(0, 0.3, 3), Rotation.from_euler("y", rng.normal(0, 0.005))
    mountings, runs = [], []
    for number, pose in enumerate(poses):
        turn = (Rotation.from_rotvec(rng.normal(0, 0.007, 3)) * Rotation.from_euler("xyz", pose, degrees=True)).inv()
        gravity = sensor @ turn.apply(rail.apply([0, 0, 9.81], inverse=True)) + bias + rng.normal(0, 0.003, 3)
        along = sensor @ turn.apply([1.0, 0.0, 0.0])
        norm = float(np.linalg.norm(gravity))
        moves = along / np.linalg.norm(along) if number < moving else None
        mountings.append(Mounting(gravity / norm, moves, norm))
        for w in (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0) if number < moving else ():
            part = 1.0 / (1.0 - (w / (2 * np.pi * ring_hz)) ** 2) + 0.02 / w**2 + rng.normal(0, 1e-4)
            geometry = SimpleNamespace(along=along * part / (1.0 + scale), delay=SimpleNamespace(stderr=1e-5))
            runs.append(SimpleNamespace(geometry=geometry, motion=SimpleNamespace(angular_frequency=w)))
    found = rail_scale(cast(Campaign, SimpleNamespace(runs=runs, mountings=mountings)))
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("poses", "moving", "known"),
    [((LEVEL,), 1, 0.05), ((LEVEL, TURNED), 2, 0.05), ((LEVEL, *SIDES), 1, 0.003), ((LEVEL, *SIDES[2:4]), 1, 0.004)],
    ids=["level", "turned", "six sides", "on both ends"],
)
def test_the_poses_decide_how_well_the_scale_is_known(poses: Any, moving: int, known: float) -> None:
    for seed in range(2):
        found = felt(poses, moving, seed, 0.01)
        assert 0.4 * known < found.error_stderr < known
        assert abs(found.error - 0.01) < 3 * found.error_stderr
        assert abs(found.stretch) < 3 * found.stretch_stderr


def test_a_belt_shows_by_frequency_alone() -> None:
    found = felt((LEVEL,), 1, 5, 0.0, ring_hz=12.0)
    assert found.stretch == pytest.approx((2 * np.pi * 12.0) ** -2, abs=3 * found.stretch_stderr)
    assert found.stretch > 10 * found.stretch_stderr


def with_encoder(**chain: float) -> Session:
    return made(base=replace(BASE, chain=replace(BASE.chain, **chain)))


def on_six_sides(session: Session) -> Session:
    """The session with the same sensor put down beside the rail on its other five sides."""
    runs: list[tuple[Run, str]] = []
    still = tuple(PlannedRun(0.0, 6.0) for _ in BASE.plan)  # as many runs: the sensor's own errors stay
    for number, angles in enumerate(SIDES):
        turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
        frame = cast(Any, tuple(tuple(row) for row in turn))
        lying = simulate(replace(BASE, plan=still, frame=frame, start_s=1000.0 + 100.0 * number))
        run, role = lying.runs[0]
        runs.append((replace(run, name=f"side{number}", pose=None, temperature=None), role))
    return replace(session, runs=(*session.runs, *runs))


def test_without_other_poses_it_is_undecided_and_the_run_that_decides_is_said() -> None:
    result = analysed()
    (line,) = [u for u in result.undecided if u.startswith(f"{NAME} could not be decided")]
    assert "six sides" in line


@pytest.mark.slow
def test_six_sides_find_two_per_cent_in_a_short_session() -> None:
    result = analyse(on_six_sides(with_encoder(encoder_scale=0.02)), SETTINGS)
    assert (result.verdict, names(result)) == ("effects_found", [NAME]), result.unexplained
    found = finding(result, NAME)
    assert found.owner is Owner.REFERENCE
    scale = found.parameters["scale"]
    assert scale.value == pytest.approx(0.02, abs=3 * scale.stderr)
    assert scale.stderr < 0.005
    assert "metres per count" in found.advice
    assert NAME in {f.key for f in figures(result)}


@pytest.mark.slow
def test_six_sides_find_nothing_where_nothing_is_and_no_name_leaves_it_unexplained() -> None:
    sound = analyse(on_six_sides(made()), SETTINGS)
    assert sound.verdict == "nothing_missing", (names(sound), sound.unexplained)
    assert any("encoder's scale agrees" in n for n in sound.notes), sound.notes
    nameless = Settings("mpu6050", catalogue=tuple(e for e in CATALOGUE if e.name != NAME))
    result = analyse(with_encoder(encoder_scale=0.2), nameless)  # more than any accelerometer
    assert result.verdict == "unexplained"
