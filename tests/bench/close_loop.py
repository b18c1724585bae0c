"""`close_loop` at 200 Hz: from bags to report, and of that the analysis.

./rig bench close_loop [--turns 2]

Sessions are simulated by the rig's simulator: on the shipped plan `minimum`, 12.3 minutes in 19 runs with some of a
turned board, nothing undeclared, one effect, two; and two in a sweep of 11 minutes, one mounting. Wall time is that of
the whole command with the interpreter's start; processor time tells what a loaded machine hides. The analysis is
measured in the process, runs already read.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.developer import arguments  # noqa: E402

TWO = ("rail_curvature=0.002", "temperature_bias=0.0005")
SESSIONS = {
    "null": ("minimum", ()),
    "one effect": ("minimum", ("rail_curvature=0.002",)),
    "two effects": ("minimum", TWO),
    "two, sweep": ("sweep", TWO),
}
"""Plan and effects."""
FIT = (1.0, 1.5, 2.2, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
HELD_OUT = (1.25, 2.6, 3.5, 4.5, 6.5, 7.5)
SWEEP = [
    {"shape": "static", "duration": 75.0},
    *({"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 34.0} for w in FIT),
    *(
        {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 34.0, "role": "held_out"}
        for w in HELD_OUT
    ),
    {"shape": "static", "duration": 75.0},
]
"""Nine frequencies to fit, six held out, two rests: 11 minutes."""
SIMULATE = "import sys; from gsense_rig.simulate import main; sys.exit(main())"
ANALYSIS = """
import gc, sys, time
from pathlib import Path
from gsense_fusion.bags import load_run
from gsense_fusion.identification.engine import Settings, close_loop
from gsense_fusion.identification.types import Role
runs = [(load_run(Path(p), "mpu6050"), Role(role)) for role, p in (a.split("=", 1) for a in sys.argv[1:])]
gc.freeze()  # as the command does
wall, cpu = time.perf_counter(), time.process_time()
result = close_loop(runs, Settings("mpu6050"))
print(time.perf_counter() - wall, time.process_time() - cpu, ",".join(f.effect for f in result.findings) or "nothing")
"""


def main() -> int:
    """Print one line a session."""
    parser = arguments("./rig bench close_loop", __doc__)
    parser.add_argument("--turns", type=int, default=2, help="each session so often; the least time counts")
    turns = parser.parse_args().turns
    print(f"{'session':12} {'wall s':>7} {'cpu s':>7} {'analysis s':>11} {'its cpu s':>10}  found")
    with tempfile.TemporaryDirectory() as folder:
        sweep = Path(folder) / "sweep.yaml"
        sweep.write_text(yaml.safe_dump({"runs": SWEEP}), encoding="utf-8")
        for number, (name, (plan, effects)) in enumerate(SESSIONS.items()):
            path = str(sweep) if plan == "sweep" else plan
            bags = _simulated(path, Path(folder) / str(number), effects, seed=number + 3)
            whole = min(_whole(bags, Path(folder) / "out") for _ in range(turns))
            inside = min(_analysis(bags) for _ in range(turns))
            found = inside[2]
            print(f"{name:12} {whole[0]:7.1f} {whole[1]:7.1f} {inside[0]:11.1f} {inside[1]:10.1f}  {found}", flush=True)
    return 0


def _simulated(plan: str, out: Path, effects: tuple[str, ...], seed: int) -> list[tuple[str, Path]]:
    """Role and path of each bag."""
    command = [sys.executable, "-c", SIMULATE, plan, "--out", str(out), "--seed", str(seed)]
    subprocess.run([*command, *(x for e in effects for x in ("--effect", e))], check=True, stdout=subprocess.DEVNULL)
    index = yaml.safe_load((out / "index.yaml").read_text(encoding="utf-8"))
    return [(r["role"], out / r["bag"]) for r in index["runs"]]


def _whole(bags: list[tuple[str, Path]], out: Path) -> tuple[float, float]:
    """Wall and processor seconds of the command."""
    fit = [str(p) for role, p in bags if role == "fit"]
    held = [str(p) for role, p in bags if role != "fit"]
    before, start = _spent(), time.perf_counter()
    command = [sys.executable, "-m", "gsense_fusion.close_loop", "--fit", *fit, "--held-out", *held, "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start, _spent() - before


def _analysis(bags: list[tuple[str, Path]]) -> tuple[float, float, str]:
    """Wall and processor seconds of the analysis of runs that are read, and what it found."""
    command = [sys.executable, "-c", ANALYSIS, *(f"{role}={path}" for role, path in bags)]
    wall, cpu, found = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(wall), float(cpu), found


def _spent() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    sys.exit(main())
