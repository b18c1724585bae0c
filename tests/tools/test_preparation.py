"""The set-up's decisions, without network and without an environment."""

from __future__ import annotations

import subprocess
import sys
import textwrap
import venv
from pathlib import Path

import pytest

from preparation import environment, main, ros, stamps, system, workspace
from preparation.checkout import Checkout
from preparation.errors import SetupError

ROOT = Path(__file__).resolve().parents[2]
WHEELS = ros.Ros(None)


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    """A checkout with one Python package and pins, nothing prepared."""
    package = tmp_path / "src" / "alpha"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package><name>alpha</name><export><build_type>ament_python</build_type></export></package>"
    )
    (package / "alpha.py").write_text("x = 1\n")
    requirements = tmp_path / "tools" / "requirements"
    requirements.mkdir(parents=True)
    for name in ("runtime.txt", "jazzy.txt", "dev.txt"):
        (requirements / name).write_text("numpy==1\nros-rclpy==7\nPyYAML==6 ; python_version == '3.12'\n")
    return Checkout(tmp_path)


def pretend_environment(checkout: Checkout) -> None:
    checkout.python.parent.mkdir(parents=True)
    checkout.python.symlink_to(sys.executable)
    for name, text in environment._digests(checkout, WHEELS).items():
        stamps.write(checkout.stamps, name, text)


def pretend_built(checkout: Checkout) -> None:
    for package in workspace.packages(checkout):
        manifest = workspace._installed(checkout, package)
        manifest.parent.mkdir(parents=True, exist_ok=True)
        manifest.touch()
        stamps.write(checkout.stamps, package.stamp, package.fingerprint)


class TestEnvironment:
    def test_without_stamps_is_not_ready(self, checkout: Checkout) -> None:
        assert not environment.is_ready(checkout, WHEELS, dev=False)

    def test_with_stamps_is_ready(self, checkout: Checkout) -> None:
        pretend_environment(checkout)
        assert environment.is_ready(checkout, WHEELS, dev=True)

    def test_changed_pins_are_seen(self, checkout: Checkout) -> None:
        pretend_environment(checkout)
        (checkout.requirements / "dev.txt").write_text("pytest==1\n")
        assert environment.is_ready(checkout, WHEELS, dev=False)
        assert not environment.is_ready(checkout, WHEELS, dev=True)
        (checkout.requirements / "runtime.txt").write_text("numpy==2\n")
        assert not environment.is_ready(checkout, WHEELS, dev=False)

    def test_lost_interpreter_is_seen(self, checkout: Checkout) -> None:
        pretend_environment(checkout)
        checkout.python.unlink()
        checkout.python.symlink_to("/nowhere/python3.9")
        assert not environment.is_ready(checkout, WHEELS, dev=False)

    def test_another_ros_is_seen(self, checkout: Checkout) -> None:
        pretend_environment(checkout)
        assert not environment.is_ready(checkout, ros.Ros(Path("/opt/ros/jazzy")), dev=False)

    def test_wheels_get_this_machines_paths(self, checkout: Checkout, monkeypatch: pytest.MonkeyPatch) -> None:
        export = checkout.env / "share" / "std_msgs" / "cmake" / "export.cmake"
        export.parent.mkdir(parents=True)
        old = "/opt/python/cp311-cp311/include/python3.11;/opt/python/cp311-cp311/lib/python3.11/site-packages"
        export.write_text(f'INTERFACE_INCLUDE_DIRECTORIES "{old}/numpy/_core/include"\n')
        answer = subprocess.CompletedProcess([], 0, stdout="/usr/include/python3.11\n/env/numpy/_core/include\n")
        monkeypatch.setattr(subprocess, "run", lambda *_, **__: answer)
        environment.repair_wheels(checkout)
        assert export.read_text() == (
            'INTERFACE_INCLUDE_DIRECTORIES "/usr/include/python3.11;/env/numpy/_core/include"\n'
        )


