"""A live campaign with a rig that takes no time: order, refusals, and going on after a kill at any moment."""

from __future__ import annotations

import io
import os
import signal
import sys
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from gsense_rig.campaign.crew import CampaignError, LinkFigures, RunOutcome, Show
from gsense_rig.campaign.index import checksum
from gsense_rig.campaign.live import Limits, LiveCampaign, LiveResult, Step
from gsense_rig.campaign.order import draw_order
from gsense_rig.campaign.plan import Plan, PlanRun, load_plan, parse_plan
from gsense_rig.recording.bag import BagWriter, storage_file
from gsense_rig.recording.typestore import typestore

PLAN = parse_plan(
    """
runs:
  - {shape: static, duration: 1}
  - {shape: sine, amplitude: 0.1, angular_frequency: 5, duration: 2}
  - {shape: sine, amplitude: 0.1, angular_frequency: 6, duration: 2, mounting: 180, role: held_out}
  - {shape: sine, amplitude: 0.1, angular_frequency: 6, duration: 2, mounting: 180, role: held_out}
  - {shape: triangle, amplitude: 0.1, angular_frequency: 4, duration: 2}
""",
    "short",
)


class FakeCrew:
    """Writes a bag that names its run; notes what it did in a file outside the campaign."""

    def __init__(self, log: Path, unit: str = "unit-1") -> None:
        self.log = log
        self.unit = unit
        self.link = LinkFigures(900, 0, 3.0)
        self.outcomes: list[RunOutcome] = []
        self.turns: list[str] = []

    def unit_id(self) -> str:
        return self.unit

    def link_figures(self) -> LinkFigures:
        return self.link

    def ready(self) -> None:
        pass

    def turn(self, mounting: str) -> None:
        self.turns.append(mounting)

    def make_run(self, run: PlanRun, bag: Path, show: Show) -> RunOutcome:
        show("recording")
        with self.log.open("a") as log:
            log.write(f"{bag.name}\n")
        with BagWriter(bag) as writer:
            connection = writer.add_connection("/run", "std_msgs/msg/String", typestore=typestore())
            for k in range(20):
                writer.write(connection, k, f"{run}".encode())
        return self.outcomes.pop(0) if self.outcomes else RunOutcome(20, 600, 0, 0, 1e-4)


def campaign(folder: Path, crew: FakeCrew, **options: object) -> LiveResult:
    options.setdefault("space", lambda _: 1e12)
    return LiveCampaign(options.pop("plan", PLAN), folder, crew, **options).run()  # type: ignore[arg-type]


def index_of(folder: Path) -> list[dict[str, object]]:
    return yaml.safe_load((folder / "index.yaml").read_text())["runs"]


def check(folder: Path, plan: Plan = PLAN) -> None:
    """Every run of the plan is there once, with the bag that the index says."""
    runs = index_of(folder)
    assert Counter(PlanRun(**run["plan"]) for run in runs) == Counter(plan.runs)  # type: ignore[arg-type]
    names = [run["bag"] for run in runs]
    assert sorted(p.name for p in folder.iterdir()) == sorted([*names, "index.yaml"])
    for run in runs:
        file = storage_file(folder / str(run["bag"]))
        assert run["state"] == "done"
        assert run["checksum"] == checksum(file)
        assert str(PlanRun(**run["plan"])).encode() in file.read_bytes()  # type: ignore[arg-type]


def test_makes_every_run_and_the_index(tmp_path: Path) -> None:
    crew, steps = FakeCrew(tmp_path / "log"), list[Step]()
    result = campaign(tmp_path / "out", crew, progress=steps.append)
    check(tmp_path / "out")
    assert (result.made, result.kept, result.lost) == (5, 0, 0)
    assert crew.turns == ["0", "180"]
    remaining = [step.remaining for step in steps]
    assert remaining == sorted(remaining, reverse=True)
    assert remaining[0] > sum(run.duration for run in PLAN.runs)
    assert campaign(tmp_path / "out", FakeCrew(tmp_path / "other")).kept == 5
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize("at", range(0, 150, 5))
def test_killed_at_any_moment_it_goes_on(tmp_path: Path, at: int) -> None:
    """SIGKILL at the file operation `at`: the next start makes what is missing, and nothing twice that was there."""
    folder, log = tmp_path / "out", tmp_path / "log"
    log.touch()
    killed = _in_child(lambda: (_kill_at(at, folder), campaign(folder, FakeCrew(log))))
    there = {p.name for p in folder.glob("run_*")} if folder.exists() else set()
    log.write_text("")
    result = campaign(folder, FakeCrew(log))
    check(folder)
    made = log.read_text().split()
    assert not there & set(made)
    assert (len(made), result.made, result.kept) == (5 - len(there), 5 - len(there), len(there))
    assert killed or len(there) == 5


def _kill_at(count: int, folder: Path) -> None:
    left = [count]

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir") and str(arguments[0]).startswith(
            str(folder)
        ):
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def _in_child(action: Callable[[], object]) -> bool:
    """Runs it in a fork; whether that was killed."""
    child = os.fork()
    if child == 0:
        action()
        os._exit(0)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
    return os.WIFSIGNALED(status)


