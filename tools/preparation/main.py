"""Command line of the set-up."""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from preparation import environment, kernels, ros, stamps, system, workspace
from preparation.checkout import Checkout
from preparation.errors import SetupError
from preparation.progress import say


def main(arguments: list[str]) -> int:
    """Bring environment and workspace up to date. Returns the exit code: 0, or 2 after one line on stderr."""
    parser = argparse.ArgumentParser(prog="prepare.py", description=__doc__)
    parser.add_argument("--dev", action="store_true", help="with what tests and linters need")
    parser.add_argument("--build", choices=("stale", "missing"), default="stale")
    parser.add_argument("--verbose", action="store_true", help="say it where nothing is to do")
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[2])
    options = parser.parse_args(arguments)
    checkout = Checkout(options.root)
    try:
        if up_to_date(checkout, options.dev, options.build):
            if options.verbose:
                say("everything is up to date")
            return 0
        with stamps.lock(checkout.rig):
            prepare(checkout, options.dev, options.build)
    except SetupError as error:
        say(str(error))
        return 2
    except KeyboardInterrupt:
        say("interrupted; the next ./rig goes on from here")
        return 130
    return 0


def up_to_date(checkout: Checkout, dev: bool, build: str) -> bool:
    """Whether nothing is to do."""
    if not environment.is_ready(checkout, ros.find(), dev) or workspace.to_build(checkout, build):
        return False
    return build == "missing" or kernels.up_to_date(checkout)


def prepare(checkout: Checkout, dev: bool, build: str) -> None:
    """Do what is to do (with the lock held: another process may just have done it)."""
    found = ros.find()
    forget_other_place(checkout, found)
    if not environment.is_ready(checkout, found, dev):
        system.require(checkout)
        if dev:
            system.offer_for_tests(checkout)
        environment.bring_up_to_date(checkout, found, dev)
    packages = workspace.to_build(checkout, build)
    if packages:
        workspace.build(checkout, packages)
    if build == "stale" and not kernels.up_to_date(checkout):
        kernels.compile_all(checkout)


def forget_other_place(checkout: Checkout, found: ros.Ros) -> None:
    """Remove what was prepared in another folder or for another ROS: paths are baked into all of it."""
    place = f"{checkout.root}\n{found.name}\n"
    former = stamps.read(checkout.stamps, "place")
    if former == place:
        return
    if former:
        say(f"prepared for {' with '.join(former.split())} before; making it anew")
        made = (checkout.root / name for name in ("build", "install", "log"))
        for folder in (checkout.stamps, checkout.env, checkout.rig / "cache", *made):
            shutil.rmtree(folder, ignore_errors=True)
    checkout.rig.mkdir(exist_ok=True)
    (checkout.rig / "COLCON_IGNORE").touch()
    stamps.write(checkout.stamps, "place", place)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
