"""How much a recorder that is killed loses: SIGKILL in a live stream at 200 Hz, several times.

./rig bench recorder_kill [--kills 5]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_rig"), str(ROOT / "src" / "gsense_fusion")]

from tests.developer import arguments  # noqa: E402
from tests.rig.test_record import PUBLISHER, numbers, process, recorder  # noqa: E402

from gsense_fusion.bags import load_run  # noqa: E402
from gsense_rig.recording.repair import repair  # noqa: E402
from gsense_rig.recording.typestore import typestore  # noqa: E402


def main() -> int:
    parser = arguments("./rig bench recorder_kill", __doc__)
    parser.add_argument("--kills", type=int, default=5, help="of the recorder")
    kills = parser.parse_args().kills
    worst = 0.0
    for k in range(kills):
        with tempfile.TemporaryDirectory(prefix="gsense-kill-") as name:
            lost, samples = _kill(Path(name), 1.5 + 0.37 * k)
            worst = max(worst, lost)
            print(f"kill {k}: {samples} samples readable, the last one {lost:.2f} s before the kill")
    print(f"lost at most {worst:.2f} s before a kill (target: 1 s)")
    return 0 if worst < 1.0 else 1


def _kill(folder: Path, after: float) -> tuple[float, int]:
    """Seconds lost and samples kept, the same before and after the repair."""
    with process(*recorder("out:=bag"), cwd=folder) as record:
        assert record.stdout is not None
        record.stdout.readline()
        with process(str(PUBLISHER), "4000", "200", cwd=folder) as publisher:
            assert publisher.stdout is not None
            publisher.stdout.readline()
            time.sleep(after)
            killed = time.time_ns()
            record.kill()
            record.wait()
    received = load_run(folder / "bag", "mpu6050").imu.received_ns
    repair(folder / "bag", typestore())
    kept = numbers(folder / "bag")
    if kept != list(range(len(kept))):
        raise SystemExit("the repaired bag has holes")
    return (killed - int(received[-1])) * 1e-9, len(kept)


if __name__ == "__main__":
    os.environ.setdefault("PYTHONUNBUFFERED", "1")
    sys.exit(main())
