"""What the loop found in demos with different seeds; each demo takes about a minute.

./rig bench ten_demos [--seeds 1 2 3 ...] [--seconds 20] [--keep DIR]
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

from tests.developer import arguments  # noqa: E402
from tests.graph.processes import executable  # noqa: E402

HEAD = f"{'seed':>5}  {'hidden':32} {'found':32} {'off by':>8}  {'verdict':16} {'declared':>9} {'full':>7} {'floor':>7}"


def main() -> int:
    parser = arguments("./rig bench ten_demos", __doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1, 11)), help="one demo each")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each live run")
    parser.add_argument("--keep", type=Path, help="keep the demos' folders here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="gsense-demos-") as name:
        folder = options.keep or Path(name)
        print(HEAD, "   wall s  first sample s  lost")
        results = [play(seed, folder / f"seed_{seed}", options.seconds) for seed in options.seeds]
    good = [result for result in results if result and result["hidden_found"]]
    alone = [result for result in good if len(result["found"]) == 1]
    explained = [result for result in alone if result["verdict"] == "effects_found"]
    print(
        f"{len(results)} demos: the hidden effect named in {len(good)}, alone in {len(alone)}, "
        f"with nothing left unexplained in {len(explained)}"
    )
    return 0 if len(explained) == len(results) else 1


def play(seed: int, folder: Path, seconds: float) -> dict[str, Any] | None:
    command = [
        str(executable("gsense_rig", "demo")),
        "--seed",
        str(seed),
        "--seconds",
        str(seconds),
        "--out",
        str(folder),
    ]
    begun = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    wall = time.monotonic() - begun
    if done.returncode != 0:
        print(f"{seed:5d}  exit code {done.returncode}: {done.stderr.strip().splitlines()[-1]}", flush=True)
        return None
    result: dict[str, Any] = yaml.safe_load((folder / "demo.yaml").read_text())
    hidden, rms, figures = result["hidden"], result["rate_rms"], result["figures"]
    off = "" if result["deviation_sigma"] is None else f"{result['deviation_sigma']:.1f} se"
    degrees = [f"{57.29578 * rms[name]:.4f}" for name in ("declared", "full", "noise_floor")]
    print(
        f"{seed:5d}  {hidden['effect']:17} {hidden['value']:<14.4g} {', '.join(result['found']) or '-':32} {off:>8}  "
        f"{result['verdict']:16} {degrees[0]:>9} {degrees[1]:>7} {degrees[2]:>7}   {wall:7.1f} "
        f"{figures['first_sample_s']:15.1f} {figures['frames_lost']:5d}",
        flush=True,
    )
    return result


if __name__ == "__main__":
    sys.exit(main())
