"""Play in the bearings: the carriage turns within the first fraction of a millimetre after each reversal."""

from __future__ import annotations

from dataclasses import replace

from gsense_fusion.identification.effects.base import Drivers, TemplateSpec, spec
from gsense_fusion.identification.effects.fine import FineGrid, fine_motion
from gsense_fusion.identification.effects.reversals import Travel
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.kept import kept, once_for
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.types import ComplexArray, FloatArray

LONGEST_LAG_S = 0.05
DUCTILITY = "rock_ductility"
SLACK = "rock_slack"
SHAPES_KEPT = 3
"""Of each run's turn, while delays and lags are tried."""


class ReversalRock(TrueTurn):
    """True turn from -r to r about the rail's axes while the carriage travels the width after a reversal."""

    name = "reversal_rock"
    equation = "R r d/dt (1 - 2 exp(-travel / width)) sign(v)"
    wide_band = True
    source = "clearance of linear bearings: 0.01 deg"
    parameters = spec("r_x r_y r_z", "rad", 1e-3)
    templates = (
        TemplateSpec("width", "m", "rock_width_m", (5e-5, 2e-4, 5e-4, 1.5e-3, 4e-3), 1e-5, 0.01, 5e-4, default=5e-4),
    )

    fields = ("rock_lag_s", DUCTILITY, SLACK)

    def angle(self, drivers: Drivers) -> FloatArray:
        """The turn itself, from -1 to 1."""
        edges = _travel(drivers.kinematics, drivers.time).angle(_width(drivers), _ductility(drivers), _slack(drivers))
        return (edges[1:] + edges[:-1]) / 2

    def rate(self, drivers: Drivers) -> FloatArray:
        """Rate of the turn as the gyro's filter leaves it: it lasts less than a sample where the run is fast."""
        turn = _turn(drivers.kinematics if drivers.on_time is None else drivers.on_time, drivers)
        delay = 0.0 if drivers.on_time is None else drivers.templates.gyro_delay_s
        shape = _width(drivers), _ductility(drivers), _slack(drivers)
        return turn.rate(shape, delay, drivers.templates.get("rock_lag_s"))


class ContactLag(Shape):
    """The contacts give way with a time constant: the turn follows the travel late. It shapes the turn's own columns.

    Only a large play shows it; what the accelerometer feels of the turn changes too little to need it.
    """

    name = "reversal_rock_lag"
    shaped = ReversalRock
    equation = "the turn through 1 / (1 + lag d/dt)"
    source = "stiffness and damping of lubricated contacts: some milliseconds"
    templates = (
        TemplateSpec(
            "lag", "s", "rock_lag_s", (0.002, 0.005, 0.012), 0.0, LONGEST_LAG_S, 0.003, owns_effect=True, default=0.0
        ),
    )


class Contact(Shape):
    """How the contacts take up the load: Dahl's exponent, from an even slack (0) to an exponential (1) and beyond."""

    name = "reversal_rock_contact"
    shaped = ReversalRock
    equation = "u' = -u^ductility over the travel, for the way u to the other end"
    source = "Dahl, A Solid Friction Model, 1968"
    templates = (
        TemplateSpec("ductility", "", DUCTILITY, (0.0, 0.4, 0.8), 0.0, 2.0, 0.2, owns_effect=True, default=1.0),
    )


class BeltSlack(Shape):
    """The belt gives way first: the encoder turns with the motor, and the carriage stands until friction lets it go."""

    name = "reversal_rock_slack"
    shaped = ReversalRock
    equation = "the turn over the travel beyond a first part of it"
    source = "a belt of 150 N/mm under a friction of 3 N either way: 0.04 mm"
    templates = (TemplateSpec("slack", "", SLACK, (0.15, 0.35, 0.6), 0.0, 0.9, 0.1, owns_effect=True, default=0.0),)


@once_for
def _travel(kinematics: Kinematics, time: FloatArray) -> Travel:
    """The same for every width that is tried."""
    return Travel.of(time, kinematics.position, kinematics.velocity)


class _Turn:
    """The turn of a run on a grid between its samples, made once for each shape: what is late is so by its phase."""

    def __init__(self, drivers: Drivers) -> None:
        fine = fine_motion(drivers)
        self._grid = FineGrid(fine.per_sample, fine.step_s)
        self._travel = Travel.of(fine.time, fine.position, fine.velocity)
        self._response = drivers.response
        self._samples = len(drivers)
        self._spectrum = kept(SHAPES_KEPT, self._spectrum_of)
        self._gain: ComplexArray | None = None

    def rate(self, shape: tuple[float, float, float], delay_s: float, lag_s: float) -> FloatArray:
        """Its rate as the gyro's filter leaves it, late by a delay and a lag, 1/s, shape (n,).

        `shape`: width in m, ductility and slack.
        """
        spectrum = self._spectrum(*shape)
        if delay_s or lag_s:
            spectrum = spectrum * self._grid.late(spectrum, delay_s, lag_s)
        return self._grid.of_spectrum(spectrum, self._samples)

    def _spectrum_of(self, width: float, ductility: float, slack: float) -> ComplexArray:
        spectrum = self._grid.spectrum(self._travel.rate(width, ductility, slack))
        if self._gain is None:
            self._gain = self._grid.gain(spectrum, self._response, means=True)
        return spectrum * self._gain


@once_for
def _turn(kinematics: Kinematics, drivers: Drivers) -> _Turn:
    return _Turn(replace(drivers, kinematics=kinematics))


def _width(drivers: Drivers) -> float:
    return drivers.templates.get("rock_width_m", 5e-4)


def _ductility(drivers: Drivers) -> float:
    return drivers.templates.get(DUCTILITY, 1.0)


def _slack(drivers: Drivers) -> float:
    return drivers.templates.get(SLACK)
