"""Once a second: from the pipeline's counts to the figures of `link` and `/diagnostics`."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

from gsense_driver.diagnostics import Figures, Health, assess
from gsense_driver.link import LinkCounts
from gsense_driver.pipeline import Pipeline
from gsense_driver.samples import SENSORS, SampleCounts
from gsense_driver.settings import Settings


@dataclass
class _Snapshot:
    """The counts at the last report."""

    time_ns: int
    bytes_in: int
    counts: LinkCounts
    samples: SampleCounts


class Reporter:
    """Takes differences between reports."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self._last = self._snapshot(0)

    def figures(self, settings: Settings, now_ns: int, port_problem: str | None) -> Figures:
        """Figures for the time since the last call; `now_ns` is of the steady clock of the arrivals."""
        pipeline, last = self._pipeline, self._last
        self._last = new = self._snapshot(now_ns)
        span_s = (now_ns - last.time_ns) * 1e-9 if last.time_ns else math.inf
        board, sampler = pipeline.sampler.board, pipeline.sampler
        silent_s = None if pipeline.last_frame_ns is None else (now_ns - pipeline.last_frame_ns) * 1e-9
        return Figures(
            port=settings.port,
            port_problem=port_problem,
            protocol=settings.pipeline.protocol,
            bytes_per_s=(new.bytes_in - last.bytes_in) / span_s,
            frames_per_s=(new.counts.received - last.counts.received) / span_s,
            silent_s=silent_s,
            counts=new.counts,
            lost_since=max(0, new.counts.lost - last.counts.lost),
            corrupt_since=new.counts.corrupt - last.counts.corrupt,
            rejects=dict(pipeline.rejects),
            clock_fixed=pipeline.clock.fixed,
            clock_skew_ppm=pipeline.clock.skew_ppm,
            clock_steps=pipeline.clock.steps,
            clock_offset_s=pipeline.host_offset_s(),
            held=pipeline.held,
            uptime_s=pipeline.uptime_s(),
            status=board.status,
            battery_v=board.battery_v,
            battery_low=board.battery_low,
            radio_given_up=board.radio_given_up,
            i2c_errors=board.i2c_errors,
            calib_stat=board.calib_stat,
            sample_rates={n: (new.samples.samples[n] - last.samples.samples[n]) / span_s for n in SENSORS},
            failed_since={n: new.samples.read_failed[n] - last.samples.read_failed[n] for n in SENSORS},
            read_failed=dict(sampler.counts.read_failed),
            repeated=sampler.counts.repeated,
            repeated_since=new.samples.repeated - last.samples.repeated,
        )

    def link_fields(self, figures: Figures) -> dict[str, float]:
        """The fields of LinkStatus that are no counts."""
        return {
            "rate_hz": figures.frames_per_s,
            "clock_offset_s": figures.clock_offset_s,
            "clock_skew_ppm": figures.clock_skew_ppm,
            "uptime_s": figures.uptime_s,
        }

    def health(self, figures: Figures) -> list[Health]:
        """Entries of `/diagnostics`."""
        samples = self._pipeline.sampler.counts.samples
        return assess(figures, frozenset(name for name in SENSORS if samples[name]))

    def _snapshot(self, now_ns: int) -> _Snapshot:
        pipeline = self._pipeline
        counts = copy.deepcopy(pipeline.sampler.counts)
        return _Snapshot(now_ns, pipeline.stream.bytes_in, pipeline.link.counts, counts)