def test_a_damaged_bag_is_made_again(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    campaign(folder, FakeCrew(tmp_path / "log"))
    storage_file(folder / "run_02").write_bytes(b"nothing")
    (tmp_path / "log").write_text("")
    assert campaign(folder, FakeCrew(tmp_path / "log")).made == 1
    assert (tmp_path / "log").read_text() == "run_02\n"
    check(folder)


def test_refuses_to_begin(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    lossy, dead, crew = (FakeCrew(tmp_path / "log") for _ in range(3))
    lossy.link = LinkFigures(880, 20, 3.0)
    dead.link = LinkFigures(0, 0, 3.0)
    cases: list[tuple[FakeCrew, dict[str, object], str]] = [
        (lossy, {}, "lost 20 of 900 frames in 3 s"),
        (dead, {}, "no frame came"),
        (crew, {"space": lambda _: 1e6}, "1 MB free, 5 runs need"),
    ]
    for who, options, words in cases:
        with pytest.raises(CampaignError, match=words) as caught:
            campaign(folder, who, **options)
        assert "\n" not in str(caught.value)
        assert not list(folder.glob("run_*"))
    assert not (tmp_path / "log").exists()


def test_refuses_a_folder_of_something_else(tmp_path: Path) -> None:
    folder, crew = tmp_path / "out", FakeCrew(tmp_path / "log")
    campaign(folder, crew)
    other = Plan("other", PLAN.runs[:2])
    with pytest.raises(CampaignError, match="of another plan"):
        campaign(folder, crew, plan=other)
    with pytest.raises(CampaignError, match="of unit 'unit-1', but 'unit-2' is on the rail"):
        campaign(folder, FakeCrew(tmp_path / "log", "unit-2"))
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("x")
    with pytest.raises(CampaignError, match="is not empty"):
        campaign(tmp_path / "mine", crew)
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["thesis.txt"]
    with pytest.raises(CampaignError, match="is a file"):
        campaign(tmp_path / "mine" / "thesis.txt", crew)


def test_a_run_that_lost_samples_is_made_again_and_at_last_stops(tmp_path: Path) -> None:
    crew = FakeCrew(tmp_path / "log")
    bad, unkept, broken, good = (
        RunOutcome(20, 590, 10, 0, 1e-4),
        RunOutcome(20, 600, 0, 7, 1e-4),
        RunOutcome(20, 600, 0, 0, 1e-4, "the board started anew in mid-run"),
        RunOutcome(20, 600, 0, 0, 1e-4),
    )
    crew.outcomes = [bad, unkept, good, broken, good, bad, bad, bad]
    with pytest.raises(CampaignError, match="run_02: the link lost 10 of 600 frames, in each of 3 attempts"):
        campaign(tmp_path / "out", crew)
    assert [run["state"] for run in index_of(tmp_path / "out")] == ["done", "done", "pending", "pending", "pending"]
    campaign(tmp_path / "out", FakeCrew(tmp_path / "log"), limits=Limits(loss=0.1))
    check(tmp_path / "out")


def test_two_campaigns_do_not_share_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "out"

    class Nosy(FakeCrew):
        def turn(self, mounting: str) -> None:  # noqa: ARG002
            with pytest.raises(CampaignError, match="another campaign is running there"):
                campaign(folder, FakeCrew(self.log))

    campaign(folder, Nosy(tmp_path / "log"))
    check(folder)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), name=st.sampled_from(["minimum", "full", "thesis"]))
def test_the_order_is_drawn_and_turns_the_board_seldom(seed: int, name: str) -> None:
    runs = load_plan(name).runs
    order = draw_order(runs, seed)
    assert Counter(order) == Counter(runs)
    assert (order[0], order[-1]) == (runs[0], runs[-1])
    turns = sum(a.mounting != b.mounting for a, b in pairwise(order))
    assert turns <= len({run.mounting for run in runs})
    assert draw_order(runs, seed) == order


def test_seeds_differ() -> None:
    runs = load_plan("minimum").runs
    assert len({draw_order(runs, seed) for seed in range(20)}) == 20


def test_a_person_is_asked_in_words_and_must_be_there() -> None:
    pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")
    from gsense_rig.campaign.operators import WORDS, Person
    from gsense_rig.sensors.mounting import MOUNTINGS

    questions: list[str] = []
    person = Person(questions.append)
    for mounting in MOUNTINGS:
        person.turn(mounting)
        assert WORDS[mounting] in questions[-1]

    def nobody(_: str) -> None:
        raise EOFError

    with pytest.raises(CampaignError, match="nobody is at the terminal"):
        Person(nobody).turn("90")


@pytest.mark.parametrize(("kind", "terminal"), [("xterm", True), ("dumb", True), ("xterm", False)])
def test_progress_tells_run_and_time_left(kind: str, terminal: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")
    from gsense_rig.campaign.command import Bar

    monkeypatch.setenv("TERM", kind)
    text = io.StringIO()
    bar = Bar(5, Console(file=text, force_terminal=terminal, width=120))
    for what in ("turn the board", "in motion"):
        bar.show(Step(3, 5, PLAN.runs[1], what, 100.4))
    bar.close()
    assert "run_03 of 5: sine 5 rad/s, mounting 0, " in text.getvalue()
    assert "1:40 left" in text.getvalue() or "1:39 left" in text.getvalue()
    assert ("in motion" in text.getvalue()) == (terminal and kind != "dumb")
