"""The rig node for half an hour: memory, missed deadlines, jitter and lost poses while its callbacks are kept busy.

./rig bench rig_soak [--seconds 1800]

First the same time compressed: loop and plant on the virtual clock. Then live, over DDS: sines at 8 rad/s one after the
other, 20 refused service calls a second that the loop must not notice, every pose counted.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_rig")]

import rclpy  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from gsense_msgs.action import Sinusoid  # noqa: E402
from rclpy.action import ActionClient  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.domains import own_domain  # noqa: E402
from tests.graph.ears import Ears, stamp_ns  # noqa: E402
from tests.graph.processes import Graph, parameters  # noqa: E402

from gsense_rig.loop.messages import DriveSine, Home  # noqa: E402
from gsense_rig.loop.parameters import LoopParameters  # noqa: E402
from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop  # noqa: E402

AMPLITUDE, SPEED = 0.15, 8.0
PERIOD = 2.0 * np.pi / SPEED
GROWTH_LIMIT = 10.0  # MB after the first tenth
MISSED_LIMIT = 0.01  # of all ticks, on a machine that has nothing else to do
CALL_EVERY = 0.05  # s


def memory(pid: int) -> float:
    """Resident memory [MB]."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024.0
    raise RuntimeError(f"process {pid} has no VmRSS")


def children(pid: int) -> dict[str, int]:
    """The loop and guard processes under a node, by what they run."""
    found = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            command = Path(f"/proc/{child}/cmdline").read_text().replace("\0", " ")
            found["guard" if "guard" in command else "loop"] = int(child)
            found |= children(int(child))
    return found


def compressed(seconds: float) -> bool:
    """The loop and the plant on the virtual clock."""
    clock = VirtualClock(*make_simulated_loop(LoopParameters(tuned=True), seed=1))
    clock.run_command(Home(1))
    cycles = max(1, round(seconds / PERIOD / 20))
    before, begun, worst = 0.0, time.monotonic(), 0.0
    for k in range(20):
        result = clock.run_command(DriveSine(2, AMPLITUDE, SPEED, cycles))
        if not result.success:
            print(f"compressed: {result.message}")
            return False
        worst = max(worst, result.rms_error)
        if k == 1:
            before = memory(os.getpid())
    wall, growth = time.monotonic() - begun, memory(os.getpid()) - before
    late = abs(clock.now - clock.hardware.plant.time)
    print(
        f"compressed: {clock.now:.0f} s in {wall:.0f} s ({clock.now / wall:.0f} times real time), memory {growth:+.1f} "
        f"MB, tracking at most {worst * 1e3:.3f} mm rms, loop and plant {late * 1e9:.0f} ns apart"
    )
    return growth < GROWTH_LIMIT and worst < 0.5e-3 and late < 1e-6


class Watch:
    """Counts poses and keeps the loop's health, without keeping messages."""

    def __init__(self) -> None:
        self.poses = self.lost = 0
        self.health: dict[str, float] = {}
        self.late: list[float] = []
        self._last: int | None = None

    def hear(self, name: str, raw: bytes) -> None:
        if name == "rig/pose":
            stamp = stamp_ns(raw)
            if self._last is not None:
                self.lost += round((stamp - self._last) / 5e6) - 1
            self.poses, self._last = self.poses + 1, stamp
            return
        for status in rclpy.serialization.deserialize_message(raw, DiagnosticArray).status:
            if status.name.endswith(": loop"):
                self.health = {v.key: float(v.value) for v in status.values}
                self.late.append(self.health["late_max_us"])


class Callers(threading.Thread):
    """Keeps the node's callbacks busy with calls that are refused."""

    def __init__(self, ears: Ears) -> None:
        super().__init__(daemon=True)
        self.client = ears.node.create_client(Trigger, "rig/reset")
        self.calls = self.answers = 0
        self.ended = threading.Event()

    def run(self) -> None:
        while not self.ended.wait(CALL_EVERY):
            self.calls += 1
            self.client.call_async(Trigger.Request()).add_done_callback(self._answered)

    def _answered(self, _future: Any) -> None:
        self.answers += 1


