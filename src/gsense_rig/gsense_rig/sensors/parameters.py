"""Parameters of one simulated unit, drawn within the data sheets' limits.

Sources: InvenSense PS-MPU-6000A r3.4 (MPU-6050), Bosch BMI055 as proxy for the BNO055's inertial part, ST LISY300AL.
The unit follows the declared model: bias and g-sensitivity. Everything beyond that is an effect (`sensors.effects`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.sensors.constants import CYCLIC, DEGREE, STANDARD_GRAVITY

Array = npt.NDArray[np.float64]
DPS_PER_G = DEGREE / STANDARD_GRAVITY
"""(rad/s)/(m/s^2) in one deg/s/g."""


@dataclass(frozen=True)
class GyroParameters:
    """One gyro; arrays have shape (3,) or (3, 3), sensor axes."""

    bias: Array
    """rad/s."""
    matrix: Array
    """(3, 3) scale and misalignment: measured = matrix @ true. Identity is ideal."""
    g_sensitivity: Array
    """(3, 3), (rad/s)/(m/s^2): rows gyro axes, columns acceleration axes."""
    noise_density: float
    """White noise, (rad/s)/sqrt(Hz), one-sided."""
    flicker: float
    """Floor of the Allan deviation, rad/s."""
    random_walk: float
    """Rate random walk, (rad/s)/sqrt(s)."""


@dataclass(frozen=True)
class AccelerometerParameters:
    """One accelerometer; sensor axes."""

    bias: Array
    """(3,), m/s^2."""
    matrix: Array
    """(3, 3) scale and misalignment."""
    noise_density: float
    """(m/s^2)/sqrt(Hz), one-sided."""


@dataclass(frozen=True)
class MagnetometerParameters:
    """The BNO055's magnetometer."""

    hard_iron: Array
    """(3,), tesla."""
    matrix: Array
    """(3, 3) scale and soft iron."""
    noise: float
    """Standard deviation of one sample, tesla."""


@dataclass(frozen=True)
class ThermalParameters:
    """Die temperature: ambient + rise (1 - exp(-t / time_constant)) + wander, t from the board's start."""

    ambient: float
    """degC."""
    rise: float
    """K."""
    time_constant: float
    """s."""
    wander: float
    """Random walk of the ambient, K/sqrt(s)."""
    gyro_lag: float
    """s: the vibrating mass follows the temperature that the register shows with this first-order lag."""
    bno_offset: float
    """K: the BNO055's die against the MPU-6050's."""
    register_noise: float
    """K, standard deviation of one reading."""


@dataclass(frozen=True)
class SupplyParameters:
    """Regulator, converter and cell."""

    regulator: float
    """V: the converter's reference. Nominal 3.3."""
    converter_noise: float
    """LSB (10 bit), standard deviation of one conversion."""
    cell: float
    """V at the start of the session."""
    discharge: float
    """V/s."""


@dataclass(frozen=True)
class UnitParameters:
    """One board with its three chips."""

    seed: int
    mpu_gyro: GyroParameters
    bno_gyro: GyroParameters
    lisy_gyro: GyroParameters
    mpu_accelerometer: AccelerometerParameters
    bno_accelerometer: AccelerometerParameters
    magnetometer: MagnetometerParameters
    thermal: ThermalParameters
    supply: SupplyParameters
    clock_skew: float
    """The board's clock against the host's, relative (1e-6 is 1 ppm)."""
    mpu_clock_skew: float
    """The MPU-6050's own oscillator, relative. Drawn equal to the board's: a free one would repeat and skip samples."""
    bno_clock_skew: float
    """The BNO055's own oscillator, relative."""

    @property
    def gyros(self) -> tuple[GyroParameters, GyroParameters, GyroParameters]:
        """In the order of `drivers.Chip`."""
        return self.mpu_gyro, self.bno_gyro, self.lisy_gyro

    @classmethod
    def draw(cls, seed: int) -> UnitParameters:
        """The unit of this seed: the same seed is the same unit, whatever is done with it."""
        rng = np.random.default_rng([seed, 0x756E6974])
        skew = float(rng.uniform(-20e-6, 20e-6))
        return cls(
            seed=seed,
            mpu_gyro=_gyro(rng, bias=2.0, k=0.1, density=0.005, flicker=0.001, walk=1e-5),
            bno_gyro=_gyro(rng, bias=0.5, k=0.1, density=0.014, flicker=0.002, walk=2e-5),
            lisy_gyro=_gyro(rng, bias=3.0, k=0.1, density=0.05, flicker=0.01, walk=5e-5),
            mpu_accelerometer=_accelerometer(rng, bias=0.3, scale=0.005, density=400e-6),
            bno_accelerometer=_accelerometer(rng, bias=0.3, scale=0.005, density=150e-6),
            magnetometer=MagnetometerParameters(
                hard_iron=rng.normal(0.0, 4e-6, 3), matrix=_near_identity(rng, 0.01), noise=0.3e-6
            ),
            thermal=_thermal(rng),
            supply=SupplyParameters(
                regulator=3.3 * (1.0 + rng.uniform(-0.003, 0.003)),
                converter_noise=0.5,
                cell=rng.uniform(3.9, 4.15),
                discharge=rng.uniform(5e-6, 1.2e-5),
            ),
            clock_skew=skew,
            mpu_clock_skew=skew,
            bno_clock_skew=rng.uniform(-3e-3, 3e-3),
        )


def thesis_g_matrix(k: float) -> Array:
    """Eq. 7.4 as a matrix: rate_x += k a_y, rate_y += k a_z, rate_z += k a_x. Shape (3, 3), unit of k."""
    matrix = np.zeros((3, 3))
    matrix[np.arange(3), CYCLIC] = k
    return matrix


def _near_identity(rng: np.random.Generator, spread: float) -> Array:
    return np.eye(3) + rng.normal(0.0, spread, (3, 3))


def _gyro(
    rng: np.random.Generator, bias: float, k: float, density: float, flicker: float, walk: float
) -> GyroParameters:
    """Arguments in deg/s, deg/s/g, deg/s/sqrt(Hz), deg/s and deg/s/sqrt(s)."""
    cyclic = thesis_g_matrix(k * rng.uniform(0.6, 1.4))
    return GyroParameters(
        bias=rng.uniform(-bias, bias, 3) * DEGREE,
        matrix=_near_identity(rng, 0.005),
        g_sensitivity=(cyclic + rng.normal(0.0, 0.15 * k, (3, 3))) * DPS_PER_G,
        noise_density=density * DEGREE,
        flicker=flicker * rng.uniform(0.7, 1.3) * DEGREE,
        random_walk=walk * rng.uniform(0.5, 1.0) * DEGREE,
    )


def _accelerometer(rng: np.random.Generator, bias: float, scale: float, density: float) -> AccelerometerParameters:
    """Arguments in m/s^2, relative, g/sqrt(Hz)."""
    return AccelerometerParameters(
        bias=rng.uniform(-bias, bias, 3), matrix=_near_identity(rng, scale), noise_density=density * STANDARD_GRAVITY
    )


def _thermal(rng: np.random.Generator) -> ThermalParameters:
    return ThermalParameters(
        ambient=rng.uniform(20.0, 24.0),
        rise=rng.uniform(4.5, 7.0),
        time_constant=rng.uniform(90.0, 180.0),
        wander=0.002,
        gyro_lag=3.0,
        bno_offset=rng.uniform(0.5, 2.0),
        register_noise=0.03,
    )
