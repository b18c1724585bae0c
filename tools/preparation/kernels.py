"""Compiled numeric kernels: made once after a build, or the first live run would wait for the compiler."""

from __future__ import annotations

import os
import subprocess

from preparation import stamps, workspace
from preparation.checkout import Checkout
from preparation.errors import SetupError
from preparation.progress import step

STAMP = "kernels"
# Each in a process of its own, at the same time.
_COMMANDS = {
    "gsense_rig": "from gsense_rig.kernels import main; main()",
    "gsense_fusion": "import gsense_fusion.attitude.registry, gsense_fusion.bags, gsense_fusion.compensation",
}


def up_to_date(checkout: Checkout) -> bool:
    """Whether the kernels of the present sources are compiled."""
    return stamps.read(checkout.stamps, STAMP) == _fingerprint(checkout)


def _fingerprint(checkout: Checkout) -> str:
    return "\n".join(p.fingerprint for p in workspace.packages(checkout) if p.name in _COMMANDS)


def compile_all(checkout: Checkout) -> None:
    """Compile them.

    Raises:
        SetupError: a package does not run.
    """
    script = '. "$ROOT/tools/activate.sh" && exec python -c "$0"'
    environment = os.environ | {"ROOT": str(checkout.root)}
    with step("compilation of the numeric kernels"):
        running = [
            subprocess.Popen(["bash", "-c", script, code], env=environment, cwd=checkout.rig, stderr=subprocess.PIPE)
            for code in _COMMANDS.values()
        ]
        errors = [process.communicate()[1].decode(errors="replace").strip() for process in running]
    for process, error in zip(running, errors, strict=True):
        if process.returncode != 0:
            raise SetupError(f"the built packages do not run ({error.splitlines()[-1] if error else 'no message'})")
    stamps.write(checkout.stamps, STAMP, _fingerprint(checkout))
