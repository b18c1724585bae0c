"""Eight hours of samples in less: driver, bridge and recorder, with memory and open files hour by hour.

./rig bench soak [--hours 8] [--live-hours 8] [--times 0] [--seed 1]

Compressed twice, for no clock of a live graph can be hurried:

- *Simulated time*: the driver without its node takes every frame of the hours with the times of their arrival, as fast
  as it goes: the board's clock drifts and wraps every 71.6 min, reports come once a second, the host's clock is set
  once. What is not there: ROS, port, disk.
- *Frames*: a board at `times` its rate over a pseudo-terminal, the bridge, the recorder: as many frames, messages and
  bytes on disk as in `live-hours`, in less time. `--times 0` looks for the highest rate without a loss first and takes
  three quarters of it. What comes by the second (`link`, `/diagnostics`) comes as often as in the time it takes.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), *(str(ROOT / "src" / name) for name in ("gsense_driver", "gsense_rig"))]

from tests.bench.slow.driver_soak import Cable, rss_mb  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.domains import own_domain  # noqa: E402
from tests.driver.hours import GROWTH_MB, HOUR, SLOTS_PER_S, growth, open_files, packets, simulated  # noqa: E402

GROWTH_FILES = 0
"""An hour, after the first one."""
TIMES = (2, 3, 4, 5, 6, 8)
TRIAL_S = 8.0
SHARE = 0.75
SPLIT = 50_000_000
"""Bytes of a storage file; closed ones are deleted, or eight hours would need gigabytes."""


def play(link: str, times: float, slots: int, ready: Any, go: Any) -> None:
    """Body of the board's process."""
    cable, draw = Cable(Path(link)), random.Random(1)
    rate = SLOTS_PER_S * times
    ready.set()
    go.wait()
    begun = time.monotonic()
    for slot in range(slots):
        left = begun + slot / rate - time.monotonic()
        if left > 0.0:
            time.sleep(left)
        cable.write(packets(slot, 1e6 / rate, draw))
    time.sleep(3.0)


