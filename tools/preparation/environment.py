"""The virtual environment: made from pinned wheels, repaired where the ROS wheels need it, described in .rig/env.sh."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from preparation import ros, stamps
from preparation.checkout import Checkout
from preparation.errors import SetupError
from preparation.progress import step

# The interpreter's own name (python3.11): after a system upgrade python3 would be another version. Resolved at once:
# it may be the environment's own, which goes when the checkout has moved.
_INTERPRETER = Path(sys.executable).resolve()
_STAMP = "environment"
_DEV_STAMP = "environment-dev"
# Raise it when the way the environment is made changes, so that existing ones are brought up to date.
_RECIPE = "2"
_IMPORTS = (
    *(
        "rclpy.action",
        "rclpy.experimental",
        "sensor_msgs.msg",
        "geometry_msgs.msg",
        "diagnostic_msgs.msg",
        "std_srvs.srv",
    ),
    *(
        "scipy.signal",
        "scipy.optimize",
        "scipy.stats",
        "numba",
        "matplotlib.pyplot",
        "rosbags.rosbag2",
        "serial",
        "yaml",
    ),
    *("cobs.cobs", "jinja2", "rich.progress", "filterpy.kalman", "vqf"),
)


def is_ready(checkout: Checkout, found: ros.Ros, dev: bool) -> bool:
    """Whether the environment is complete and made from today's requirements."""
    if not os.access(checkout.python, os.X_OK):
        return False
    wanted = _digests(checkout, found)
    return all(stamps.read(checkout.stamps, name) == wanted[name] for name in _names(dev))


def bring_up_to_date(checkout: Checkout, found: ros.Ros, dev: bool) -> None:
    """Make the environment, or move an existing one to today's requirements."""
    wanted = _digests(checkout, found)
    former = stamps.read(checkout.stamps, _STAMP) if os.access(checkout.python, os.X_OK) else ""
    if former != wanted[_STAMP]:
        stamps.remove(checkout.stamps, _STAMP)
        stamps.remove(checkout.stamps, _DEV_STAMP)
        if not former:  # never finished: an interrupted pip leaves anything
            _create(checkout, found)
        pins = "jazzy.txt" if found.prefix else "runtime.txt"
        _install(checkout, found, pins, "environment")
        if not found.prefix:
            repair_wheels(checkout)
        write_description(checkout, found)
        _verify(checkout)
        stamps.write(checkout.stamps, _STAMP, wanted[_STAMP])
    if dev and stamps.read(checkout.stamps, _DEV_STAMP) != wanted[_DEV_STAMP]:
        stamps.remove(checkout.stamps, _DEV_STAMP)
        _install(checkout, found, "dev.txt", "test tools")
        stamps.write(checkout.stamps, _DEV_STAMP, wanted[_DEV_STAMP])


def _names(dev: bool) -> tuple[str, ...]:
    return (_STAMP, _DEV_STAMP) if dev else (_STAMP,)


def _digests(checkout: Checkout, found: ros.Ros) -> dict[str, str]:
    """The stamps of an environment that is up to date."""
    runtime = checkout.requirements / ("jazzy.txt" if found.prefix else "runtime.txt")
    place = (_RECIPE, str(checkout.root), found.name)
    return {
        _STAMP: stamps.digest_files([runtime], *place),
        _DEV_STAMP: stamps.digest_files([runtime, checkout.requirements / "dev.txt"], *place),
    }


def _create(checkout: Checkout, found: ros.Ros) -> None:
    """Make an empty virtual environment."""
    shutil.rmtree(checkout.env, ignore_errors=True)
    options = ["--system-site-packages"] if found.prefix else []
    with step(f"virtual environment of {_INTERPRETER}"):
        result = subprocess.run(
            [_INTERPRETER, "-m", "venv", *options, str(checkout.env)],
            env=_clean_environment(),
            capture_output=True,
            text=True,
            check=False,
        )
    if result.returncode != 0:
        raise SetupError(f"making a virtual environment failed: {_last_line(result.stdout + result.stderr)}")


def _install(checkout: Checkout, found: ros.Ros, pins: str, name: str) -> None:
    """Install a file of pins, without what an apt Jazzy's system already has."""
    file = checkout.requirements / pins
    if found.prefix:
        file = _write_lacking(checkout, found.prefix, file)
    lines = file.read_text(encoding="utf-8").splitlines()
    count = len({line.split("==")[0] for line in lines if not line.startswith("#")})
    if not count:
        return
    checkout.logs.mkdir(parents=True, exist_ok=True)
    log = checkout.logs / f"pip-{file.stem}.log"
    command = [checkout.python, "-m", "pip", "install", "--no-deps", "--require-hashes", "--no-compile", "--no-input"]
    command += ["--disable-pip-version-check", "--progress-bar", "off", "-r", file]
    with step(f"{name}: {count} packages") as update:
        code = _run_logged([str(part) for part in command], log, update)
    if code != 0:
        errors = [line for line in log.read_text(encoding="utf-8").splitlines() if line.startswith("ERROR")]
        raise SetupError(f"pip failed ({(errors or ['no message'])[-1]}); its output is in {log}")