class TestWorkspace:
    def test_new_package_is_built(self, checkout: Checkout) -> None:
        assert [package.name for package in workspace.to_build(checkout, "stale")] == ["alpha"]
        assert [package.name for package in workspace.to_build(checkout, "missing")] == ["alpha"]

    def test_unchanged_package_is_not(self, checkout: Checkout) -> None:
        pretend_built(checkout)
        (checkout.root / "src" / "alpha" / "alpha.py").touch()  # another time, the same content
        (checkout.root / "src" / "alpha" / "__pycache__").mkdir()
        (checkout.root / "src" / "alpha" / "__pycache__" / "alpha.pyc").touch()
        assert workspace.to_build(checkout, "stale") == []

    @pytest.mark.parametrize("change", ["edit", "add", "rename", "remove"])
    def test_changed_package_is_stale_but_not_missing(self, checkout: Checkout, change: str) -> None:
        pretend_built(checkout)
        source = checkout.root / "src" / "alpha" / "alpha.py"
        if change == "edit":
            source.write_text("x = 2\n")
        elif change == "add":
            source.with_name("beta.py").touch()
        elif change == "rename":
            source.rename(source.with_name("beta.py"))
        else:
            source.unlink()
        assert [package.name for package in workspace.to_build(checkout, "stale")] == ["alpha"]
        assert workspace.to_build(checkout, "missing") == []

    def test_build_that_was_killed_is_redone(self, checkout: Checkout) -> None:
        pretend_built(checkout)
        package = workspace.packages(checkout)[0]
        workspace._clear(checkout, package)  # what a build does first
        assert workspace.to_build(checkout, "missing") == [package]

    def test_removed_package_is_noticed(self, checkout: Checkout) -> None:
        pretend_built(checkout)
        (checkout.root / "src" / "alpha" / "package.xml").unlink()
        assert workspace._gone(checkout) == ["alpha"]

    def test_broken_manifest_is_named(self, checkout: Checkout) -> None:
        manifest = checkout.root / "src" / "alpha" / "package.xml"
        manifest.write_text("<package>")
        with pytest.raises(SetupError, match=str(manifest)):
            workspace.packages(checkout)


class TestPlace:
    def test_moved_checkout_is_made_anew(self, checkout: Checkout) -> None:
        pretend_environment(checkout)
        pretend_built(checkout)
        stamps.write(checkout.stamps, "place", "/somewhere/else\nwheels\n")
        main.forget_other_place(checkout, WHEELS)
        assert not checkout.env.exists()
        assert not (checkout.root / "install").exists()
        assert (checkout.rig / "COLCON_IGNORE").exists()

    def test_same_place_keeps_everything(self, checkout: Checkout) -> None:
        main.forget_other_place(checkout, WHEELS)
        pretend_environment(checkout)
        main.forget_other_place(checkout, WHEELS)
        assert environment.is_ready(checkout, WHEELS, dev=True)