class Live:
    """Bridge and recorder, and what `link` says."""

    def __init__(self, folder: Path) -> None:
        import rclpy
        from gsense_msgs.msg import LinkStatus

        self.folder, self.rclpy, self.link = folder, rclpy, None
        rclpy.init()
        self.node = rclpy.create_node("soak")
        self.node.create_subscription(LinkStatus, "link", lambda m: setattr(self, "link", m), 10)
        self.bridge = self._start("gsense_driver.bridge_node", f"port:={folder / 'tty'}")
        self.recorder = self._start("gsense_rig.record", f"out:={folder / 'bag'}", f"max_bag_size:={SPLIT}")

    def _start(self, module: str, *parameters: str) -> subprocess.Popen[str]:
        words = ["--ros-args", *(word for given in parameters for word in ("-p", given))]
        return subprocess.Popen(
            [sys.executable, "-m", module, *words],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.rclpy.spin_once(self.node, timeout_sec=0.2)
        closed = sorted((self.folder / "bag").glob("*.mcap"), key=lambda file: file.stat().st_mtime)[:-1]
        for file in closed:
            file.unlink()

    def recorded(self) -> dict[str, int]:
        """End the recorder; its counts by topic."""
        self.recorder.terminate()
        text = self.recorder.communicate(timeout=120)[0]
        rows = (line.split() for line in text.splitlines() if line.startswith("  "))
        return {name: int(count) for count, name in rows}

    def close(self) -> None:
        for process in (self.bridge, self.recorder):
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.node.destroy_node()
        self.rclpy.try_shutdown()


def live(times: float, hours: float, *, tell: bool) -> dict[str, Any]:
    """As many frames as in some hours, at so many times the board's rate; the figures."""
    slots = round(hours * HOUR * SLOTS_PER_S)
    with tempfile.TemporaryDirectory(prefix="gsense-soak-") as name:
        ready, go = multiprocessing.Event(), multiprocessing.Event()
        board = multiprocessing.Process(target=play, args=(f"{name}/tty", times, slots, ready, go), daemon=True)
        board.start()
        ready.wait()
        graph = Live(Path(name))
        try:
            while graph.link is None or graph.node.count_subscribers("mpu6050/imu/data_raw") == 0:
                graph.spin(0.2)
            graph.spin(2.0)
            go.set()
            pids = {"bridge": graph.bridge.pid, "recorder": graph.recorder.pid}
            memory, files, begun, said = _watch(graph, board, pids, HOUR / times, hours, tell=tell)
            link = graph.link
            recorded = graph.recorded()
            return {
                "sent": slots + (slots + 1) // 2,
                "mpu": slots,
                "received": link.received,
                "lost": link.lost,
                "corrupt": link.corrupt,
                "recorded": recorded.get("/mpu6050/imu/data_raw", 0),
                "took": time.monotonic() - begun,
                "memory": {who: growth(values) for who, values in memory.items()},
                "files": {who: values[-1] - values[0] for who, values in files.items()},
                "hours": said,
            }
        finally:
            board.kill()
            graph.close()


def _watch(
    graph: Live, board: Any, pids: dict[str, int], hour_s: float, hours: float, *, tell: bool
) -> tuple[Any, ...]:
    """Memory [MB] and open files at the end of each hour of frames."""
    memory: dict[str, list[float]] = {who: [] for who in pids}
    files: dict[str, list[int]] = {who: [] for who in pids}
    begun, said = time.monotonic(), 0
    while board.is_alive():
        graph.spin(min(1.0, hour_s))
        if time.monotonic() - begun < (said + 1) * hour_s and board.is_alive():
            continue
        said += 1
        for who, pid in pids.items():
            memory[who].append(rss_mb(pid))
            files[who].append(open_files(pid))
        if tell:
            words = ", ".join(f"{who} {memory[who][-1]:.1f} MB, {files[who][-1]} open files" for who in pids)
            print(f"  hour {min(said, hours):g} of frames: {words}; lost {graph.link.lost}", flush=True)
    return memory, files, begun, said


def highest() -> float:
    """Three quarters of the highest rate of the list that lost nothing, in times the board's."""
    best = 1.0
    for times in TIMES:
        figures = live(times, TRIAL_S * times / HOUR, tell=False)
        whole = figures["lost"] == 0 and figures["recorded"] >= figures["mpu"] - 2 * SLOTS_PER_S
        print(f"  {300 * times:.0f} frames/s for {TRIAL_S:.0f} s: {figures['lost']} lost", flush=True)
        if not whole:
            break
        best = times
    return max(1.0, SHARE * best)


def main() -> int:
    parser = arguments("./rig bench soak", __doc__)
    parser.add_argument("--hours", type=float, default=8.0, help="of simulated time")
    parser.add_argument("--live-hours", type=float, default=8.0, help="hours' worth of frames, live")
    parser.add_argument("--times", type=float, default=0.0, help="of the board's rate; 0: look for it")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    options = parser.parse_args()
    print(f"{os.cpu_count()} cores, load before {os.getloadavg()[0]:.1f}", flush=True)
    good = simulated(options.hours, options.seed) if options.hours else True
    if options.live_hours:
        with own_domain():
            times = options.times or highest()
            f = live(times, options.live_hours, tell=True)
        # the first frames come before the clock has its fix: they get no stamp and are not published
        unseen = f["mpu"] - f["recorded"]
        print(
            f"live: the frames of {options.live_hours:g} h in {f['took'] / 60:.1f} min ({times:g} times the board's "
            f"rate, {300 * times:.0f} frames/s): {f['sent']} sent, {f['received']} received, {f['lost']} lost, "
            f"{f['corrupt']} corrupt; of {f['mpu']} MPU samples {unseen} not recorded; an hour after the first: "
            + ", ".join(f"{who} {grown:+.2f} MB" for who, grown in f["memory"].items())
            + "; open files "
            + ", ".join(f"{who} {grown:+d}" for who, grown in f["files"].items())
        )
        good &= f["lost"] == f["corrupt"] == 0 and unseen < 2 * SLOTS_PER_S * times
        good &= all(g < GROWTH_MB for g in f["memory"].values()) and all(g <= GROWTH_FILES for g in f["files"].values())
    print("targets met" if good else "TARGETS MISSED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
