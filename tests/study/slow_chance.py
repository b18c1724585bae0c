"""How often does drift alone pass for a slow effect? Many sessions of block means of noise with known strengths.

    ./rig exec python tests/study/slow_chance.py [--sessions 400] [--first-seed 0]

For each kind of noise it prints how often the best of all steps, a warm-up and a discharge has a p-value under some
levels (it should be that level), and the gain in twice the log-likelihood that a level asks for. Exit 1 where a level
is exceeded more often than chance allows.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

import numpy as np  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.progress import track  # noqa: E402
from rich.table import Table  # noqa: E402
from scipy.stats import binom  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.study.simulator.markov import realise  # noqa: E402
from tests.study.simulator.parameters import DEG, NoiseParameters  # noqa: E402

from gsense_fusion.identification.likelihood.slow import Blocks, SlowNoise  # noqa: E402
from gsense_fusion.identification.search.alternatives import steps  # noqa: E402
from gsense_fusion.identification.search.chance import Chance, chance  # noqa: E402

LEVELS = (0.1, 0.01, 0.001)
BLOCK_S = 8.0
RUN_S = 40.0
GAP_S = 6.0
KINDS: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "white alone": ((1.0,), (0.0,)),
    "flicker and walk": (NoiseParameters().markov_tau_s, NoiseParameters().markov_sigma),
    "one slow process": ((300.0,), (0.003 * DEG,)),
    "strong walk": ((1e5,), (0.05 * DEG,)),
}
"""Time constants in s and standard deviations in rad/s of the sum of Markov processes."""


def session(kind: str, seed: int, length_s: float = 720.0) -> Blocks:
    """Block means of a session with runs of `RUN_S`: white noise as an MPU-6050 has it, and drift of one kind."""
    rng = np.random.default_rng([seed, 5])
    start = np.concatenate([np.arange(0, RUN_S, BLOCK_S) + t for t in np.arange(0.0, length_s, RUN_S + GAP_S)])
    white = NoiseParameters().white / np.sqrt(2 * BLOCK_S)
    tau, sigma = KINDS[kind]
    inner = (start[:, None] + np.linspace(0.1, 0.9, 5) * BLOCK_S).ravel()
    drift = [realise(inner, tau, sigma, rng).reshape(-1, 5).mean(axis=1) for _ in range(3)]
    rate = np.stack(drift, axis=1) + white * rng.standard_normal((len(start), 3))
    none = np.zeros(len(start), dtype=np.int64)
    run = (start // (RUN_S + GAP_S)).astype(np.int64)
    return Blocks(start + BLOCK_S / 2, np.full(len(start), BLOCK_S), rate, none, run, none)


def best_alternative(blocks: Blocks) -> Chance:
    """Steps, a warm-up of three lengths and a discharge beside drift."""
    slow = {axis: SlowNoise(blocks, NoiseParameters().white ** 2) for axis in range(3)}
    others = [1.0 - np.exp(-blocks.time / tau) for tau in (60.0, 150.0, 400.0)] + [blocks.time / blocks.time[-1]]
    columns = np.column_stack([steps(blocks), *others])
    return chance(slow, blocks.rate, columns, np.zeros((len(blocks), 0)))


def main() -> int:
    parser = arguments("./rig exec python tests/study/slow_chance.py", __doc__)
    parser.add_argument("--sessions", type=int, default=400, help="for each kind of noise")
    parser.add_argument("--first-seed", type=int, default=0, help="another one gives fresh sessions")
    a = parser.parse_args()
    table = Table("drift", "sessions", *(f"p < {x:g}" for x in LEVELS), *(f"gain for {x:g}" for x in LEVELS))
    bad = False
    for kind in KINDS:
        p, needed = [], []
        for seed in track(range(a.first_seed, a.first_seed + a.sessions), kind, console=Console(stderr=True)):
            found = best_alternative(session(kind, seed))
            p.append(found.p_value(float(found.gains.max())))
            needed.append([found.gain_for(x) for x in LEVELS])
        hits = [int(np.sum(np.array(p) < x)) for x in LEVELS]
        bad |= any(h > binom.ppf(0.999, a.sessions, x) for h, x in zip(hits, LEVELS, strict=True))
        cells = [f"{h} ({100 * h / a.sessions:.1f} %)" for h in hits] + [f"{g:.0f}" for g in np.median(needed, axis=0)]
        table.add_row(kind, str(a.sessions), *cells)
    Console(width=130).print(table)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
