"""Earth rate in the sensor's axes: all of it on a rail of known direction, its vertical part wherever up is known."""

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
    rail_azimuth_deg: float | None = None
    """Of the rail's positive direction, from north over east; None: not known."""

    @property
    def vertical_rate(self) -> float:
        """Earth rate about the upward vertical, rad/s."""
        return float(EARTH_RATE * np.sin(np.radians(self.latitude_deg)))

    def earth_rate_in_rail(self, azimuth_deg: float) -> FloatArray:
        """Earth rate in rail axes (x along the rail, z up), rad/s, shape (3,)."""
        latitude, azimuth = np.radians(self.latitude_deg), np.radians(azimuth_deg)
        north, up = EARTH_RATE * np.cos(latitude), self.vertical_rate
        # y of the rail is 90 degrees left of x seen from above: azimuth - 90 degrees
        return np.array([north * np.cos(azimuth), north * np.sin(azimuth), up])


def without_earth_rate(campaign: Campaign, site: Site) -> Campaign:
    """Subtract earth rate from every run; where the heading is not known, the vertical part, which looks like G."""

    def corrected(data: RunData) -> RunData:
        if data.mounting is None:
            return data
        rotation = data.mounting.sensor_from_rail
        if rotation is None or site.rail_azimuth_deg is None:
            earth = np.asarray(site.vertical_rate * data.mounting.up)
        else:
            earth = np.asarray(rotation @ site.earth_rate_in_rail(site.rail_azimuth_deg))
        return replace(data, run=replace(data.run, angular_rate=data.run.angular_rate - earth))

    return replace(campaign, runs=tuple(corrected(r) for r in campaign.runs))