class TestRos:
    @pytest.fixture
    def jazzy(self, tmp_path: Path) -> Path:
        """A prefix that looks like an apt Jazzy to whoever sources it."""
        prefix = tmp_path / "jazzy"
        (prefix / "share" / "rclpy").mkdir(parents=True)
        (prefix / "setup.bash").write_text(
            textwrap.dedent(f"""\
            export ROS_DISTRO=jazzy ROS_VERSION=2
            export PATH="{prefix}/bin:$PATH"
            export PYTHONPATH="{prefix}/lib/python3.12/site-packages${{PYTHONPATH:+:$PYTHONPATH}}"
            export AMENT_PREFIX_PATH="{prefix}"
            """)
        )
        return prefix

    def test_named_prefix_is_used(self, jazzy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("GSENSE_ROS_PREFIX", str(jazzy))
        assert ros.find() == ros.Ros(jazzy)

    def test_sourced_underlay_is_found_below_an_overlay(self, jazzy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.delenv("GSENSE_ROS_PREFIX", raising=False)
        monkeypatch.setenv("ROS_DISTRO", "jazzy")
        monkeypatch.setenv("AMENT_PREFIX_PATH", f"/home/someone/ws/install/thing:{jazzy}")
        assert ros.find() == ros.Ros(jazzy)

    def test_empty_prefix_asks_for_wheels(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("GSENSE_ROS_PREFIX", "")
        assert ros.find() == WHEELS

    def test_wrong_prefix_is_refused(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("GSENSE_ROS_PREFIX", str(tmp_path))
        with pytest.raises(SetupError, match=r"has no setup\.bash"):
            ros.find()

    def test_sourcing_gives_what_it_adds(self, jazzy: Path) -> None:
        added = ros.sourced(jazzy)
        assert added["PATH"] == f"{jazzy}/bin"
        assert added["PYTHONPATH"] == f"{jazzy}/lib/python3.12/site-packages"
        assert added["ROS_DISTRO"] == "jazzy"

    def test_description_loads_an_installed_jazzy_that_is_not_sourced(self, checkout: Checkout, jazzy: Path) -> None:
        checkout.rig.mkdir()
        environment.write_description(checkout, ros.Ros(jazzy))
        script = '. "$0"; echo "$ROS_DISTRO $AMENT_PREFIX_PATH"; echo "$PATH"'
        shown = subprocess.run(
            ["/bin/bash", "-c", script, str(checkout.rig / "env.sh")],
            env={"PATH": "/usr/bin:/bin", "PYTHONPATH": "/mine"},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()
        assert shown[0] == f"jazzy {jazzy}"
        assert shown[1] == f"{checkout.env}/bin:{jazzy}/bin:/usr/bin:/bin"

    def test_only_what_the_system_lacks_is_installed(self, checkout: Checkout, jazzy: Path) -> None:
        """The pretended environment is this interpreter, which has numpy; a distribution in Jazzy's path counts too."""
        checkout.python.parent.mkdir(parents=True)
        checkout.python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
        checkout.python.chmod(0o755)
        info = jazzy / "lib/python3.12/site-packages/rclpy_thing-1.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: rclpy_thing\nVersion: 1\n")
        pins = checkout.requirements / "jazzy.txt"
        pins.write_text("numpy==1\nrclpy-thing==3\nno-such-package==4 ; python_version == '3.12'\n")
        lacking = environment._write_lacking(checkout, jazzy, pins)
        assert lacking.read_text() == "no-such-package==4 ; python_version == '3.12'\n"


class TestSystem:
    def test_missing_packages_are_named_in_one_line(self, checkout: Checkout, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(system, "missing_for_build", lambda: ["python3-venv", "g++"])
        monkeypatch.setattr(system.os, "geteuid", lambda: 1000)
        with pytest.raises(
            SetupError, match=r"^gsense needs python3-venv, g\+\+: sudo apt install python3-venv g\+\+$"
        ):
            system.require(checkout)

    def test_headers_are_found_as_the_compiler_finds_them(self) -> None:
        assert system.has_header("stdio.h")
        assert not system.has_header("no_such_header_anywhere.h")


def test_an_environment_replaces_the_one_it_is_made_by(checkout: Checkout) -> None:
    """A moved checkout: its own Python starts the set-up, which removes that environment and makes it anew."""
    venv.create(checkout.env, symlinks=True, with_pip=False)
    code = "import shutil, sys; sys.path.insert(0, sys.argv[1])\n"
    code += "from pathlib import Path\nfrom preparation import environment, ros\n"
    code += "from preparation.checkout import Checkout\n"
    code += "checkout = Checkout(Path(sys.argv[2])); shutil.rmtree(checkout.env)\n"
    code += "environment._create(checkout, ros.Ros(None))\n"
    command = [checkout.python, "-E", "-s", "-S", "-c", code, str(ROOT / "tools"), str(checkout.root)]
    subprocess.run(command, check=True)
    assert subprocess.run([checkout.python, "-c", ""], check=False).returncode == 0


def test_pins_are_exact_and_cover_every_python() -> None:
    for name in ("runtime.txt", "dev.txt", "jazzy.txt"):
        lines = [line for line in (ROOT / "tools/requirements" / name).read_text().splitlines() if line[0] != "#"]
        assert lines
        assert all("==" in line.split(" ; ")[0] for line in lines)
    numpy = [line for line in (ROOT / "tools/requirements/runtime.txt").read_text().splitlines() if "numpy==" in line]
    assert all(any(f'"3.{minor}"' in line for line in numpy) for minor in (10, 11, 12, 13))


def test_only_one_set_up_at_a_time(tmp_path: Path) -> None:
    code = f"import sys; sys.path.insert(0, {str(ROOT / 'tools')!r})\n"
    code += "from pathlib import Path; from preparation import stamps\n"
    code += "with stamps.lock(Path(sys.argv[1])): print('held', flush=True)\n"
    with stamps.lock(tmp_path):
        other = subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert other.stderr is not None
        assert b"waiting" in other.stderr.readline()
        assert other.poll() is None
    out, _ = other.communicate(timeout=60)
    assert out == b"held\n"
