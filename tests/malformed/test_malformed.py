"""What is malformed gets one line or a valid result; `./rig bench malformed` draws a thousand, here are a few."""

from __future__ import annotations

import os
import random
import signal
import sys
from pathlib import Path

import pytest
from tests.malformed import workers
from tests.malformed.answers import Verdict, answer
from tests.malformed.cases import MAKERS, Material, run_case

from gsense_driver.user_input.yaml_text import parse_yaml


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> Material:
    return Material.make(tmp_path_factory.mktemp("material"))


def faults(material: Material, folder: Path, numbers: range, *, as_process: bool = False) -> list[Verdict]:
    verdicts = [run_case(n, 7, material, folder / "case", as_process=as_process) for n in numbers]
    return [v for v in verdicts if v.faults]


def test_some_in_this_process(material: Material, tmp_path: Path) -> None:
    assert faults(material, tmp_path, range(20)) == []


@pytest.mark.parametrize(("seed", "number"), [(1, 513), (9, 32), (9, 55), (9, 173), (9, 262), (10, 760)])
def test_what_was_once_answered_wrongly(material: Material, tmp_path: Path, seed: int, number: int) -> None:
    """Of `./rig bench malformed`.

    513: a rest so short that no ordinate lies below the noise's shape. 32, 262: forces and positions of 1e308. 55:
    metadata that names a packed file as the bag. 173: a schema of a thousand letters. 760: a null character in a path.
    """
    assert run_case(number, seed, material, tmp_path / "case").faults == []


@pytest.mark.slow
def test_more_in_this_process(material: Material, tmp_path: Path) -> None:
    assert faults(material, tmp_path, range(20, 80)) == []


@pytest.mark.slow
def test_four_as_processes(material: Material, tmp_path: Path) -> None:
    assert faults(material, tmp_path, range(4), as_process=True) == []


@pytest.mark.parametrize(
    ("code", "error", "fault"),
    [
        (2, "", "not one line"),
        (2, "close_loop: one\nand another\n", "not one line"),
        (2, "close_loop: the analysis broke down (KeyError)\n", "broke down"),
        (2, "another: line\n", "not one line"),
        (1, "", "exit 1"),
        (2, "close_loop: fine\n", ""),
        (0, "", ""),
    ],
)
def test_the_judge_sees_what_is_wrong(tmp_path: Path, code: int, error: str, fault: str) -> None:
    def call(_command: list[str], _out: Path) -> int:
        sys.stderr.write(error)
        return code

    verdict = Verdict(0, "made up", ["close_loop"])
    answer(verdict, tmp_path / "out", call)
    assert [fault in line for line in verdict.faults] == ([True] if fault else [])


def test_the_judge_sees_exceptions_and_what_is_left_behind(tmp_path: Path) -> None:
    def raising(_command: list[str], _out: Path) -> int:
        raise KeyError("x")

    def leaving(_command: list[str], out: Path) -> int:
        out.mkdir()
        (out / ".report.json.abc").write_text("")
        sys.stderr.write("close_loop: fine\n")
        return 2

    verdicts = [Verdict(0, "made up", ["close_loop"]) for _ in range(2)]
    for verdict, call in zip(verdicts, (raising, leaving), strict=True):
        answer(verdict, tmp_path / "out", call)
    assert verdicts[0].faults == ["raised KeyError: 'x'"]
    assert [line.split(":")[0] for line in verdicts[1].faults] == ["left behind", "temporary files"]


def test_a_case_that_ends_its_process_is_found_and_ends_no_other(
    material: Material, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def deadly(number: int, *_: object, **__: object) -> Verdict:
        if number == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        return Verdict(number, "made up", ["close_loop"], 2)

    monkeypatch.setattr(workers, "run_case", deadly)
    verdicts = {v.number: v.faults for v in workers.run_cases(range(5), 1, material, tmp_path, 2)}
    assert verdicts == {0: [], 1: [], 2: ["its process ended: SIGKILL"], 3: [], 4: []}


def test_every_kind_of_case_can_be_drawn(material: Material, tmp_path: Path) -> None:
    for number, (maker, _) in enumerate(MAKERS):
        folder = tmp_path / str(number)
        folder.mkdir()
        what, command = maker(material, folder, random.Random(number))
        assert what
        assert len(command) > 1


@pytest.mark.parametrize(
    "text", ["[" * 200_000, "- " * 200_000, "a: 2001-99-99", "a: !!timestamp x", "9" * 6000, "a: ["]
)
def test_yaml_that_breaks_its_library_is_an_error_of_one_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"not YAML|nested too deep") as caught:
        parse_yaml(text)
    assert "\n" not in str(caught.value)
