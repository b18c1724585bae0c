"""What each form of g-compensation costs: microseconds of processor time a sample, one update from Python and a batch.

./rig bench compensation_cost [--samples 200000]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.developer import arguments  # noqa: E402

from gsense_fusion.compensation import (  # noqa: E402
    CompensationFile,
    Compensator,
    FrictionPickup,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    JerkCoupling,
    ScaleMisalignment,
    SupplyVoltage,
    TemperatureBias,
    gather_inputs,
)

M = ((1e-3, 2e-5, -3e-4), (4e-4, -5e-4, 6e-4), (7e-4, 8e-4, 9e-4))
C, D = (1e-3, -2e-3, 3e-3), (1.0, 0.0, 0.0)
G, SQUARES, CUBES, SCALE = GSensitivity(matrix=M), GSquared(matrix=M), GCubed(matrix=M), ScaleMisalignment(M)
FORMS = {
    "none": CompensationFile("s"),
    "k": CompensationFile("s", terms=(GSensitivity(k=1e-4),)),
    "matrix": CompensationFile("s", terms=(G,)),
    "groves (18)": CompensationFile("s", terms=(G, SCALE)),
    "matrix_squares (18)": CompensationFile("s", terms=(G, SQUARES)),
    "groves_squares (27)": CompensationFile("s", terms=(G, SQUARES, SCALE)),
    "polynomial (27)": CompensationFile("s", terms=(G, SQUARES, CUBES)),
    "matrix, 12 ms late": CompensationFile("s", terms=(G,), gyro_delay_s=0.012),
    "matrix, temperature": CompensationFile("s", terms=(G, TemperatureBias(C, 25.0, 5.0))),
    "matrix, resonance": CompensationFile("s", terms=(G, GResonance(C, D, 12.0, 0.1))),
    "matrix, jerk": CompensationFile("s", terms=(G, JerkCoupling(c=C, direction=D))),
    "everything": CompensationFile(
        "s",
        terms=(
            G,
            SQUARES,
            CUBES,
            GResonance(C, D, 12.0, 0.1),
            JerkCoupling(c=C, direction=D),
            TemperatureBias(C, 25.0, 5.0),
            SupplyVoltage(C, 3.7),
            FrictionPickup(C),
            SCALE,
        ),
        gyro_delay_s=0.012,
    ),
}


def main() -> int:
    parser = arguments("./rig bench compensation_cost", __doc__)
    parser.add_argument("--samples", type=int, default=200_000, help="of one recording")
    n = parser.parse_args().samples
    rng = np.random.default_rng(0)
    stamp = np.arange(n, dtype=np.int64) * 5_000_000
    rate, force = rng.normal(size=(n, 3)), rng.normal(size=(n, 3)) * 5 + [0, 0, 9.8]
    slow = (stamp[::20], 25 + 0.1 * rng.normal(size=len(stamp[::20])))
    inputs = gather_inputs(stamp, slow, slow, slow)
    print(f"{'form':22s} {'update, us':>10s} {'batch, us':>10s}")
    for name, file in FORMS.items():
        live = Compensator(file)
        few = min(n, 20_000)
        start = time.process_time()
        for i in range(few):
            live.update(stamp[i], rate[i], force[i])
        update = (time.process_time() - start) / few
        whole = Compensator(file)
        start = time.process_time()
        whole.batch(stamp, rate, force, inputs)
        batch = (time.process_time() - start) / n
        print(f"{name:22s} {1e6 * update:10.2f} {1e6 * batch:10.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
