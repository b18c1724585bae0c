"""The demonstration's command line."""

from __future__ import annotations

import argparse
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gsense_driver.user_input.arguments import ArgumentParser

LARGEST_SEED = 2**31 - 2


@dataclass(frozen=True)
class Options:
    """What the user asked for."""

    out: Path
    seconds: float
    """Length of the live run, s."""
    seed: int


def parse(arguments: Sequence[str] | None = None) -> Options:
    """Reads the command line; exits with 2 and one line of reason where it cannot be used."""
    parser = ArgumentParser(
        prog="demo",
        description="The whole loop on the simulated rig: live graph, bag, campaign, closed loop, report.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), metavar="DIR", help="folder for all files (default: out/demo)"
    )
    parser.add_argument(
        "--seconds", type=_seconds, default=20.0, metavar="S", help="length of the live run, 2 to 600 (default: 20)"
    )
    parser.add_argument(
        "--seed", type=_seed, metavar="N", help="repeats a demo: its unit, effect and noise (default: drawn)"
    )
    given = parser.parse_args(arguments)
    seed = random.SystemRandom().randrange(1, 1_000_000) if given.seed is None else given.seed
    return Options(given.out, given.seconds, seed)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 2.0 <= value <= 600.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 2 to 600")
    return value


def _seed(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = -1
    if not 0 <= value <= LARGEST_SEED:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from 0 to {LARGEST_SEED}")
    return value