def _run_logged(command: list[str], log: Path, show: Callable[[str], None]) -> int:
    """Run pip with its output in a file, and show how far it is."""
    collected = 0
    with (
        log.open("w", encoding="utf-8") as out,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=_clean_environment()
        ) as pip,
    ):
        for line in pip.stdout or ():
            out.write(line)
            collected += line.startswith("Collecting ")
            show("unpacking" if line.startswith("Installing") else f"{collected} fetched")
    return pip.returncode


def _write_lacking(checkout: Checkout, prefix: Path, pins: Path) -> Path:
    """Write the pins that neither the system nor Jazzy has; their versions there are the ones Jazzy was built with."""
    code = "import importlib.metadata as m; print('\\n'.join(d.metadata['Name'] or '' for d in m.distributions()))"
    environment = _clean_environment() | {"PYTHONPATH": ros.sourced(prefix).get("PYTHONPATH", "")}
    listed = subprocess.run(
        [checkout.python, "-c", code], env=environment, capture_output=True, text=True, check=True
    ).stdout
    present = {_normal(name) for name in listed.splitlines()}
    present |= {name for name in ("cmake", "ninja") if shutil.which(name)}
    lines = pins.read_text(encoding="utf-8").splitlines(keepends=True)
    lacking = [line for line in lines if _normal(re.split(r"[=# ]", line)[0]) not in present]
    file = checkout.rig / f"lacking-{pins.name}"
    file.write_text("".join(lacking), encoding="utf-8")
    return file


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def repair_wheels(checkout: Checkout) -> None:
    """Put this machine's paths where the ROS wheels' CMake exports carry those of their build machine."""
    code = "import sysconfig, numpy; print(sysconfig.get_paths()['include']); print(numpy.get_include())"
    environment = _clean_environment() | {"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    answer = subprocess.run([checkout.python, "-c", code], env=environment, capture_output=True, text=True, check=True)
    include, numpy_include = answer.stdout.splitlines()
    for file in checkout.env.glob("share/*/cmake/*.cmake"):
        text = file.read_text(encoding="utf-8")
        repaired = re.sub(r"/opt/python/cp\d+-cp\d+/lib/[^;\"]*/numpy/_?core/include", numpy_include, text)
        repaired = re.sub(r"/opt/python/cp\d+-cp\d+/include/python3\.\d+", include, repaired)
        if repaired != text:
            new = file.with_suffix(".new")
            new.write_text(repaired, encoding="utf-8")
            new.replace(file)


def write_description(checkout: Checkout, found: ros.Ros) -> None:
    """Write .rig/env.sh, which tools/activate.sh loads: the environment without the packages of this workspace."""
    lines = ["# Made by tools/prepare.py."]
    if found.prefix:
        added = ros.sourced(found.prefix)
        lines.append('if [[ "${ROS_DISTRO:-}" != jazzy ]]; then')
        for name, value in added.items():
            former = f"${{{name}:+:${name}}}" if name.isupper() and ("PATH" in name) else ""
            lines.append(f"    export {name}={shlex.quote(value)}{former}")
        lines.append("fi")
    else:
        # Remains of a ROS that was sourced in the user's shell would mix two distributions.
        lines.append('if [[ -n "${ROS_DISTRO:-}" ]]; then unset PYTHONPATH AMENT_PREFIX_PATH CMAKE_PREFIX_PATH; fi')
        lines.append("export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3 _ROS_WHEELS_BOOTSTRAP_COMPLETE=1")
        site = next(checkout.env.glob("lib/python3*/site-packages"))
        libraries = [str(checkout.env / "lib"), *map(str, sorted(site.glob("ros_*.libs")))]
        env = shlex.quote(str(checkout.env))
        for name, value in (
            ("LD_LIBRARY_PATH", shlex.quote(":".join(libraries))),
            ("AMENT_PREFIX_PATH", env),
            ("CMAKE_PREFIX_PATH", env),
        ):
            lines.append(f"export {name}={value}${{{name}:+:${name}}}")
    env = shlex.quote(str(checkout.env))
    lines += [f"export VIRTUAL_ENV={env}", f"export PATH={env}/bin:$PATH", "unset PYTHONHOME"]
    new = checkout.rig / "env.sh.new"
    new.write_text("\n".join(lines) + "\n", encoding="utf-8")
    new.replace(checkout.rig / "env.sh")
    if not found.prefix:
        # colcon asks each prefix for one; the wheels bring none, and need none.
        (checkout.env / "local_setup.sh").write_text("# Nothing to do: see tools/activate.sh.\n", encoding="utf-8")


def _verify(checkout: Checkout) -> None:
    """Import what everything rests on: a broken environment is found here, and the first node starts warm."""
    script = '. "$0/tools/activate.sh" && exec python -c "$1"'
    environment = _clean_environment() | {"ROOT": str(checkout.root), "GSENSE_UNDERLAY_ONLY": "1"}
    command = ["bash", "-c", script, str(checkout.root), f"import {', '.join(_IMPORTS)}"]
    with step("first imports"):
        result = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SetupError(f"the environment does not work ({_last_line(result.stderr)}): rm -r .rig and try again")


def _clean_environment() -> dict[str, str]:
    """The environment without what would lead pip or Python elsewhere."""
    dropped = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "PIP_TARGET", "PIP_PREFIX", "PIP_REQUIRE_VIRTUALENV")
    return {name: value for name, value in os.environ.items() if name not in dropped} | {"PIP_USER": "0"}


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1] if lines else "no message"
