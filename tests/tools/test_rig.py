"""The entry script as a user meets it: its lines for wrong input, and that nothing is done twice."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def rig(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "rig"), *arguments],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
        timeout=280,
    )


pytestmark = pytest.mark.skipif(
    not (ROOT / ".rig" / "stamps" / "environment").exists(), reason="needs an environment that ./rig made"
)


def test_help_names_every_command_of_the_contract() -> None:
    text = rig("-h").stdout
    for command in ("demo", "test", "run", "exec", "build", "shell", "bench", "study"):
        assert f"  {command}" in text or f", {command}" in text


def test_unknown_command_is_one_line_and_exit_2() -> None:
    result = rig("dance")
    assert result.returncode == 2
    assert result.stderr == "gsense: no command 'dance'; ./rig -h lists them\n"


def test_what_takes_no_arguments_ignores_none() -> None:
    result = rig("build", "gsense_rig")
    assert result.returncode == 2
    assert result.stderr == "gsense: ./rig build takes no arguments, not 'gsense_rig'\n"


def test_the_benchmarks_are_listed() -> None:
    text = rig("bench", "--help").stdout
    for script in (ROOT / "tests" / "bench").rglob("*.py"):
        assert f"  {script.stem} " in text


@pytest.mark.parametrize("command", [("study",), ("bench", "setup_time"), ("bench", "driver_stream")])
def test_a_developers_command_with_a_wrong_option_is_one_line(command: tuple[str, ...]) -> None:
    typed = f"./rig {' '.join(command)}"
    result = rig(*command, "--bogus")
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1] == (
        f"{typed}: unrecognized arguments: --bogus; {typed} --help lists what it takes"
    )
    assert "usage" not in result.stderr


def test_every_developers_command_answers_so() -> None:
    scripts = [*(ROOT / "tests" / "bench").rglob("*.py"), *(ROOT / "tests" / "study").glob("*.py")]
    own = [s.name for s in scripts if "argparse.ArgumentParser" in s.read_text(encoding="utf-8")]
    assert own == [], "tests.developer.arguments"


def test_unknown_executable_lists_what_there_is() -> None:
    result = rig("run", "gsense_driver", "nothing")
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1].startswith(
        "gsense: package 'gsense_driver' has no executable 'nothing'; it has:"
    )
    assert "bridge" in result.stderr


def test_unknown_package_lists_what_there_is() -> None:
    result = rig("run", "nothing", "bridge")
    assert result.returncode == 2
    assert "no package 'nothing'; there is: " in result.stderr
    assert "gsense_msgs" in result.stderr


def test_run_without_an_executable_says_how() -> None:
    assert rig("run", "gsense_driver").stderr == "gsense: usage: ./rig run PKG EXE [ARGS]\n"


def test_exec_passes_exit_code_arguments_and_folder(tmp_path: Path) -> None:
    result = subprocess.run(
        [str(ROOT / "rig"), "exec", "sh", "-c", 'pwd; echo "$1"; exit 7', "sh", "two words"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 7
    assert result.stdout.splitlines() == [str(tmp_path), "two words"]


def test_environment_is_the_checkouts_and_stays_on_this_machine() -> None:
    shown = rig("exec", "env", ROS_DOMAIN_ID="57", ROS_AUTOMATIC_DISCOVERY_RANGE="").stdout
    values = dict(line.split("=", 1) for line in shown.splitlines() if "=" in line)
    assert values["ROS_DOMAIN_ID"] == "57"
    assert values["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert values["PATH"].startswith(f"{ROOT}/.rig/env/bin:")
    assert f"{ROOT}/install/gsense_msgs" in values["AMENT_PREFIX_PATH"].split(":")
    for name in ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "ROS_LOG_DIR"):
        assert values[name].startswith(f"{ROOT}/.rig/")


def test_works_with_a_home_that_does_not_exist(tmp_path: Path) -> None:
    code = "import matplotlib.pyplot, rclpy; rclpy.init(); rclpy.create_node('probe'); rclpy.shutdown(); print('ok')"
    result = rig("exec", "python", "-c", code, HOME=str(tmp_path / "none"))
    assert (result.stdout, result.returncode) == ("ok\n", 0), result.stderr
    assert not (tmp_path / "none").exists()


def test_messages_of_the_contract_import() -> None:
    code = (
        "from gsense_msgs.msg import LinkStatus, RigState, Topics; from gsense_msgs.action import Move, Sinusoid;"
        "print(RigState.FAULT, RigState.RED, RigState.NONE, Move.Goal.TRIANGLE, Topics.RIG_POSE,"
        " len(RigState().switches), *LinkStatus.get_fields_and_field_types())"
    )
    shown = rig("exec", "python", "-c", code).stdout.split()
    assert shown[:6] == ["5", "3", "0", "2", "rig/pose", "4"]
    assert shown[6:12] == ["header", "received", "lost", "corrupt", "duplicate", "reordered"]
    assert shown[12:] == ["restarts", "rate_hz", "clock_offset_s", "clock_skew_ppm", "uptime_s", "unit_id"]


def test_signal_reaches_the_command() -> None:
    process = subprocess.Popen(
        [str(ROOT / "rig"), "exec", "sh", "-c", "echo $$; exec sleep 60"], stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    with process.stdout:
        assert int(process.stdout.readline()) == process.pid
        process.terminate()
        assert process.wait(timeout=60) == -15


def test_scripts_start_with_the_environments_python() -> None:
    scripts = [file for file in ROOT.glob("install/gsense_*/lib/gsense_*/*") if file.read_bytes()[:2] == b"#!"]
    assert scripts
    for script in scripts:
        assert script.read_text().splitlines()[0] == f"#!{ROOT}/.rig/env/bin/python"


def test_a_second_run_does_nothing_and_is_quick() -> None:
    rig("exec", "true")
    times = []
    for _ in range(3):
        start = time.monotonic()
        result = rig("exec", "true")
        times.append(time.monotonic() - start)
        assert (result.returncode, result.stderr) == (0, "")
    assert min(times) < 2.0  # 0.1 s on an idle machine
