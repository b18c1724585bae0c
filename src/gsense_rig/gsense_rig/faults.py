"""`ros2 run gsense_rig faults`: each fault in a simulated run, how soon it is found and where the carriage ends."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_rig.fault_trials.cases import CASES
from gsense_rig.fault_trials.table import failures, header, line
from gsense_rig.fault_trials.trial import try_case

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the fault table; 0 where every bound is kept, 1 where not."""
    parser = ArgumentParser(prog="faults", description=__doc__)
    parser.add_argument("--centre", action="store_true", help="inject at the centre alone, not all over the cycle")
    parser.add_argument(
        "--only", default="", metavar="WORD", help="only faults whose name has this word (default: all)"
    )
    parser.add_argument("--seed", type=int, default=1, help="draws the rail (default 1)")
    options = parser.parse_args(arguments)
    cases = [case for case in CASES if options.only in case.name]
    if not cases:
        print(f"faults: no fault has '{options.only}' in its name", file=sys.stderr)
        return 2
    print(header(), flush=True)
    rows = []
    for case in cases:
        rows.append(try_case(case, anywhere=not options.centre, seed=options.seed))
        print(line(rows[-1]), flush=True)
    broken = [text for row in rows for text in failures(row)]
    print()
    print("\n".join(broken) if broken else f"{len(rows)} faults: every bound is kept")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
