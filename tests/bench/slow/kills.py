"""Every node of the live graph is killed, stopped for a while or ended at random times while the carriage moves.

./rig bench kills [--strikes 40] [--seed 1] [--only bridge rig]

Each strike: SIGKILL, SIGTERM (then started again, as launch does) or SIGSTOP for 0.2 to 3 s, 0.2 to 2 s after the last
one. Fails where a node does not come back, another one ends, the motor does not stop with the rig, or where a hole in a
bag is not told by its notes.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_rig"), str(ROOT / "src" / "gsense_fusion")]

from tests.developer import arguments  # noqa: E402
from tests.domains import own_domain  # noqa: E402
from tests.graph.kills import IMU, NODES, POSE, STEADY, WAYS, Kills, Strike  # noqa: E402


def tell(number: int, strike: Strike) -> None:
    lost = f"{strike.lost} of {STEADY[strike.victim]}" if strike.victim in STEADY else "-"
    motor = "" if strike.motor_s is None else f"  motor off and at rest after {strike.motor_s:.2f} s"
    said = "".join(f"  {fault}" for fault in strike.faults)
    blow = f"{number:3d}  {strike.victim:9s} {strike.way.name:8s} gone after {strike.gone_s:5.2f} s"
    print(f"{blow}, works again after {strike.back_s:6.2f} s, missing {lost}{motor}{said}", flush=True)


def summary(strikes: list[Strike]) -> None:
    """A line for each node and way."""
    print("node       blow      times  works again after, at most  messages missing, at most")
    for victim in NODES:
        for way in WAYS:
            some = [s for s in strikes if (s.victim, s.way) == (victim, way)]
            if some:
                lost = f"{max(s.lost for s in some)}" if victim in STEADY else "-"
                print(f"{victim:10s} {way.name:8s} {len(some):5d}  {max(s.back_s for s in some):20.2f} s  {lost:>20s}")
    motors = [s.motor_s for s in strikes if s.motor_s is not None]
    if motors:
        print(f"the rig ended {len(motors)} times in motion: motor off and at rest after {max(motors):.2f} s at most")


def main() -> int:
    parser = arguments("./rig bench kills", __doc__)
    parser.add_argument("--strikes", type=int, default=40, help="at all nodes together")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    parser.add_argument("--only", nargs="+", choices=NODES, default=list(NODES), help="nodes to strike")
    options = parser.parse_args()
    draw = random.Random(options.seed)
    cases = [(victim, way) for way in WAYS for victim in options.only]
    draw.shuffle(cases)
    order = [cases[k % len(cases)] for k in range(options.strikes)]
    strikes = []
    with own_domain(), tempfile.TemporaryDirectory(prefix="gsense-kills-") as name:
        kills = Kills(Path(name))
        try:
            kills.begin()
            for number, (victim, way) in enumerate(order):
                time.sleep(draw.uniform(0.2, 2.0))
                strikes.append(kills.strike(victim, way, draw.uniform(0.2, 3.0)))
                tell(number, strikes[-1])
            faults = kills.finish()
        finally:
            kills.close()
        faults += [f"{s.victim} {s.way.name}: {fault}" for s in strikes for fault in s.faults]
        summary(strikes)
        for topic in (IMU, POSE):
            heard = len(kills.ears.heard[topic])
            print(
                f"{topic}: {heard} heard, {kills.kept[topic]} in {len(kills.bags)} bags, {kills.unkept[topic]} came "
                "while the recorder had not found the new node; the others between two bags"
            )
    print(f"{len(strikes)} strikes, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}: {len(faults)} faults")
    for fault in faults:
        print(f"  {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
