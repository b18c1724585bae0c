"""`demo [--out DIR] [--seconds S] [--seed N]`: the whole loop on the simulated rig, in about a minute.

The live graph with a hidden effect in the simulated board, one recorded run, a simulated campaign of the same unit, the
closed loop over both, the compensated orientation live, and at the end what was hidden beside what was found.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence

from gsense_driver.user_input.interruption import Interrupted, Interruption
from gsense_rig.demonstration.folder import FolderError, open_folder
from gsense_rig.demonstration.options import parse
from gsense_rig.demonstration.processes import DemoError, Processes

UNUSABLE = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit 0; 1 with one line where it cannot go on, 2 where its options cannot be used, 128 + n after signal n."""
    options = parse(arguments)
    asked = Interruption((signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
    from gsense_rig.demonstration import start  # noqa: PLC0415 - after the options: a wrong one is told at once

    processes: Processes | None = None
    try:
        folder = open_folder(options.out, options.seed)
        try:
            processes, setting = start.processes(folder)
            live = start.graph(processes, options.seed)
            # Imported only now, while the graph comes up: ROS and the rest take a second or two.
            from gsense_rig.demonstration.story import Story  # noqa: PLC0415

            Story(options, folder, processes, setting, live).tell()
        finally:
            asked.over()  # a second Ctrl-C must not leave processes behind
            if processes is not None:
                processes.close()
            folder.close()
    except (DemoError, FolderError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return UNUSABLE if isinstance(error, FolderError) else 1
    except (Interrupted, Exception):
        if asked.number is None:  # else it is what a binding of ROS made of the exception that it was interrupted by
            raise
    if asked.number is not None:
        print(f"\ndemo: ended by {signal.Signals(asked.number).name}; all its processes are gone", file=sys.stderr)
        return 128 + asked.number
    return 0


if __name__ == "__main__":
    sys.exit(main())
