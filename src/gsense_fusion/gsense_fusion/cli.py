"""What the commands over bags share: their arguments, roles, and errors of one line."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from gsense_fusion.bags import BagError
from gsense_fusion.campaigns import campaign_bags
from gsense_fusion.identification.types import IdentificationError, Role

LONGEST_LINE = 1000
"""Characters of an error."""


def add_bag_arguments(parser: argparse.ArgumentParser) -> None:
    """--campaign, --fit and --held-out."""
    parser.add_argument(
        "--campaign",
        nargs="+",
        type=Path,
        default=[],
        metavar="DIR",
        help="folders that campaign or simulate wrote: their bags, by the roles in index.yaml",
    )
    parser.add_argument("--fit", nargs="+", type=Path, default=[], metavar="BAG", help="bags to fit (one bag, one run)")
    parser.add_argument(
        "--held-out",
        nargs="+",
        type=Path,
        default=[],
        metavar="BAG",
        help="bags to judge by; without: each run in turn",
    )


def named_roles(arguments: argparse.Namespace) -> list[tuple[Path, Role]]:
    """The bags of --campaign, --fit and --held-out with their roles.

    Raises:
        IdentificationError: a bag is named twice, or a folder is no campaign; one line.
    """
    indexed = [bag for folder in arguments.campaign for bag in campaign_bags(folder)]
    fit, held_out = ([p for p, role in indexed if role is wanted] for wanted in (Role.FIT, Role.HELD_OUT))
    return roles([*fit, *arguments.fit], [*held_out, *arguments.held_out])


def roles(fit: Sequence[Path], held_out: Sequence[Path]) -> list[tuple[Path, Role]]:
    """Bags with their roles.

    Raises:
        IdentificationError: a bag is named twice.
    """
    both = {p.resolve() for p in fit} & {p.resolve() for p in held_out}
    if both:
        raise IdentificationError(f"{min(both)}: named under --fit and --held-out; a run that is fitted cannot judge")
    everything = [*fit, *held_out]
    twice = [p for p in set(everything) if everything.count(p) > 1]
    if twice:
        raise IdentificationError(f"{min(twice)}: named twice; name each bag once")
    return [(path, Role.FIT) for path in fit] + [(path, Role.HELD_OUT) for path in held_out]


def guarded(command: str, first: Path, out: Path, body: Callable[[], None]) -> int:
    """Run a command; unusable input is one line on stderr.

    Args:
        command: its name, for the line.
        first: the first bag, named where the analysis itself broke down.
        out: the folder that is written.
        body: the work.

    Returns:
        Exit code 0, or 2.
    """
    try:
        body()
    except (BagError, IdentificationError) as error:
        return fail(command, str(error))
    except (ArithmeticError, ValueError, LookupError) as error:
        if os.environ.get("GSENSE_DEBUG"):
            raise
        what = f"{type(error).__name__}: {error}"
        return fail(command, f"{first}: the analysis broke down ({what}); GSENSE_DEBUG=1 shows where: please report it")
    except OSError as error:
        return fail(command, f"{error.filename or out}: {error.strerror or error}; nothing half-written is left")
    return 0


def fail(command: str, message: str) -> int:
    """One line on stderr; the exit code of unusable input."""
    sys.stderr.write(f"{command}: {one_line(message)}\n")
    return 2


def one_line(message: str) -> str:
    """Without line breaks, and of a bearable length: a file may hold names of a thousand letters."""
    text = " ".join(message.split())
    return text if len(text) <= LONGEST_LINE else f"{text[: LONGEST_LINE - 100]} ... {text[-95:]}"
