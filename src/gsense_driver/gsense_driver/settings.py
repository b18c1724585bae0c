"""Parameters of the bridge: one table of names, defaults, ranges and meanings, and the typed settings made of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from gsense_driver.errors import SettingError
from gsense_driver.mounting import Mounting, parse_mounting
from gsense_driver.pipeline import PipelineSettings
from gsense_driver.samples import BNO, LISY, MPU, SENSORS
from gsense_driver.scaling import DEG, MPU_ACCEL_RANGES_G, MPU_GYRO_RANGES_DPS, G, ScaleSettings
from gsense_driver.text import DEFAULT_COLUMNS, parse_columns
from gsense_driver.transport import transport_delay
from gsense_driver.usb_port import parse_usb

Value = bool | int | float | str | list[str]


@dataclass(frozen=True)
class Parameter:
    """One parameter of the node."""

    name: str
    default: Value
    description: str
    low: float | None = None  # inclusive
    high: float | None = None
    choices: tuple[str | int, ...] = ()
    live: bool = False  # may change while the node is configured


@dataclass(frozen=True)
class SensorSettings:
    """How one sensor's messages look."""

    frame_id: str
    gyro_density: float  # rad/s/sqrt(Hz)
    accel_density: float  # m/s^2/sqrt(Hz); 0 where it has no accelerometer
    mounting: Mounting


@dataclass(frozen=True)
class Settings:
    """All parameters, checked."""

    port: str
    baud: int
    unit_id: str
    sensors: Mapping[str, SensorSettings]
    mag_stddev: float  # T
    orientation_stddev: float  # rad
    lisy_bandwidth_hz: float
    battery_frame_id: str
    raw_log: str  # path, empty: none
    pipeline: PipelineSettings
    values: Mapping[str, Value]  # the parameters that it was made of


def is_pseudo_terminal(real_path: str) -> bool:
    """Whether a port (symbolic links resolved) clocks no bits out, so that the board is a process on this host."""
    return real_path.startswith(("/dev/pts/", "loop://"))


def default_transport_delay(real_path: str, baud: int) -> float:
    """Default of `transport_delay`, s: computed for a radio and a line of `baud`; zero for a pseudo-terminal."""
    return 0.0 if is_pseudo_terminal(real_path) else transport_delay(baud)


def _sensor_parameters(sensor: str, gyro: float, accel: float | None) -> tuple[Parameter, ...]:
    density = "noise density of the"
    parameters = [
        Parameter(f"{sensor}.frame_id", f"{sensor}_link", "frame_id of the sensor's messages", live=True),
        Parameter(f"{sensor}.mounting", "x y z", "axes as a signed permutation; identity: the sensor's own", live=True),
        Parameter(f"{sensor}.gyro_noise_density", gyro, f"{density} gyro, rad/s/sqrt(Hz)", 0.0, 1.0, live=True),
    ]
    if accel is not None:
        name = f"{sensor}.accel_noise_density"
        parameters.append(Parameter(name, accel, f"{density} accelerometer, m/s^2/sqrt(Hz)", 0.0, 10.0, live=True))
    return tuple(parameters)


# The transport delay's default depends on port and baud: `default_transport_delay`.
PARAMETERS: tuple[Parameter, ...] = (
    Parameter("port", "/dev/ttyUSB0", "device, pseudo-terminal, pyserial URL, or usb:VID:PID[:SERIAL]"),
    Parameter("baud", 460800, "baud rate of the serial line", 1200, 4_000_000),
    Parameter("protocol", "binary", "frames of the radio, or the thesis's text lines", choices=("binary", "text")),
    Parameter("unit_id", "", "name of the sensor unit under test; goes into `link` and so into the bags", live=True),
    Parameter("raw_log", "", "file for every byte with its arrival time, empty: none; an existing one is kept"),
    Parameter("text.columns", list(DEFAULT_COLUMNS), "protocol text: what stands behind the counter; '-' is skipped"),
    Parameter("text.period", 0.04, "protocol text: nominal time from line to line, s", 1e-4, 10.0),
    Parameter("text.counter_bits", 16, "protocol text: width of the counter", 4, 32),
    *_sensor_parameters(MPU, 0.005 * DEG, 400e-6 * G),
    *_sensor_parameters(BNO, 0.014 * DEG, 150e-6 * G),
    *_sensor_parameters(LISY, 0.1 * DEG, None),
    Parameter("mpu6050.gyro_range_dps", 500, "deg/s, until STATUS", choices=MPU_GYRO_RANGES_DPS, live=True),
    Parameter("mpu6050.accel_range_g", 4, "g, until STATUS", choices=MPU_ACCEL_RANGES_G, live=True),
    Parameter(
        "bno055.gyro_lsb_per_dps",
        16.0,
        "LSB per deg/s of the raw rate; 16: by the data sheet and UNIT_SEL, other values are taken as they are",
        1.0,
        1000.0,
        live=True,
    ),
    Parameter("bno055.accel_lsb_per_mps2", 100.0, "LSB per m/s^2, until STATUS", 1.0, 1e4, live=True),
    Parameter("bno055.mag_lsb_per_ut", 16.0, "LSB per microtesla", 0.1, 1e4, live=True),
    Parameter("bno055.mag_stddev", 0.6e-6, "standard deviation of the magnetic field, T", 0.0, 1e-3, live=True),
    Parameter("bno055.orientation_stddev", 0.04, "of the chip's own fusion, per axis, rad", 0.0, math.pi, live=True),
    Parameter("lisy300.bandwidth_hz", 88.0, "-3 dB bandwidth of the analog output", 0.1, 1000.0, live=True),
    Parameter("battery.frame_id", "board", "frame_id of the battery's messages", live=True),
)
TRANSPORT_DELAY = "transport_delay"
TRANSPORT_DELAY_TEXT = (
    "constant time from the start of the MPU's read to the last serial byte, s; computed from burst, air time and baud"
)
LIVE = frozenset(parameter.name for parameter in PARAMETERS if parameter.live) | {TRANSPORT_DELAY}


