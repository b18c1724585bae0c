"""Every command in the documents works, or stands in a list that says why no test runs it."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.docs.checks import EXECUTABLES, check, run_by
from tests.docs.documents import DOCUMENTS, ROOT, commands

ALL = [command for document in DOCUMENTS for command in commands(document)]


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_every_command_exists_as_it_is_written(document: Path) -> None:
    wrong = {str(command): check(command.text) for command in ALL if command.document == document}
    assert {command: reason for command, reason in wrong.items() if reason} == {}


def test_the_documents_have_commands() -> None:
    assert len(ALL) > 80


@pytest.mark.parametrize("name", sorted(EXECUTABLES))
def test_every_executable_is_run_by_a_test(name: str) -> None:
    assert run_by(name), f"no test runs {name}"


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("./rig run gsense_rig nothing", "there is no gsense_rig nothing"),
        ("./rig run gsense_fusion close_loop --fit a --outt b", "outt"),
        ("./rig run gsense_fusion fusion --ros-args -p filtre:=vqf", "filtre"),
        ("./rig bench nothing", "no benchmark"),
        ("./rig test tests/nothing", "no tests/nothing"),
        ("./rig exec python -m pytest tests/docs", "./rig test"),
        ("ros2 launch gsense_rig rig.launch.xml prot:=x", "prot"),
        ("ros2 action send_goal /rig/move gsense_msgs/action/Move '{shap: 1}'", "shap"),
        ("ros2 service call /rig/fly std_srvs/srv/Trigger", "/rig/fly"),
        ("ros2 param set /rig colour red", "colour"),
        ("make me a rig", "nothing is known"),
    ],
)
def test_a_wrong_command_is_seen(command: str, reason: str) -> None:
    assert reason in check(command)
