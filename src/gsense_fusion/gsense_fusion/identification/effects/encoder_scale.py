"""The encoder's metres are wrong, or the belt stretches between it and the carriage."""

from __future__ import annotations

from math import erfc, pi, sqrt

from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.recording.rail_scale import RailScale, rail_scale
from gsense_fusion.identification.types import Owner, Parameter

USUAL = 2e-3
"""A pulley's diameter and a belt's pitch are known to some tenths of a per cent; G is wrong by as much, and no more."""
USUAL_BELT_HZ = 20.0
"""A carriage on its belt rings at 20 to 50 Hz; one that would ring lower hangs on too soft a belt."""
SURE = 3.0
DECIDED = 5e-3
"""Standard error from which a scale of some per cent could be missed."""
ON_ITS_SIDES = "the board at rest on all six sides, on the carriage or beside it"


class EncoderScale(RecordedEffect):
    """What the encoder calls a metre: neither gyro nor attitude is corrected; G and all else per metre is off by it."""

    name = "encoder_scale"
    owner = Owner.REFERENCE
    equation = "s_encoder = (1 + scale) s; a = (1 + stretch w^2) a_encoder / (1 + scale)"
    source = "accelerometer against encoder, its own scale by gravity; tolerances of pulley and belt"

    def look(self, recording: Recording) -> Seen:
        """Acceleration felt over the encoder's, run by run."""
        campaign = recording.campaign
        if not any(r.run.has_rig for r in campaign.runs):
            return Seen(undecided=(f"{self.name} could not be decided: no encoder",))
        found = rail_scale(campaign)
        if found is None:
            reason = "no steady motion that an accelerometer feels"
            return Seen(undecided=(f"{self.name} could not be decided: {reason}",))
        wrong = abs(found.error) - SURE * found.error_stderr > USUAL
        soft = found.stretch - SURE * found.stretch_stderr > 1.0 / (2.0 * pi * USUAL_BELT_HZ) ** 2
        if wrong or soft:
            return Seen({self.name: _reading(found, wrong, soft)})
        if found.error_stderr > DECIDED:
            known = f"the accelerometer's own scale along the rail leaves {196 * found.error_stderr:.1g} % open"
            run = f"{ON_ITS_SIDES}, would decide"
            return Seen(undecided=(f"{self.name} could not be decided: {known}; {run}",))
        size, error = 100 * found.error, 196 * found.error_stderr
        return Seen(notes=(f"the encoder's scale agrees with gravity: {size:+.1f} % (+- {error:.1f} %)",))


def _reading(found: RailScale, wrong: bool, soft: bool) -> Reading:
    said, advice, p = [], [], 1.0
    if wrong:
        too = "much" if found.error > 0 else "little"
        said.append(f"the encoder reads {100 * abs(found.error):.2g} % too {too}")
        advice.append(f"divide the encoder's metres per count by {1.0 + found.error:.4f} (pulley, gear, lines)")
        p = _p(found.error, found.error_stderr)
    if soft:
        rings = 1.0 / (2.0 * pi * sqrt(found.stretch))
        said.append(f"the carriage moves further than the encoder, as on a belt that rings at {rings:.2g} Hz")
        advice.append("tighten or stiffen the belt, or put the encoder on the carriage")
        p = min(p, _p(found.stretch, found.stretch_stderr))
    curve = Curve(
        x=found.frequencies,
        measured=found.ratio[:, None],
        fitted=found.expected(found.frequencies)[:, None],
        series=(),
        x_label="frequency of the drive, rad/s",
        y_label="acceleration felt over the encoder's",
        how_to_read="Level and beside 1: the encoder's scale. Rising with the square of frequency: the belt stretches.",
    )
    parameters = {
        "scale": Parameter(found.error, found.error_stderr, "1"),
        "stretch": Parameter(found.stretch, found.stretch_stderr, "s^2"),
    }
    advice.append("until then every finding per metre, G among them, is wrong by as much")
    return Reading(parameters, (), p, " and ".join(said), "; ".join(advice), curve=curve)


def _p(value: float, stderr: float) -> float:
    return erfc(abs(value) / stderr / sqrt(2.0))
