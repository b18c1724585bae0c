"""IMU and encoder are stamped by clocks of different speed."""

from __future__ import annotations

from math import erfc, sqrt

from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.recording.clock import delay_over_time
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.types import Owner, Parameter

SOUND_CLOCKS = 5e-5
"""Two sound crystals of 25 ppm each differ by no more: a smaller skew is a note, it is taken out all the same."""


class ClockSkew(RecordedEffect):
    """t_imu = (1 + skew) t_encoder: corrected before the fit, mended by one clock for both."""

    name = "clock_skew"
    owner = Owner.CHAIN
    equation = "t_imu = (1 + skew) t_encoder + delay"
    source = "tolerance of crystals (20 to 50 ppm) and of the sensors' own oscillators (1 %)"

    def look(self, recording: Recording) -> Seen:
        """Skew in steady motion, accelerometer against encoder."""
        skew = recording.skew
        if skew is None:
            rig = any(r.has_rig for r in recording.clean)
            reason = "no steady motion that the accelerometer feels" if rig else "no encoder"
            return Seen(undecided=(f"{self.name} could not be decided: {reason}",))
        if not skew.sure:
            return Seen()
        ppm, error = 1e6 * skew.value, 1e6 * skew.stderr
        text = f"the IMU's clock runs {ppm:+.0f} ppm against the encoder's"
        if abs(skew.value) - 2.0 * skew.stderr < SOUND_CLOCKS:
            usual = "two clocks may differ by so much; taken out"
            return Seen(notes=(f"{text} (+- {1.96 * error:.0f} ppm): {usual}",))
        parameters = {"skew": Parameter(skew.value, skew.stderr, "1")}
        time, late = delay_over_time(recording.campaign)
        # the campaign's times are corrected already: what was taken out is put back
        line = skew.value * time
        curve = Curve(
            x=time,
            measured=(late + line)[:, None] * 1e3,
            fitted=line[:, None] * 1e3,
            series=(),
            x_label="time from the run's middle, s",
            y_label="IMU later than encoder, ms",
            how_to_read="Dots are pieces of the runs: one line through all is a skew of the clocks.",
        )
        advice = (
            "stamp IMU and encoder by one clock: chrony or PTP between two PCs, the driver's model of the board's clock"
        )
        p = erfc(abs(skew.value) / skew.stderr / sqrt(2.0))
        return Seen({self.name: Reading(parameters, (), p, text, advice, curve=curve)})
