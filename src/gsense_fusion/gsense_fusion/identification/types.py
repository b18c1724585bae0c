"""Small shared types of the identification."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]
"""Any float: numpy's own functions do not promise more."""
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Int8Array = NDArray[np.int8]

AXES = ("x", "y", "z")
GRAVITY = 9.80665
"""Standard gravity in m/s^2."""


class IdentificationError(Exception):
    """The input cannot be analysed; the message is one line that names it and says what to do."""


class Role(str, Enum):
    """What a run is used for."""

    FIT = "fit"
    HELD_OUT = "held_out"


class Owner(str, Enum):
    """Who must be corrected: the sensor, its mount, the rig's reference, the chain (timing, supply) or the encoder."""

    SENSOR = "sensor"
    MOUNT = "mount"
    RIG = "rig"
    CHAIN = "chain"
    REFERENCE = "reference"


@dataclass(frozen=True)
class Parameter:
    """An estimated parameter with its standard error and unit."""

    value: float
    stderr: float
    unit: str
    in_doubt: bool = False
    """The effect as a whole is not significant; then none of its parameters is."""
    fitted_stderr: float | None = None
    """The part of `stderr` that is the fit's, where another cause may share in the value: that it is there is sure."""

    @property
    def significant(self) -> bool:
        """Whether a two-sided 1 % test rejects zero."""
        if self.in_doubt:
            return False
        error = self.stderr if self.fitted_stderr is None else self.fitted_stderr
        return bool(abs(self.value) > 2.576 * error) if error > 0 else self.value != 0.0
