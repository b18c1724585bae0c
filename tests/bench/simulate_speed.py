"""How much faster than real time `simulate` makes a campaign, on one core.

./rig bench simulate_speed [--plan minimum] [--repeats 1]

Counts the process's CPU time from the first run to the last bag, without start-up and compilation. The second figure is
by the wall clock.
"""

from __future__ import annotations

import gc
import os
import sys
import tempfile
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_rig")]

from tests.developer import arguments  # noqa: E402

from gsense_rig.campaign.plan import Plan, load_plan  # noqa: E402
from gsense_rig.campaign.session import SessionSpec  # noqa: E402
from gsense_rig.campaign.simulate import simulate_campaign  # noqa: E402

TARGET = 50.0


def main() -> int:
    parser = arguments("./rig bench simulate_speed", __doc__)
    parser.add_argument("--plan", default="minimum", help="a shipped plan's name or a file")
    parser.add_argument("--repeats", type=int, default=1, help="of the campaign; the fastest counts")
    options = parser.parse_args()
    plan = load_plan(options.plan)
    gc.disable()
    best = 0.0
    with tempfile.TemporaryDirectory(prefix="gsense-simulate-") as name:
        simulate_campaign(Plan("warm", plan.runs[:1]), Path(name) / "warm", SessionSpec(1))
        for k in range(options.repeats):
            cpu, wall = time.process_time(), time.perf_counter()
            result = simulate_campaign(plan, Path(name) / str(k), SessionSpec(k + 1))
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            best = max(best, result.simulated / cpu)
            print(
                f"{options.plan}: {result.made} runs, {result.simulated:.0f} s, {result.messages} messages; "
                f"{result.simulated / cpu:.0f} times real time on one core ({result.simulated / wall:.0f} by the clock)"
            )
    print(f"target: {TARGET:.0f} times real time: {'met' if best >= TARGET else 'missed'}")
    return 0 if best >= TARGET else 1


if __name__ == "__main__":
    sys.exit(main())
