"""Fuzz of the driver's pure part: random bytes and mutated real streams, memory watched.

./rig bench driver_fuzz [--megabytes 100] [--seed 1]           mutations by numpy's generator, any machine
./rig bench driver_fuzz --atheris [LIBFUZZER ARGS]             guided by coverage; first `pip install atheris`

Checked for every piece: no exception; every frame's packet, decoded again by the tests' own decoder, has a right CRC;
every byte is in exactly one of the stream's counts.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_driver")]

from tests.developer import arguments  # noqa: E402
from tests.driver import wire  # noqa: E402
from tests.driver.fuzzing import check, real_stream  # noqa: E402

from gsense_driver.pipeline import Pipeline, PipelineSettings  # noqa: E402
from gsense_driver.text import DEFAULT_COLUMNS  # noqa: E402

PIECE = 1 << 16


def pieces(generator: np.random.Generator) -> Iterator[bytes]:
    """Without end: random bytes, real streams with flipped bits, cut, doubled and shuffled parts, crafted packets."""
    real = np.frombuffer(real_stream(60.0), dtype=np.uint8)
    text = np.frombuffer(text_stream(3000), dtype=np.uint8)
    while True:
        kind = generator.integers(6)
        start = int(generator.integers(len(real) - PIECE))
        data = real[start : start + PIECE].copy()
        if kind == 0:
            data = generator.integers(0, 256, PIECE, dtype=np.uint8)
        elif kind == 1:  # a bit in 300 bytes
            at = generator.integers(0, PIECE, PIECE // 300)
            data[at] ^= (1 << generator.integers(0, 8, at.size)).astype(np.uint8)
        elif kind == 2:  # parts left out, doubled and out of order
            parts = np.array_split(data, int(generator.integers(2, 200)))
            data = np.concatenate([parts[i] for i in generator.integers(0, len(parts), len(parts))])
        elif kind == 3:  # frames with a right CRC and any content: sequences and times that jump at will
            data = np.frombuffer(b"".join(crafted(generator) for _ in range(PIECE // 35)), dtype=np.uint8)
        elif kind == 4:
            at = generator.integers(0, len(text), PIECE // 500)
            data = text.copy()
            data[at] = generator.integers(0, 256, at.size)
        yield data.tobytes()


def crafted(generator: np.random.Generator) -> bytes:
    body = generator.integers(0, 256, 22, dtype=np.uint8).tobytes()
    kind, flags, version = (int(v) for v in (generator.integers(32), generator.integers(256), 1))
    sequence, time_us = int(generator.integers(1 << 16)), int(generator.integers(1 << 32))
    return wire.cobs(wire.payload(kind, sequence, time_us, body, flags, version))


def text_stream(rows: int) -> bytes:
    return b"".join(
        b"%d;%s;\r\n" % (i, b";".join(b"%d" % (i * k % 2000 - 1000) for k in range(13))) for i in range(rows)
    )


def rss_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def fuzz(megabytes: float, seed: int) -> int:
    generator = np.random.default_rng(seed)
    pipelines = [
        Pipeline(PipelineSettings()),
        Pipeline(PipelineSettings(protocol="text", text_columns=DEFAULT_COLUMNS)),
    ]
    done, now_ns, frames, memory = 0, 0, 0, []
    begin = time.monotonic()
    for data in pieces(generator):
        check(data, int(generator.integers(1, 5000)))
        for pipeline in pipelines:
            for at in range(0, len(data), 4096):
                now_ns += int(generator.integers(0, 100_000_000))
                pipeline.feed(data[at : at + 4096], now_ns)
            if generator.integers(10) == 0:
                pipeline.reopened()
        done += len(data)
        memory.append(rss_mb())
        frames = pipelines[0].link.counts.received
        if done >= megabytes * 1e6:
            break
    early, late = memory[len(memory) // 5], memory[-1]
    print(f"{done * 1e-6:.0f} MB in {time.monotonic() - begin:.0f} s, {frames} frames, no exception, every CRC right")
    print(f"memory after a fifth {early:.1f} MB, at the end {late:.1f} MB ({late - early:+.1f})")
    return 0 if late - early < 10.0 else 1


def guided(arguments: list[str]) -> int:
    try:
        import atheris
    except ImportError:
        print("driver_fuzz: atheris is not installed (pip install atheris)", file=sys.stderr)
        return 2
    atheris.instrument_all()

    def one(data: bytes) -> None:
        check(data, 1 + len(data) // 3)
        for protocol in ("binary", "text"):
            Pipeline(PipelineSettings(protocol=protocol)).feed(data, 1)

    atheris.Setup([sys.argv[0], *arguments], one)
    atheris.Fuzz()
    return 0


def main() -> int:
    parser = arguments("./rig bench driver_fuzz", __doc__)
    parser.add_argument("--megabytes", type=float, default=100.0, help="of bytes, random and damaged")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    parser.add_argument("--atheris", action="store_true", help="guided by coverage; what follows is libFuzzer's")
    options, rest = parser.parse_known_args()
    if options.atheris:
        return guided(rest)
    if rest:
        parser.error(f"unknown: {' '.join(rest)}")
    return fuzz(options.megabytes, options.seed)


if __name__ == "__main__":
    sys.exit(main())
