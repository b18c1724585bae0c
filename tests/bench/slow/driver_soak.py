"""The bridge at 600 frames/s over a pseudo-terminal: loss, CPU, latency to a subscriber, cable pulled at random.

./rig bench driver_soak [--seconds 300] [--pulls 20] [--seed 1]

A process plays the fast board (500 MPU and 100 BNO frames/s) and notes when each frame's last byte was written; each
MPU frame carries its number as raw rate, by which the subscriber, a second process in Python, finds that time.
"""

from __future__ import annotations

import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
import time
import tty
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_driver")]

from tests.developer import arguments  # noqa: E402
from tests.driver import wire  # noqa: E402

from gsense_driver.scaling import DEG  # noqa: E402

SCALE = DEG / 65.5
MPU_HZ, BNO_EVERY = 500, 5
TARGETS = {"cpu": 0.25, "p99_ms": 3.0, "pull_s": 1.0}


class Cable:
    """A pseudo-terminal behind a link that can be taken away."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    def plug(self) -> None:
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        self.link.symlink_to(os.ttyname(self.slave))
        self.plugged = True

    def pull(self) -> None:
        self.plugged = False
        self.link.unlink()
        os.close(self.slave)
        os.close(self.master)

    def write(self, data: bytes) -> None:
        try:
            os.write(self.master, data)
        except BlockingIOError:  # nobody reads and the buffer is full: as on a real line, it is gone
            return


def frames(index: int) -> list[bytes]:
    """Packets of one slot of the board; sequence numbers count every frame."""
    t_us = index * (1_000_000 // MPU_HZ)
    sequence = index + (index + BNO_EVERY - 1) // BNO_EVERY
    body = wire.mpu_body(gyr=(index & 0x7FFF, index >> 15, 0))
    out = [wire.cobs(wire.payload(1, sequence, t_us, body))]
    if index % BNO_EVERY == 0:
        bno = wire.bno_body(gyr=(index % 1000, 0, 0))
        out.append(wire.cobs(wire.payload(2, sequence + 1, t_us + 700, bno)))
    return out


def play(link: str, seconds: float, pulls: list[tuple[float, float]], shared: Any, ready: Any, go: Any) -> None:
    """Body of the board's process. `shared`: write time of each MPU frame (ns), then the times of the replugs."""
    times = np.frombuffer(shared, dtype=np.int64)
    cable = Cable(Path(link))
    ready.set()
    go.wait()
    begin = time.monotonic()
    changes = [edge for pull in pulls for edge in pull]
    done = 0
    for index in range(round(seconds * MPU_HZ)):
        due = begin + index / MPU_HZ
        while (left := due - time.monotonic()) > 0:
            time.sleep(left)
        if done < len(changes) and time.monotonic() - begin >= changes[done]:
            if cable.plugged:
                cable.pull()
            else:
                cable.plug()
                times[-len(pulls) + done // 2] = time.monotonic_ns()
            done += 1
        if not cable.plugged:
            continue
        mpu, *bno = frames(index)
        cable.write(mpu)
        times[index] = time.monotonic_ns()
        for packet in bno:
            cable.write(packet)
    time.sleep(3.0)


class Listener:
    """The subscriber: arrival time of each numbered frame, and the last LinkStatus."""

    def __init__(self, count: int) -> None:
        import rclpy
        from gsense_msgs.msg import LinkStatus
        from rclpy.node import Node
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import Imu

        rclpy.init()
        self.rclpy = rclpy
        self.node = Node("soak")
        self.arrival = np.zeros(count, dtype=np.int64)
        self.order: list[int] = []
        self.bno = 0
        self.link: Any = None
        self.node.create_subscription(Imu, "mpu6050/imu/data_raw", self._mpu, QoSProfile(depth=2500))
        self.node.create_subscription(Imu, "bno055/imu/data_raw", self._bno, QoSProfile(depth=2500))
        self.node.create_subscription(LinkStatus, "link", self._link, QoSProfile(depth=10))

    def _mpu(self, message: Any) -> None:
        now = time.monotonic_ns()
        rate = message.angular_velocity
        index = round(rate.x / SCALE) + (round(rate.y / SCALE) << 15)
        self.arrival[index] = now
        self.order.append(index)

    def _bno(self, _message: Any) -> None:
        self.bno += 1

    def _link(self, message: Any) -> None:
        self.link = message


def cpu_s(pid: int) -> float:
    """CPU time of a process so far, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def rss_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def soak(seconds: float, pulls: list[tuple[float, float]], raw_log: bool) -> dict[str, float]:
    """One run; its figures."""
    count = round(seconds * MPU_HZ)
    shared = multiprocessing.RawArray("q", count + max(1, len(pulls)))
    with tempfile.TemporaryDirectory(prefix="gsense-soak-") as folder:
        link = Path(folder) / "tty"
        ready, go = multiprocessing.Event(), multiprocessing.Event()
        board = multiprocessing.Process(target=play, args=(str(link), seconds, pulls, shared, ready, go), daemon=True)
        board.start()
        ready.wait()
        arguments = ["--ros-args", "-p", f"port:={link}"]
        if raw_log:
            arguments += ["-p", f"raw_log:={folder}/soak.raw"]
        bridge = subprocess.Popen(
            [sys.executable, "-m", "gsense_driver.bridge_node", *arguments],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            stderr=subprocess.DEVNULL if pulls else None,
        )
        try:
            return measure(bridge, board, go, shared, count, len(pulls))
        finally:
            bridge.terminate()
            bridge.wait()


def measure(bridge: Any, board: Any, go: Any, shared: Any, count: int, pulls: int) -> dict[str, float]:
    listener = Listener(count)
    spin = listener.rclpy.spin_once
    while listener.link is None and bridge.poll() is None:
        spin(listener.node, timeout_sec=0.1)
    go.set()
    while not listener.order and board.is_alive():
        spin(listener.node, timeout_sec=0.1)
    begin, cpu, memory = time.monotonic(), cpu_s(bridge.pid), rss_mb(bridge.pid)
    spent, span = 0.0, 0.0
    while board.is_alive():
        spin(listener.node, timeout_sec=0.1)
        if len(listener.order) < count - pulls:  # not the quiet seconds at the end
            spent, span = cpu_s(bridge.pid) - cpu, time.monotonic() - begin
    figures = {"cpu": spent / span, "memory_mb": rss_mb(bridge.pid) - memory, "alive": bridge.poll() is None}
    written = np.frombuffer(shared, dtype=np.int64)
    sent, back = written[:count], written[count : count + pulls]
    got = listener.arrival > 0
    fresh = got & (np.arange(count) >= MPU_HZ)  # the first frames wait for the clock's fix
    latency = (listener.arrival - sent)[fresh] * 1e-6
    figures |= {f"p{q:g}_ms": float(np.percentile(latency, q)) for q in (50, 99, 99.9)}
    # Unseen: from the first frame seen on; those before it came while the subscriber was not yet found.
    figures |= {"max_ms": float(latency.max()), "unseen": int(((sent > 0) & ~got)[got.argmax() :].sum())}
    figures |= {name: getattr(listener.link, name) for name in ("received", "lost", "corrupt", "duplicate", "restarts")}
    arrivals = np.sort(listener.arrival[got])
    first = [float(arrivals[arrivals > at][0] - at) * 1e-9 for at in back if (arrivals > at).any()]
    figures |= {"returned": len(first), "pull_s": max(first, default=float("nan"))}
    listener.node.destroy_node()
    listener.rclpy.shutdown()
    return figures


def main() -> int:
    parser = arguments("./rig bench driver_soak", __doc__)
    parser.add_argument("--seconds", type=float, default=300.0, help="live")
    parser.add_argument("--pulls", type=int, default=20, help="of the cable")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    parser.add_argument("--raw-log", action="store_true", help="the bridge also writes a raw log")
    options = parser.parse_args()
    good = True
    print(f"{os.cpu_count()} cores, load before {os.getloadavg()[0]:.1f}", flush=True)
    if options.seconds:
        f = soak(options.seconds, [], options.raw_log)
        print(
            f"600 frames/s for {options.seconds:.0f} s, load {os.getloadavg()[0]:.1f}: received {f['received']}, "
            f"lost {f['lost']}, corrupt {f['corrupt']}; frames that the subscriber did not see: {f['unseen']}"
        )
        print(
            f"  last byte to subscriber: median {f['p50_ms']:.2f}, p99 {f['p99_ms']:.2f}, p99.9 {f['p99.9_ms']:.2f}, "
            f"worst {f['max_ms']:.1f} ms (target p99 {TARGETS['p99_ms']})"
        )
        print(
            f"  bridge: {100 * f['cpu']:.1f} % of a core (target {100 * TARGETS['cpu']:.0f}), "
            f"memory {f['memory_mb']:+.1f} MB",
            flush=True,
        )
        good &= f["lost"] == f["unseen"] == 0 and f["cpu"] < TARGETS["cpu"] and f["p99_ms"] < TARGETS["p99_ms"]
    if options.pulls:
        random.seed(options.seed)
        pulls, t = [], 2.0
        for _ in range(options.pulls):
            away = random.uniform(0.05, 1.5)
            pulls.append((t, t + away))
            t += away + random.uniform(1.2, 2.5)
        f = soak(t, pulls, options.raw_log)
        print(
            f"cable pulled {options.pulls} times: streaming again {f['returned']} times, "
            f"after {f['pull_s']:.2f} s at worst (target {TARGETS['pull_s']}); "
            f"bridge alive: {bool(f['alive'])}, restarts counted {f['restarts']}"
        )
        good &= f["returned"] == options.pulls and f["pull_s"] < TARGETS["pull_s"] and bool(f["alive"])
    print("targets met" if good else "TARGETS MISSED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
