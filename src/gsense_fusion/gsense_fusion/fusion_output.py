"""The messages that the filters publish."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .attitude.fusion import Estimate
from .bags.imu_message import with_attitude


@dataclass(frozen=True)
class Uncertainty:
    """Published standard deviations, rad."""

    inclination: float = 0.02
    heading: float = 0.1
    """With a magnetometer; without, the heading is only counted from the start and nothing is known of it."""

    def covariance(self, *, heading_known: bool) -> tuple[float, ...]:
        """`orientation_covariance`, row by row."""
        tilt = self.inclination**2
        turn = self.heading**2 if heading_known else float(np.pi**2)
        return (tilt, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0, turn)


def output_message(estimate: Estimate, covariance: bytes) -> bytes:
    """The Imu message of an estimate as CDR bytes: stamp, frame and specific force as measured.

    Args:
        estimate: its source is the `ImuMessage` of the sample.
        covariance: of the orientation, `packed`.
    """
    return with_attitude(estimate.source, estimate.quaternion.tolist(), covariance, estimate.angular_rate.tolist())