def check(parameter: Parameter, value: Value) -> None:
    """Raise SettingError where a value is outside the parameter's choices or range."""
    if parameter.choices and value not in parameter.choices:
        known = ", ".join(str(choice) for choice in parameter.choices)
        raise SettingError(f"{parameter.name}: {value!r} is none of {known}")
    if parameter.low is None or parameter.high is None:
        return
    if not isinstance(value, (int, float)) or not parameter.low <= value <= parameter.high:
        raise SettingError(f"{parameter.name}: {value!r} is not within {parameter.low:g} to {parameter.high:g}")


def make_settings(values: Mapping[str, Value]) -> Settings:
    """Typed settings of parameter values by name; raises SettingError with one line that says which and why."""
    for parameter in PARAMETERS:
        check(parameter, values[parameter.name])
    delay = _number(values, TRANSPORT_DELAY)
    if not 0.0 <= delay <= 0.1:
        raise SettingError(f"{TRANSPORT_DELAY}: {delay!r} s is not within 0 to 0.1")
    port = str(values["port"]).strip()
    if not port:
        raise SettingError("port: is empty; give a device such as /dev/ttyUSB0 or a pyserial URL")
    parse_usb(port)
    sensors = {sensor: _sensor(values, sensor) for sensor in SENSORS}
    return Settings(
        port=port,
        baud=int(_number(values, "baud")),
        unit_id=str(values["unit_id"]),
        sensors=sensors,
        mag_stddev=_number(values, "bno055.mag_stddev"),
        orientation_stddev=_number(values, "bno055.orientation_stddev"),
        lisy_bandwidth_hz=_number(values, "lisy300.bandwidth_hz"),
        battery_frame_id=str(values["battery.frame_id"]),
        raw_log=str(values["raw_log"]).strip(),
        pipeline=_pipeline(values, {name: sensor.mounting for name, sensor in sensors.items()}, delay),
        values=dict(values),
    )


def _number(values: Mapping[str, Value], name: str) -> float:
    value = values[name]
    if not isinstance(value, (int, float)):
        raise SettingError(f"{name}: {value!r} is no number")
    return float(value)


def _sensor(values: Mapping[str, Value], sensor: str) -> SensorSettings:
    accel = f"{sensor}.accel_noise_density"
    return SensorSettings(
        frame_id=str(values[f"{sensor}.frame_id"]),
        gyro_density=_number(values, f"{sensor}.gyro_noise_density"),
        accel_density=_number(values, accel) if accel in values else 0.0,
        mounting=parse_mounting(str(values[f"{sensor}.mounting"]), f"{sensor}.mounting"),
    )


def _pipeline(values: Mapping[str, Value], mountings: Mapping[str, Mounting], delay: float) -> PipelineSettings:
    columns = values["text.columns"]
    if not isinstance(columns, (list, tuple)):
        raise SettingError("text.columns: give a list of column names")
    return PipelineSettings(
        protocol=str(values["protocol"]),
        transport_delay=delay,
        scales=ScaleSettings(
            mpu_gyro_range_dps=int(_number(values, "mpu6050.gyro_range_dps")),
            mpu_accel_range_g=int(_number(values, "mpu6050.accel_range_g")),
            bno_gyro_lsb_per_dps=_number(values, "bno055.gyro_lsb_per_dps"),
            bno_accel_lsb_per_mps2=_number(values, "bno055.accel_lsb_per_mps2"),
            bno_mag_lsb_per_ut=_number(values, "bno055.mag_lsb_per_ut"),
        ),
        mountings=mountings,
        text_columns=parse_columns(columns),
        text_period=_number(values, "text.period"),
        text_counter_bits=int(_number(values, "text.counter_bits")),
    )
