"""The simulated board of a live rig: takes the carriage's motion from the control loop and feeds the sensor bus."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gsense_rig.sensors.bus import SensorBus, default_bus_path, images
from gsense_rig.sensors.layout import Array
from gsense_rig.sensors.mounting import Mounting
from gsense_rig.sensors.parameters import UnitParameters
from gsense_rig.sensors.unit import SensorUnit, UnitSpec


@dataclass(frozen=True)
class LiveFeedSpec:
    """What a loop process needs in order to make its feed; picklable."""

    unit: UnitSpec = field(default_factory=UnitSpec)
    bus_path: Path = field(default_factory=default_bus_path)


class LiveFeed:
    """Writes what the chips hold, an image a millisecond."""

    def __init__(self, spec: LiveFeedSpec) -> None:
        self._seed = spec.unit.unit_seed
        _refuse(spec.unit)
        _compile(spec.unit)
        # The host board's clock is this machine's: the chip's oscillator runs with it.
        parameters = replace(UnitParameters.draw(spec.unit.unit_seed), mpu_clock_skew=0.0)
        self._unit = SensorUnit(spec.unit, parameters)
        self.bus = SensorBus(spec.bus_path)

    def advance(self, history: Array) -> None:
        """Takes n steps of the carriage (n, 5: CLOCK_MONOTONIC s, position, velocity, acceleration, motor current)."""
        if history.shape[0] == 0:
            return
        config = self.bus.configuration()
        if config is not None:
            self._unit.configure(config)
        registers = self._unit.advance(history)
        self.bus.write(images(registers, fused=self._unit.config.bno.fuses), time.monotonic_ns())

    def mount(self, name: str) -> None:
        """Turns the board on the carriage; names as in a plan."""
        self._unit.mount(Mounting(name, seed=self._seed))

    def close(self) -> None:
        """Ends the bus."""
        self.bus.close()


def make_live_feed(spec: LiveFeedSpec) -> LiveFeed:
    """The feed, compiled and ready: its first `advance` takes no longer than the others."""
    return LiveFeed(spec)


def _refuse(spec: UnitSpec) -> None:
    """What lies behind the chips is no matter of their registers."""
    model = SensorUnit(spec).model
    for name, wanted, instead in (
        ("sample_loss", model.lost, "the board's fault injection"),
        ("clock_skew", model.clock_error, "simulate"),
        ("encoder_scale", model.encoder_scale, "simulate"),
    ):
        if wanted:
            raise ValueError(
                f"effect {name}: not on a live simulated rig, whose board and driver are real; use {instead}"
            )


def _compile(spec: UnitSpec) -> None:
    SensorUnit(spec).advance(np.zeros((2, 5)))
