"""Set-up times: a fresh clone with an empty home folder, and again where everything is up to date.

./rig bench setup_time
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

from tests.developer import arguments  # noqa: E402

KEPT = ("PATH", "LANG", "LC_ALL", "http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY", "no_proxy", "NO_PROXY")
KEPT += ("SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "PIP_INDEX_URL", "PIP_CERT", "GSENSE_ROS_PREFIX")


def main() -> int:
    arguments("./rig bench setup_time", __doc__).parse_args()
    with tempfile.TemporaryDirectory(prefix="gsense-setup-") as name:
        clone, home = Path(name) / "gsense", Path(name) / "home"
        home.mkdir()
        subprocess.run(["git", "clone", "-q", "--no-hardlinks", str(ROOT), str(clone)], check=True)
        prefixes = os.environ.get("VIRTUAL_ENV", str(ROOT / ".rig" / "env"))
        environment = {k: v for k, v in os.environ.items() if k in KEPT} | {"HOME": str(home)}
        entries = environment["PATH"].split(os.pathsep)
        environment["PATH"] = os.pathsep.join(e for e in entries if not e.startswith((prefixes, str(ROOT))))
        print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
        for what in ("cold set-up (fresh clone, empty home)", "warm set-up (nothing to do)"):
            begun = time.monotonic()
            subprocess.run([str(clone / "rig"), "build"], env=environment, stdout=2, check=True)
            print(f"{what}: {time.monotonic() - begun:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
