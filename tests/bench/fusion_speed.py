"""Speed of the attitude filters on one core, beside imufusion, vqf, ahrs and filterpy's loop.

./rig bench fusion_speed [--samples 720000]

Per call: from Python, one sample in, attitude out (the peers' attitude read, too). Batch: arrays in, arrays out. Bag:
an hour at 200 Hz with rig topics, temperature and a reference, from the bag on disk to the table of `replay --no-bag`:
all filters, raw and compensated, scored.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from tests.developer import arguments  # noqa: E402

from gsense_fusion.attitude.registry import FILTERS  # noqa: E402
from gsense_fusion.bags import load_run  # noqa: E402
from gsense_fusion.bags.imu_writer import write_imu_bag  # noqa: E402
from gsense_fusion.compensation import CompensationFile, GSensitivity, write_compensation  # noqa: E402

G = 9.80665
RATE_HZ = 200


def best(work: Callable[[], Any], turns: int) -> float:
    """Least CPU time of several turns, s."""
    times = []
    for _ in range(turns):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def per_call(call: Callable[[], Any], count: int = 20000) -> float:
    """us of one call, without the loop around it."""

    def loop(work: Callable[[], Any]) -> None:
        for _ in range(count):
            work()

    return (best(lambda: loop(call), 15) - best(lambda: loop(lambda: None), 15)) / count * 1e6


def samples(n: int, seed: int = 1) -> tuple[Any, Any, Any]:
    rng = np.random.default_rng(seed)
    t = np.arange(n) / RATE_HZ
    rate = 0.5 * np.sin(t[:, None] * [0.7, 1.1, 0.3]) + rng.normal(size=(n, 3)) * 1e-3
    force = np.array([0.0, 0.0, G]) + np.sin(t[:, None] * [2.0, 3.0, 5.0]) + rng.normal(size=(n, 3)) * 0.04
    return np.full(n, 1 / RATE_HZ), rate, force


def calls() -> None:
    import imufusion
    from ahrs.filters import Madgwick as AhrsMadgwick
    from vqf import VQF

    dt, rate, force = 1 / RATE_HZ, np.array([0.01, -0.02, 0.03]), np.array([0.1, 0.2, 9.8])
    print("per call from Python, us (attitude handed back)")
    for name, kind in FILTERS.items():
        made = kind.make(kind.parameters())
        print(f"  {name:22} {per_call(lambda made=made: made.update(dt, rate, force)):8.3f}")
    fusion = imufusion.Ahrs()
    fusion.set_sample_period(dt)

    def of_imufusion() -> Any:
        fusion.update_no_magnetometer(rate, force)
        return fusion.get_quaternion()

    library = VQF(dt)

    def of_vqf() -> Any:
        library.update(rate, force)
        return library.getQuat6D()

    other = AhrsMadgwick(frequency=RATE_HZ)
    q = np.array([1.0, 0.0, 0.0, 0.0])
    print(f"  {'imufusion':22} {per_call(of_imufusion):8.3f}")
    print(f"  {'vqf (library)':22} {per_call(of_vqf):8.3f}")
    print(f"  {'ahrs Madgwick':22} {per_call(lambda: other.updateIMU(q, rate, force), 1000):8.3f}")


def batches(n: int) -> None:
    from vqf import VQF

    dt, rate, force = samples(n)
    print(f"batch of {n} samples, us a sample")
    for name, kind in FILTERS.items():
        made = kind.make(kind.parameters())
        print(f"  {name:22} {best(lambda made=made: made.batch(dt, rate, force), 5) / n * 1e6:8.4f}")
    print(f"  {'vqf (library)':22} {best(lambda: VQF(1 / RATE_HZ).updateBatch(rate, force), 3) / n * 1e6:8.4f}")


def kalman_beside_filterpy(n: int = 4000) -> None:
    from scipy.spatial.transform import Rotation
    from tests.fusion import filter_oracles

    dt, rate, force = samples(n)
    ours = FILTERS["kalman"].make(FILTERS["kalman"].parameters())
    found = ours.batch(dt, rate, force)
    oracle = filter_oracles.Kalman(Rotation.identity())
    begin = time.process_time()
    loop = [oracle.step(dt[i], rate[i], force[i], None).as_quat(canonical=True) for i in range(n)]
    seconds = time.process_time() - begin
    bare = [filter_oracles.axis_filter(oracle.p) for _ in range(3)]
    begin = time.process_time()
    for i in range(n):  # filterpy alone: predict and update of three axes
        for axis, kf in enumerate(bare):
            filter_oracles.predict(kf, oracle.p, dt[i], rate[i, axis])
            kf.update(0.0, R=oracle.p.angle_deviation**2)
    alone = time.process_time() - begin
    made = FILTERS["kalman"].make(FILTERS["kalman"].parameters())
    fast = best(lambda: made.batch(dt, rate, force), 20)
    theirs = np.array(loop)[:, [3, 0, 1, 2]]
    apart = np.abs(theirs - found * np.sign(found[:, :1])).max()
    print(
        f"Kalman batch beside filterpy's loop: {alone / fast:.0f} times faster than its predict and update alone,",
        end="",
    )
    print(f" {seconds / fast:.0f} than the whole loop; largest difference {apart:.1e}")


def reading(folder: Path, n: int) -> None:
    """An hour on the disk, read by gsense and by a rosbags deserialize loop."""
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    _, rate, force = samples(n)
    numbers = np.zeros((n, 37))
    numbers[:, 3], numbers[:, 4] = 1.0, -1.0
    numbers[:, 13:16], numbers[:, 25:28] = rate, force
    numbers[: 5 * RATE_HZ, 13:16], numbers[: 5 * RATE_HZ, 25:28] = 0.001, (0.0, 0.0, G)
    stamps = 1_760_000_000_000_000_000 + np.arange(n) * (1_000_000_000 // RATE_HZ)
    bag = folder / "hour"
    write_imu_bag(bag, stamps, stamps, "imu_link", {"/mpu6050/imu/data_raw": numbers})
    run = load_run(bag, "mpu6050")
    ours = best(lambda: load_run(bag, "mpu6050"), 2)
    store = get_typestore(Stores.ROS2_JAZZY)
    rates = np.empty((n, 3))
    begin = time.process_time()
    with Reader(bag) as reader:
        for i, (connection, _, data) in enumerate(reader.messages()):
            message: Any = store.deserialize_cdr(data, connection.msgtype)
            v = message.angular_velocity
            rates[i] = v.x, v.y, v.z
    loop = time.process_time() - begin
    same = np.array_equal(rates, run.imu.angular_rate)
    print(
        f"reading {n} Imu messages: {ours:.2f} s, a rosbags deserialize loop {loop:.2f} s: {loop / ours:.1f} times",
        end="",
    )
    print(f" faster, output {'equal' if same else 'DIFFERENT'}")


def hour(folder: Path, n: int) -> None:
    """The command itself, on one core, with its start."""
    from tests.fusion.hour_bag import write_hour

    bag = folder / "hour_on_the_rig"
    write_hour(bag, n, RATE_HZ)
    file = folder / "compensation.yaml"
    write_compensation(file, CompensationFile("mpu6050", terms=(GSensitivity(k=1.8e-4),)))
    command = [sys.executable, "-m", "gsense_fusion.replay", str(bag), "--compensation", str(file), "--no-bag"]
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [*command, "--out", str(folder / "out")], check=True, env=os.environ | threads | {"PYTHONPATH": path}
    )
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - begin
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    print(f"{n} samples at {RATE_HZ} Hz with rig topics and reference, from bag to table, ", end="")
    print(f"{len(FILTERS)} filters, raw and compensated: ", end="")
    print(f"{cpu:.1f} s of CPU, {wall:.1f} s in all")


def main() -> int:
    parser = arguments("./rig bench fusion_speed", __doc__)
    parser.add_argument("--samples", type=int, default=720_000, help="of one recording")
    options = parser.parse_args()
    calls()
    batches(options.samples)
    kalman_beside_filterpy()
    with tempfile.TemporaryDirectory() as folder:
        reading(Path(folder), options.samples)
        hour(Path(folder), options.samples)
    return 0


if __name__ == "__main__":
    sys.exit(main())
