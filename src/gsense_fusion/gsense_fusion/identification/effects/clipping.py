"""An axis reaches the full scale of its range."""

from __future__ import annotations

from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.types import AXES, Owner, Parameter


class GyroClipping(RecordedEffect):
    """min(max(x, -level), level) of a gyro axis."""

    name = "gyro_clipping"
    owner = Owner.SENSOR
    equation = "min(max(x, -level), level)"
    source = "full scale of the sensor's range setting"

    def look(self, recording: Recording) -> Seen:
        """Axes whose extreme value is a full scale, again and again."""
        hits = [x for c in recording.clean for x in c.clipped if x.effect == self.name]
        if not hits:
            return Seen()
        level = max(x.level for x in hits)
        samples = sum(x.samples for x in hits)
        parameters = {
            "level": Parameter(level, 0.0, hits[0].unit),
            "samples": Parameter(float(samples), 0.0, "1"),
        }
        axes = tuple(x for i, x in enumerate(AXES) if any(h.axis == i for h in hits))
        text = f"{samples} samples stand at {level:.4g} {hits[0].unit} on {', '.join(axes)}"
        return Seen({self.name: Reading(parameters, axes, 0.0, text, "set a wider range of the sensor")})


class AccelClipping(GyroClipping):
    """The same of an accelerometer axis."""

    name = "accel_clipping"
