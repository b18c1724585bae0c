"""Samples that never arrived, or arrived twice in place of new ones."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.campaign import LONG_GAP_S
from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import Owner, Parameter

USUAL_PART = 0.01
"""A radio loses some frames, and interpolation hides them. With 1 % interpolated, white noise gains 1 % of its power at
low frequencies and lacks 2 % of it at 0.4 of the sample rate: as much as steady noise is taken to be known to
(`MODEL_ERROR` of the sufficiency tests)."""
SURE = 3.0
CURVE_POINTS = 200


class SampleLoss(RecordedEffect):
    """A part of the samples is missing or repeated."""

    name = "sample_loss"
    owner = Owner.CHAIN
    equation = "lost / (received + lost)"
    source = "stamps against a uniform grid, the board's frame counter, equal neighbours"

    def look(self, recording: Recording) -> Seen:
        """Missing and repeated samples of all runs together."""
        runs = recording.clean
        received = sum(r.stamps.received for r in runs)
        repeated = sum(r.stamps.repeated for r in runs)
        missing = sum(r.stamps.missing for r in runs)
        if not missing + repeated:
            return Seen()
        total = received + missing
        part = (missing + repeated) / total
        # gaps come independently, samples of one gap do not
        events = sum(r.stamps.gaps for r in runs) + repeated
        error = part / np.sqrt(events)
        text = _words(missing, repeated, total)
        if part - SURE * error < USUAL_PART:
            longest = max(r.stamps.longest_s for r in runs)
            gap = f", the longest gap {longest:.2f} s" if longest > LONG_GAP_S else ": as usual for a radio link"
            return Seen(notes=(f"{text}{gap}",))
        parameters = {
            "part": Parameter(part, float(error), "1"),
            "missing": Parameter(float(missing), 0.0, "1"),
            "repeated": Parameter(float(repeated), 0.0, "1"),
            "longest_gap_s": Parameter(max(r.stamps.longest_s for r in runs), 0.0, "s"),
        }
        links = [r.stamps.link for r in runs if r.stamps.link is not None]
        if links:
            parameters["link_lost"] = Parameter(float(sum(x.lost for x in links)), 0.0, "1")
        advice = _advice(missing, repeated, [x.lost for x in links])
        reading = Reading(parameters, (), 0.0, text, advice, curve=_over_time(runs, part))
        return Seen({self.name: reading})


def _words(missing: int, repeated: int, total: int) -> str:
    parts = [f"{missing} missing"] * (missing > 0) + [f"{repeated} repeated"] * (repeated > 0)
    return f"of {total} samples {' and '.join(parts)} ({100.0 * (missing + repeated) / total:.2g} %)"


def _advice(missing: int, repeated: int, link_lost: list[int]) -> str:
    if repeated > missing:
        return "read the sensor no faster than it samples, or wait for its data-ready signal"
    if link_lost and sum(link_lost) < 0.5 * missing:
        return "the frame counter misses few of them: they are lost behind the radio; look at the host's load"
    if link_lost:
        return "the frame counter misses them too: mend the radio (channel, distance, retransmissions)"
    return "find where they are lost: the link topic tells frames lost on the radio from samples lost on the host"


def _over_time(runs: tuple[CleanRun, ...], part: float) -> Curve:
    """Lost samples counted over the recorded time, and what an even loss would make."""
    lost = np.concatenate([~r.valid for r in runs]).astype(float)
    period = 1.0 / float(np.median([r.rate_hz for r in runs]))
    count = np.cumsum(lost)
    at = np.unique(np.linspace(0, len(count) - 1, CURVE_POINTS).astype(int))
    even = count[-1] * (at + 1) / len(count)
    return Curve(
        x=at * period,
        measured=count[at][:, None],
        fitted=even[:, None],
        series=(),
        x_label="recorded time, s",
        y_label="samples missing so far",
        how_to_read=f"A straight line is an even loss ({100 * part:.2g} %); steps are gaps.",
    )
