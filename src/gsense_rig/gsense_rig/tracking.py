"""`ros2 run gsense_rig tracking`: both controllers on plants that are not what they believe; table and plot."""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_rig.assessment import checks, plants, plot, tables
from gsense_rig.assessment.judging import Judged, judge_pi, judge_plant, within_targets, worst
from gsense_rig.assessment.sine_run import Tracking


def main(arguments: list[str] | None = None) -> int:
    """Judge, print, write; exit 1 where a target is missed."""
    parser = ArgumentParser(prog="tracking", description="Tracking of both controllers on the simulated rail.")
    parser.add_argument("--out", type=Path, help="folder for tracking.txt and tracking.png; nothing is written without")
    parser.add_argument(
        "--off", type=float, default=20.0, metavar="PERCENT", help="how far parameters are off (default: 20)"
    )
    parser.add_argument("--seed", type=int, default=1, help="seed of the first plant; each has its own (default: 1)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: one a core)")
    options = parser.parse_args(arguments)
    if not 0.0 <= options.off <= 50.0:
        parser.error(f"--off {options.off:g} is not within 0 to 50 percent")
    begun = time.monotonic()
    try:
        pi, judged = _judge_all(options.off / 100.0, options.seed, options.jobs)
    except RuntimeError as error:
        sys.stderr.write(f"tracking: {error}\n")
        return 2
    untuned, tuned = worst([j.untuned for j in judged]), worst([j.tuned for j in judged])
    nominal = judged[0]
    found = checks.checks(nominal.peaks)
    text = tables.document(pi, judged, untuned, tuned, found)
    met = within_targets(untuned) and within_targets(tuned) and all(check.holds for check in found)
    sys.stdout.write(
        f"{text}\n\n{'all within the targets' if met else 'OUTSIDE the targets'}; {time.monotonic() - begun:.0f} s\n"
    )
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "tracking.txt").write_text(text + "\n", encoding="utf-8")
        plot.save(options.out / "tracking.png", (pi, nominal.tuned, untuned, tuned), len(judged))
        sys.stdout.write(f"wrote {options.out / 'tracking.txt'} and {options.out / 'tracking.png'}\n")
    return 0 if met else 1


def _judge_all(off: float, seed: int, jobs: int) -> tuple[dict[float, Tracking], list[Judged]]:
    with ProcessPoolExecutor(max(1, jobs)) as pool:
        pi = pool.submit(judge_pi, seed)
        futures = [
            pool.submit(judge_plant, name, plant, seed + k)
            for k, (name, plant) in enumerate(plants.all_plants(off).items())
        ]
        return pi.result(), [future.result() for future in futures]


if __name__ == "__main__":
    sys.exit(main())
