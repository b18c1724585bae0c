"""`close_loop --manifest`: one broken session never stops the rest, nothing done is lost, nothing is done twice."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import distributed
import pytest
import yaml
from tests.fusion.rail_run import rail_run

from gsense_fusion.close_loop import main

KILLER = "import os\nos.kill(os.getpid(), 9)\n"
SLEEPER = "import pathlib, time\npathlib.Path(__file__).with_suffix('.begun').touch()\ntime.sleep(600)\n"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of four runs, and one whose second bag is broken."""
    folder = tmp_path_factory.mktemp("many")
    for number, frequency in enumerate((0.0, 3.0, 6.0, 8.0)):
        rail_run(folder / "good", number, frequency, lambda v: 2e-3 * v)
    (folder / "broken" / "run_0").mkdir(parents=True)
    (folder / "broken" / "run_0" / "run_0_0.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(40))
    (folder / "killer.py").write_text(KILLER)
    (folder / "sleeper.py").write_text(SLEEPER)
    return folder


def manifest(data: Path, *entries: object) -> str:
    path = data / "all.yaml"
    path.write_text(yaml.safe_dump({"entries": list(entries)}))
    return str(path)


def states(out: Path) -> dict[str, tuple[str, str | None]]:
    entries = json.loads((out / "summary.json").read_text())["entries"]
    return {e["name"]: (e["state"], e["reason"]) for e in entries}


def content(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir()}


BROKEN = {"campaign": "broken"}
GOOD = {"campaign": "good", "unit_id": "A7"}


@pytest.mark.slow
def test_what_is_broken_is_said_and_a_dying_process_takes_no_other_along(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    killed = {"fit": "good/run_*", "effects": "killer.py", "name": "killed"}
    given = manifest(data, BROKEN, killed, {"fit": "nowhere", "name": "gone"})
    assert main(["--manifest", given, "--out", str(out), "--jobs", "2"]) == 1
    found = states(out)
    assert [state for state, _ in found.values()] == ["failed"] * 3
    assert "broken/run_0/run_0_0.mcap" in str(found["broken"][1])
    assert found["killed"][1] == "its process died (signal 9, probably out of memory)"
    assert "nowhere: no such file" in str(found["gone"][1])
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) == 3 + 3
    assert not printed.err.strip()
    assert sorted(p.name for p in out.iterdir()) == [".lock", "summary.html", "summary.json"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--manifest", "/nowhere.yaml"], "/nowhere.yaml: No such file or directory"),
        (["--manifest", "TEXT"], "is not UTF-8"),
        (["--manifest", "GOOD", "--scheduler", "tcp://127.0.0.1:1"], "no Dask scheduler answers there"),
        (["--manifest", "GOOD", "--scheduler", "nonsense://x"], "no Dask scheduler answers there"),
    ],
)
def test_refuses_in_one_line(
    data: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.setattr("gsense_fusion.many.cluster.CONNECT_S", 0.5)
    text = data / "binary.yaml"
    text.write_bytes(b"\xff\xfe\x00")
    names = {"TEXT": str(text), "GOOD": manifest(data, GOOD)}
    out = tmp_path / "out"
    assert main([names.get(a, a) for a in arguments] + ["--out", str(out)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert words in lines[0]


def test_a_folder_that_is_in_the_way_is_not_replaced(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "precious.txt").write_text("mine")
    assert main(["--manifest", manifest(data, BROKEN), "--out", str(tmp_path)]) == 2
    assert "is in the way" in capsys.readouterr().err
    assert (tmp_path / "broken" / "precious.txt").read_text() == "mine"


def test_without_distributed_one_line_says_what_to_install(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["--manifest", manifest(data, GOOD), "--out", str(tmp_path), "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "pip install distributed" in capsys.readouterr().err


@pytest.fixture(scope="module")
def done(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which GOOD was analysed."""
    out = tmp_path_factory.mktemp("done") / "out"
    assert main(["--manifest", manifest(data, GOOD), "--out", str(out), "--jobs", "1"]) == 0
    return out


@pytest.fixture
def out(done: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(done, tmp_path / "out"))


@pytest.mark.slow
def test_done_is_kept_and_a_failure_replaces_nothing(data: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert states(out) == {"good": ("done", None)}
    report = json.loads((out / "good" / "report.json").read_text())
    assert report["unit_id"] == "A7"  # the manifest's: these bags name none
    before = content(out / "good")
    assert main(["--manifest", manifest(data, GOOD), "--out", str(out), "--jobs", "1"]) == 0
    assert states(out) == {"good": ("kept", None)}
    assert "good: kept" in capsys.readouterr().out
    assert content(out / "good") == before
    nose = manifest(data, {**GOOD, "sensor": "nose"})  # another question: what is there does not answer it
    assert main(["--manifest", nose, "--out", str(out), "--jobs", "1"]) == 1
    assert states(out)["good"][0] == "failed"
    assert content(out / "good") == before
    assert not (out / ".unfinished").exists()


@pytest.fixture
def sleeping(data: Path, out: Path) -> Iterator[subprocess.Popen[str]]:
    """The command as a process, in its own group; one session is kept, another sleeps in its effects file."""
    begun = data / "sleeper.begun"
    begun.unlink(missing_ok=True)
    sleeper = {"fit": "good/run_*", "effects": "sleeper.py", "name": "asleep"}
    command = [sys.executable, "-m", "gsense_fusion.close_loop", "--manifest", manifest(data, BROKEN, GOOD, sleeper)]
    with subprocess.Popen(
        [*command, "--out", str(out), "--jobs", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert sorted(process.stdout.readline().split(":")[0] for _ in range(2)) == ["broken", "good"]
            wait_for(begun.exists)
            yield process
        finally:
            kill_group(process.pid)


def kill_group(group: int) -> None:
    try:
        os.killpg(group, signal.SIGKILL)
    except ProcessLookupError:
        return


def wait_for(ready: object, seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not ready():  # type: ignore[operator]
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def group_is_empty(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_all_and_keeps_what_is_done(
    sleeping: subprocess.Popen[str], out: Path, number: signal.Signals
) -> None:
    if number is signal.SIGINT:
        os.killpg(sleeping.pid, number)  # as a terminal does
    else:
        sleeping.send_signal(number)
    _, err = sleeping.communicate(timeout=60)
    assert sleeping.returncode == 130
    assert err.strip() == f"close_loop: interrupted; the same command goes on in {out}"
    wait_for(lambda: group_is_empty(sleeping.pid))
    found = {name: state for name, (state, _) in states(out).items()}
    assert found == {"broken": "failed", "good": "kept", "asleep": "pending"}


@pytest.mark.slow
def test_after_a_kill_the_same_command_goes_on(
    sleeping: subprocess.Popen[str], out: Path, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    again = ["--manifest", manifest(data, GOOD), "--out", str(out), "--jobs", "1"]
    assert main(again) == 2
    assert "another close_loop works in it" in capsys.readouterr().err
    sleeping.kill()
    sleeping.wait(timeout=60)
    (out / ".unfinished" / "good").mkdir(parents=True)  # as a kill in the midst of writing leaves it
    assert main(again) == 0
    assert states(out) == {"good": ("kept", None)}
    assert not (out / ".unfinished").exists()


@pytest.mark.slow
def test_on_a_cluster(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        address = cluster.scheduler_address
        given = manifest(data, GOOD, BROKEN)
        assert main(["--manifest", given, "--out", str(out), "--scheduler", address]) == 1
        found = states(out)
        assert {name: state for name, (state, _) in found.items()} == {
            "good": "done",
            "broken": "failed",
        }
        assert main(["--manifest", manifest(data, GOOD), "--out", str(out), "--scheduler", address]) == 0
        assert states(out) == {"good": ("kept", None)}
