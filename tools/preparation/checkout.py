"""Where things lie in a checkout."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Checkout:
    """The folders of one checkout. All that is prepared lies in .rig/, build/, install/ and log/."""

    root: Path

    @property
    def rig(self) -> Path:
        """Folder of the environment, stamps, caches and logs."""
        return self.root / ".rig"

    @property
    def env(self) -> Path:
        """The virtual environment."""
        return self.rig / "env"

    @property
    def python(self) -> Path:
        """The virtual environment's interpreter."""
        return self.env / "bin" / "python"

    @property
    def stamps(self) -> Path:
        """Folder of the stamps: one file for each thing that is up to date."""
        return self.rig / "stamps"

    @property
    def logs(self) -> Path:
        """Folder of pip's, apt's and ROS's logs."""
        return self.rig / "log"

    @property
    def requirements(self) -> Path:
        """Folder of the pinned requirements."""
        return self.root / "tools" / "requirements"
