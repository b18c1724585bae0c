"""Where the parameters of the filter `bounded` come from, and what they would be were they chosen by recordings.

    ./rig exec python tests/study/bounded.py [--trials 24] [--first-seed 0]

A coordinate search (each parameter times or over 2, then 1.4, until nothing gets better) for the least mean logarithm
of the inclination's rms over simulated trials (`handheld`), from a start that datasheets give. Its result, rounded to
one digit and a half, is the filter's defaults: no recording has been looked at. `leave_one_out` is the same search on
recordings, each judged by what the others gave; the bench `fusion_accuracy` prints both.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

import numpy as np  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.study.handheld import RATE_HZ, Handheld, handheld  # noqa: E402

from gsense_fusion.attitude.accuracy import ALIGNMENT_S, Reference, score  # noqa: E402
from gsense_fusion.attitude.bounded import Bounded, BoundedParameters  # noqa: E402
from gsense_fusion.attitude.initial import attitude_at_rest  # noqa: E402
from gsense_fusion.attitude.interface import FloatArray  # noqa: E402

Parameters = dict[str, float]
DEGREE = float(np.pi / 180)
START: Parameters = {
    "rate_density": 0.01 * DEGREE,  # noise of an MPU-6050 or BNO055
    "rate_scale": 0.005,  # half a per cent, as long as a turn lasts (0.5 s)
    "force_density": 0.003,  # noise of an MPU-6050
    "force_scale": 0.005,
    "bias_density": 0.001 * DEGREE,
    "velocity_density": 0.25,  # 0.3 m/s that change within 0.3 s: v sqrt(2 tau)
    "rest_bias_density": 0.01 * DEGREE,
}
FACTORS = (2.0, 1.4)


@dataclass(frozen=True, eq=False)
class Trial:
    """What the filter gets, and by what it is judged."""

    name: str
    dt: FloatArray
    angular_rate: FloatArray
    """rad/s, less the bias of the first second at rest."""
    specific_force: FloatArray
    start: FloatArray
    """Attitude at rest."""
    reference: Reference

    def inclination(self, parameters: Parameters) -> float:
        """Root mean square of the inclination's error from the first motion on, deg."""
        filter_ = Bounded(BoundedParameters(**parameters))
        filter_.quaternion = self.start
        found = filter_.batch(self.dt, self.angular_rate, self.specific_force)
        return float(np.degrees(score(found, self.reference, has_heading=False).inclination))


def trial_of(name: str, dt: FloatArray, rate: FloatArray, force: FloatArray, reference: Reference) -> Trial:
    """A trial whose first second is at rest."""
    first = np.cumsum(dt) <= 1.0
    return Trial(
        name, dt, rate - rate[first].mean(axis=0), force, attitude_at_rest(force[first].mean(axis=0)), reference
    )


def simulated(seed: int) -> Trial:
    """A trial of `handheld`."""
    made: Handheld = handheld(seed)
    n = len(made.moving)
    first = int(np.argmax(made.moving))
    index = np.arange(n)
    reference = Reference(made.orientation, index < min(first, ALIGNMENT_S * RATE_HZ), index >= first)
    return trial_of(f"seed {seed}", np.full(n, 1 / RATE_HZ), made.angular_rate, made.specific_force, reference)


def search(cost: Callable[[Parameters], float], told: Callable[[str], None] = lambda _: None) -> Parameters:
    """The parameters of least cost that steps along one parameter at a time reach from START."""
    best, least = dict(START), cost(START)
    for factor in FACTORS:
        better = True
        while better:
            better = False
            for name in START:
                for by in (factor, 1.0 / factor):
                    while (found := cost(tried := {**best, name: best[name] * by})) < least - 1e-4:
                        best, least, better = tried, found, True
            told(f"steps of {factor:g}: {least:.4f}")
    return best


Known = dict[tuple[str, tuple[float, ...]], float]
"""Trial and parameters -> logarithm of the inclination's rms."""


def cost_of(trials: Sequence[Trial], known: Known | None = None) -> Callable[[Parameters], float]:
    """Mean logarithm of the inclination's rms; trials are run once for the same parameters."""
    known = {} if known is None else known

    def one(trial: Trial, parameters: Parameters) -> float:
        key = (trial.name, tuple(float(f"{v:.6g}") for v in parameters.values()))
        if key not in known:
            known[key] = float(np.log(trial.inclination(parameters)))
        return known[key]

    return lambda parameters: float(np.mean([one(trial, parameters) for trial in trials]))


def leave_one_out(trials: Sequence[Trial]) -> Mapping[str, tuple[float, Parameters]]:
    """Each trial's inclination rms (deg) with the parameters that all others chose, and these."""
    found = {}
    known: Known = {}
    for out in trials:
        chosen = search(cost_of([trial for trial in trials if trial is not out], known))
        found[out.name] = (out.inclination(chosen), chosen)
    return found


def words(parameters: Parameters) -> str:
    """In the units of the filter's file: angles in degrees."""
    angles = ("rate_density", "bias_density", "rest_bias_density")
    return ", ".join(f"{k} {v / DEGREE if k in angles else v:.2g}" for k, v in parameters.items())


def main() -> int:
    parser = arguments("./rig exec python tests/study/bounded.py", __doc__)
    parser.add_argument("--trials", type=int, default=24, help="simulated motions")
    parser.add_argument("--first-seed", type=int, default=0, help="another one gives fresh sessions")
    options = parser.parse_args()
    trials = [simulated(seed) for seed in range(options.first_seed, options.first_seed + options.trials)]
    cost = cost_of(trials)
    chosen = search(cost, lambda text: print(text, file=sys.stderr, flush=True))
    defaults = {name: float(getattr(BoundedParameters(), name)) for name in START}
    for what, parameters in (("start", START), ("chosen", chosen), ("defaults", defaults)):
        print(f"{what:9}{np.exp(cost(parameters)):.4f} deg (geometric mean of {len(trials)}): {words(parameters)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