def wait(future: Any, timeout: float) -> Any:
    end = time.monotonic() + timeout
    while not future.done():
        if time.monotonic() > end:
            raise TimeoutError(f"no answer within {timeout:g} s")
        time.sleep(0.01)
    return future.result()


def live(seconds: float) -> bool:
    with tempfile.TemporaryDirectory(prefix="gsense-rig-soak-") as name, own_domain():
        graph = Graph(Path(name))
        ears = None
        try:
            graph.start("rig", "gsense_rig", "rig", *parameters(bus=Path(name) / "bus"))
            ears = Heard()
            return soak(graph, ears, seconds)
        finally:
            if ears is not None:
                ears.close()
            graph.close()


class Heard(Ears):
    """Ears that count instead of keeping."""

    def __init__(self) -> None:
        self.watch: Watch | None = None
        super().__init__({"rig/pose": PoseStamped, "/diagnostics": DiagnosticArray})

    def _hear(self, name: str, raw: bytes) -> None:
        if self.watch is not None:
            self.watch.hear(name, bytes(raw))


def soak(graph: Graph, ears: Heard, seconds: float) -> bool:
    action, home = ActionClient(ears.node, Sinusoid, "rig/sinusoid"), ears.node.create_client(Trigger, "rig/home")
    if not (home.wait_for_service(60.0) and action.wait_for_server(60.0)):
        raise TimeoutError(f"no rig: {graph.log('rig')[-500:]}")
    answer = wait(home.call_async(Trigger.Request()), 60.0)
    if not answer.success:
        raise RuntimeError(answer.message)
    node = graph.processes["rig"].pid
    pids = {"node": node, **children(node)}
    ears.watch = watch = Watch()
    callers = Callers(ears)
    callers.start()
    start, first, errors = time.monotonic(), {}, []
    cycles = max(4, round(min(60.0, seconds / 10.0) / PERIOD))
    print(f"live: {seconds:.0f} s, processes {pids}")
    while time.monotonic() - start < seconds:
        goal = wait(
            action.send_goal_async(Sinusoid.Goal(amplitude=AMPLITUDE, angular_frequency=SPEED, cycles=cycles)), 10
        )
        outcome = wait(goal.get_result_async(), cycles * PERIOD + 30.0).result
        errors.append(outcome.rms_error)
        now = {k: memory(pid) for k, pid in pids.items()}
        if not first and time.monotonic() - start > 0.1 * seconds:
            first = now
        tell(time.monotonic() - start, now, watch, outcome)
        graph.check()
        if not outcome.success:
            break
    callers.ended.set()
    callers.join()
    time.sleep(1.0)
    growth = max(now[k] - first.get(k, now[k]) for k in now)
    missed = watch.health["overruns"] / watch.health["ticks"]
    print(
        f"live: {watch.poses} poses, {watch.lost} lost; {missed:.2%} of {watch.health['ticks']:.0f} ticks began more "
        f"than a period late, the latest by {max(watch.late) / 1e3:.2f} ms; memory {growth:+.1f} MB after a "
        f"tenth; {callers.answers} of {callers.calls} calls answered; tracking at most {max(errors) * 1e3:.3f} mm rms"
    )
    steady = watch.lost == 0 and growth < GROWTH_LIMIT and missed < MISSED_LIMIT
    return bool(outcome.success and steady and max(errors) < 0.5e-3)


def tell(elapsed: float, now: dict[str, float], watch: Watch, outcome: Any) -> None:
    h = watch.health
    print(
        f"{elapsed:7.0f} s  " + "  ".join(f"{k} {v:.1f} MB" for k, v in now.items()) + f"  poses {watch.poses} "
        f"lost {watch.lost}  overruns {h.get('overruns', 0):.0f}  late p99 {h.get('late_p99_us', 0):.0f} us  max "
        f"{h.get('late_max_us', 0):.0f} us  tick {h.get('cost_mean_us', 0):.0f} us  {outcome.rms_error * 1e3:.3f} mm",
        flush=True,
    )


def main() -> int:
    parser = arguments("./rig bench rig_soak", __doc__)
    parser.add_argument("--seconds", type=float, default=1800.0, help="live, and as many on the virtual clock")
    seconds = parser.parse_args().seconds
    good = compressed(seconds)
    good = live(seconds) and good
    print("good" if good else "BAD")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
