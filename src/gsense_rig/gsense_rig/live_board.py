"""The simulated board of a live rig, as a recipe: its physics is imported only in the loop process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gsense_rig.loop.spec import SensorFeed


@dataclass(frozen=True)
class SimulatedBoard:
    """Makes the feed that writes the board's sensor bus; picklable.

    Raises (when called):
        ValueError: an effect or a mounting that is unknown; the message is one line.
    """

    unit_seed: int = 1  # draws the unit: biases, g-sensitivity, temperatures
    noise_seed: int = 1
    effects: tuple[str, ...] = ()  # NAME=VALUE each
    mounting: str = "0"
    bus: Path | None = None  # None: the board's default

    def __call__(self) -> SensorFeed:
        """Import the physics, compile it, open the bus."""
        from gsense_rig.sensors.bus import default_bus_path  # noqa: PLC0415
        from gsense_rig.sensors.live import LiveFeedSpec, make_live_feed  # noqa: PLC0415
        from gsense_rig.sensors.unit import UnitSpec  # noqa: PLC0415

        unit = UnitSpec(
            unit_seed=self.unit_seed, noise_seed=self.noise_seed, effects=self.effects, mounting=self.mounting
        )
        return make_live_feed(LiveFeedSpec(unit=unit, bus_path=self.bus or default_bus_path()))
