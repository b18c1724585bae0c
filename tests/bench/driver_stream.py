"""Throughput of the driver's pure part on one core: bytes to frames, bytes to scaled and stamped samples, faults.

./rig bench driver_stream [--frames 200000] [--chunk 4096]
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_driver")]

from tests.developer import arguments  # noqa: E402
from tests.driver import wire  # noqa: E402

from gsense_driver.pipeline import Pipeline, PipelineSettings  # noqa: E402
from gsense_driver.stream import FrameStream, Reject  # noqa: E402

FRAME_RATE = 300.0  # of the simulated board, per second of its time
REPEATS = 5


def packets(count: int) -> list[bytes]:
    """The board's stream: 200 MPU, 100 BNO frames and a STATUS frame a second, with noise in every count."""
    random.seed(1)

    def noisy(*centre: int) -> tuple[int, ...]:
        return tuple(value + random.randrange(-40, 41) for value in centre)

    out, slot = [], 0
    while len(out) < count:
        t_us = slot * 5000
        body = wire.mpu_body(noisy(0, 0, 8192), noisy(0, 0, 0), -521, 8192 + random.randrange(-9, 10))
        bodies = [(1, t_us, body)]
        if slot % 2:
            bodies.append((2, t_us + 2000, wire.bno_body(noisy(0, 0, 981), noisy(320, 50, -640), noisy(0, 0, 0))))
        if slot % 200 == 100:
            bodies.append((3, t_us + 4000, wire.status_body(uptime=slot // 200)))
        for kind, when, body in bodies:
            out.append(wire.cobs(wire.payload(kind, len(out), when, body)))
        slot += 1
    return out[:count]


def faulty(clean: Sequence[bytes]) -> list[bytes]:
    """One packet in ten hit: a bit flipped, bytes cut off, the packet lost or repeated, noise in front of it."""
    random.seed(2)
    out: list[bytes] = []
    for whole in clean:
        packet, kind = whole, random.randrange(50)
        if kind == 0:
            at = random.randrange(len(packet))
            packet = packet[:at] + bytes([packet[at] ^ 1 << random.randrange(8)]) + packet[at + 1 :]
        elif kind == 1:
            packet = packet[: random.randrange(len(packet))]
        elif kind == 2:
            continue
        elif kind == 3:
            out.append(packet)
        elif kind == 4:
            out.append(random.randbytes(random.randrange(1, 60)))
        out.append(packet)
    return out


def chunks(data: bytes, size: int) -> list[bytes]:
    return [data[at : at + size] for at in range(0, len(data), size)]


def best(work: Callable[[], int]) -> tuple[float, int]:
    """Least CPU time of several turns, s, and what was counted."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        count = work()
        times.append(time.process_time() - begin)
    return min(times), count


def to_frames(pieces: Sequence[bytes]) -> int:
    stream = FrameStream()
    count = 0
    for piece in pieces:
        count += sum(not isinstance(item, Reject) for item in stream.feed(piece))
    return count


def to_samples(pieces: Sequence[bytes], bytes_per_s: float) -> tuple[int, int]:
    """Inertial samples (frames of a sensor that got a stamp) and readings of every kind."""
    pipeline = Pipeline(PipelineSettings())
    arrived = readings = 0
    for piece in pieces:
        arrived += len(piece)
        readings += len(pipeline.feed(piece, int(arrived / bytes_per_s * 1e9)))
    counts = pipeline.sampler.counts.samples
    return counts["mpu6050"] + counts["bno055"], readings


def main() -> int:
    parser = arguments("./rig bench driver_stream", __doc__)
    parser.add_argument("--frames", type=int, default=200_000, help="of the board")
    parser.add_argument("--chunk", type=int, default=4096, help="bytes per read")
    options = parser.parse_args()
    clean = packets(options.frames)
    streams = {"clean": b"".join(clean), "faulty": b"".join(faulty(clean))}
    cost: dict[tuple[str, str], float] = {}
    for name, data in streams.items():
        pieces = chunks(data, options.chunk)
        bytes_per_s = FRAME_RATE * len(data) / options.frames
        seconds, frames = best(lambda pieces=pieces: to_frames(pieces))
        cost[name, "frames"] = seconds / len(data)
        print(f"{name:7} bytes to frames:          {frames / seconds:9,.0f} frames/s")
        seconds, samples = best(lambda p=pieces, b=bytes_per_s: to_samples(p, b)[0])
        cost[name, "samples"] = seconds / len(data)
        readings = to_samples(pieces, bytes_per_s)[1]
        print(f"{name:7} bytes to stamped samples: {samples / seconds:9,.0f} samples/s", end="")
        print(f", {readings / seconds:9,.0f} readings/s")
    for what in ("frames", "samples"):
        print(
            f"a byte of the faulty stream costs {cost['faulty', what] / cost['clean', what]:.2f} times as much ({what})"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
