"""The plant as an object: state, parameters, one call that advances it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.plant import dynamics, state
from gsense_rig.plant.parameters import PlantParameters

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Plant:
    """The simulated rail from the bridge's inputs to the carriage's motion. Knows no clock: it is told a time.

    Args:
        parameters: the physics.
        position: start [m].
        time: start [s].
        vector: where the state is kept, array with shape (STATE_SIZE,), overwritten; its own where None.
    """

    def __init__(
        self,
        parameters: PlantParameters | None = None,
        position: float = 0.0,
        time: float = 0.0,
        vector: NDArray[np.float64] | None = None,
    ) -> None:
        self.parameters = parameters or PlantParameters()
        self._p = dynamics.parameter_vector(self.parameters)
        self._state = np.zeros(state.STATE_SIZE) if vector is None else vector
        self._state[[state.POSITION, state.PULLEY]] = position
        self._state[state.TIME] = time
        dynamics.mark_sample(self._state)
        dynamics.settle_switches(self._state, self._p)

    @classmethod
    def continued(cls, parameters: PlantParameters, vector: NDArray[np.float64]) -> Plant:
        """Go on from a state vector, array with shape (STATE_SIZE,), changed in place from then on."""
        start = vector.copy()
        plant = cls(parameters, vector=vector)
        vector[:] = start
        return plant

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self._state[state.TIME])

    @property
    def position(self) -> float:
        """True position of the carriage [m]."""
        return float(self._state[state.POSITION])

    @property
    def velocity(self) -> float:
        """True velocity [m/s]."""
        return float(self._state[state.SPEED])

    @property
    def acceleration(self) -> float:
        """True acceleration [m/s²]."""
        return float(self._state[state.ACCELERATION])

    @property
    def encoder_position(self) -> float:
        """True position of the belt on the pulley, where the encoder is [m]; the belt's stretch away from position."""
        return float(self._state[state.PULLEY])

    @property
    def current(self) -> float:
        """True motor current [A]."""
        return float(self._state[state.CURRENT])

    @property
    def switches(self) -> tuple[bool, bool, bool, bool]:
        """Outputs of the left, centre, right and optical switch; true where they see the carriage."""
        s = self._state
        k = state.SWITCH
        return bool(s[k]), bool(s[k + 1]), bool(s[k + 2]), bool(s[k + 3])

    def replace_parameters(self, parameters: PlantParameters) -> None:
        """Change the physics in mid-run (a carriage that jams, a supply that sags)."""
        self.parameters = parameters
        self._p = dynamics.parameter_vector(parameters)

    def set_motion(self, position: float, velocity: float) -> None:
        """Put the carriage somewhere, moving (tests of stopping distances)."""
        self._state[[state.POSITION, state.PULLEY]] = position
        self._state[[state.SPEED, state.PULLEY_SPEED]] = velocity
        dynamics.mark_sample(self._state)
        dynamics.settle_switches(self._state, self._p)

    def advance(self, until: float, duty: float, disabled: bool) -> NDArray[np.float64]:
        """Advance to `until` [s]; array with shape (n, 5) as of `dynamics.advance`."""
        rows: NDArray[np.float64] = dynamics.advance(self._state, self._p, duty, disabled, until)
        return rows
