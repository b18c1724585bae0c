"""Earth rate in the sensor's axes where the rig's place and direction are known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.types import FloatArray

EARTH_RATE = 7.292115e-5
"""rad/s (thesis eq. 2.1)."""


@dataclass(frozen=True)
class Site:
    """Where the rig stands."""

    latitude_deg: float
    rail_azimuth_deg: float
    """Of the rail's positive direction, from north over east."""

    def earth_rate_in_rail(self) -> FloatArray:
        """Earth rate in rail axes (x along the rail, z up), rad/s, shape (3,)."""
        latitude, azimuth = np.radians(self.latitude_deg), np.radians(self.rail_azimuth_deg)
        north, up = EARTH_RATE * np.cos(latitude), EARTH_RATE * np.sin(latitude)
        # y of the rail is 90 degrees left of x seen from above: azimuth - 90 degrees
        return np.array([north * np.cos(azimuth), north * np.sin(azimuth), up])


def without_earth_rate(campaign: Campaign, site: Site) -> Campaign:
    """Subtract earth rate from every run whose mounting on the rail is known."""
    earth = site.earth_rate_in_rail()

    def corrected(data: RunData) -> RunData:
        rotation = None if data.mounting is None else data.mounting.sensor_from_rail
        if rotation is None:
            return data
        return replace(data, run=replace(data.run, angular_rate=data.run.angular_rate - rotation @ earth))

    return replace(campaign, runs=tuple(corrected(r) for r in campaign.runs))
