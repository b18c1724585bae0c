"""Readings to ROS messages. The messages are made once and filled anew: publishing serialises them at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from gsense_msgs.msg import LinkStatus, Topics
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, MagneticField, Temperature

from gsense_driver.covariances import NOT_REPORTED, UNKNOWN_AXIS, diagonal, white_noise_variance
from gsense_driver.diagnostics import Health
from gsense_driver.link import LinkCounts
from gsense_driver.mounting import Vector
from gsense_driver.pipeline import PipelineSettings
from gsense_driver.samples import (
    BNO,
    LISY,
    MPU,
    SENSORS,
    BatteryReading,
    FieldReading,
    ImuReading,
    OrientationReading,
    Reading,
    TemperatureReading,
)
from gsense_driver.scaling import Scales
from gsense_driver.settings import Settings

_NAN = float("nan")
_IMU_DEPTH = 2500  # 5 s at 500 Hz: Fast DDS repairs what a busy subscriber missed at its heartbeat, every 3 s


def qos(depth: int) -> QoSProfile:
    """Reliable, volatile, keep last."""
    return QoSProfile(
        reliability=QoSReliabilityPolicy.RELIABLE,
        durability=QoSDurabilityPolicy.VOLATILE,
        history=QoSHistoryPolicy.KEEP_LAST,
        depth=depth,
    )


def set_stamp(message: Any, stamp_ns: int) -> None:
    """Write a time in ns into a message's header."""
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(stamp_ns, 1_000_000_000)


def reported(sensor: str, settings: PipelineSettings) -> tuple[bool, bool]:
    """Whether a sensor's raw message carries a rate, and whether it carries a specific force."""
    if sensor == LISY:
        return True, False
    if settings.protocol != "text":
        return True, True
    columns = settings.text_columns
    return tuple(all(f"{sensor}.{kind}{axis}" in columns for axis in "xyz") for kind in "ga")  # type: ignore[return-value]


class Messages:
    """Publishers and messages of the node's topics; `publish` takes a reading of any kind."""

    def __init__(self, create: Callable[[type, str, QoSProfile], Any]) -> None:
        """`create`: of a node, `create_publisher` or `create_lifecycle_publisher`."""
        self._raw = {sensor: create(Imu, f"{sensor}/{Topics.IMU_RAW}", qos(_IMU_DEPTH)) for sensor in SENSORS}
        self._fused = create(Imu, Topics.BNO055_IMU, qos(_IMU_DEPTH))
        self._mag = create(MagneticField, Topics.BNO055_IMU_MAG, qos(100))
        self._temperature = {name: create(Temperature, f"{name}/{Topics.TEMPERATURE}", qos(50)) for name in (MPU, BNO)}
        self._battery = create(BatteryState, Topics.BATTERY, qos(10))
        self._link = create(LinkStatus, Topics.LINK, qos(10))
        self._diagnostics = create(DiagnosticArray, Topics.DIAGNOSTICS, qos(20))
        self.publishers = (*self._raw.values(), self._fused, self._mag, *self._temperature.values())
        self.publishers += (self._battery, self._link, self._diagnostics)
        self._imu = {sensor: Imu() for sensor in SENSORS}
        self._fused_message = Imu()
        self._mag_message = MagneticField()
        self._temperature_message = {name: Temperature() for name in (MPU, BNO)}
        self._battery_message = BatteryState()
        self._send: dict[type, Callable[[Any], None]] = {
            ImuReading: self._send_imu,
            OrientationReading: self._send_orientation,
            FieldReading: self._send_field,
            TemperatureReading: self._send_temperature,
            BatteryReading: self._send_battery,
        }
        self._fill_battery()

    def configure(self, settings: Settings, scales: Scales) -> None:
        """Write frame ids and covariances, which change with parameters and with the board's configuration."""
        mpu, bno, lisy = (settings.sensors[name] for name in (MPU, BNO, LISY))
        variance = white_noise_variance
        gyro = {
            MPU: (variance(mpu.gyro_density, scales.mpu_gyro_bandwidth_hz),) * 3,
            BNO: (variance(bno.gyro_density, scales.bno_gyro_bandwidth_hz),) * 3,
            LISY: (UNKNOWN_AXIS, UNKNOWN_AXIS, variance(lisy.gyro_density, settings.lisy_bandwidth_hz)),
        }
        accel = {
            MPU: variance(mpu.accel_density, scales.mpu_accel_bandwidth_hz),
            BNO: variance(bno.accel_density, scales.bno_accel_bandwidth_hz),
        }
        for sensor, message in self._imu.items():
            own = settings.sensors[sensor]
            rate: Vector = own.mounting.apply_variances(gyro[sensor])
            message.header.frame_id = own.frame_id
            message.orientation_covariance = diagonal(NOT_REPORTED, 0.0, 0.0)
            has_rate, has_force = reported(sensor, settings.pipeline)
            force = accel.get(sensor, 0.0)
            none = diagonal(NOT_REPORTED, 0.0, 0.0)
            message.angular_velocity_covariance = diagonal(*rate) if has_rate else none
            message.linear_acceleration_covariance = diagonal(force, force, force) if has_force else none
        fused, angle = self._fused_message, settings.orientation_stddev**2
        fused.header.frame_id = bno.frame_id
        fused.orientation_covariance = diagonal(angle, angle, angle)
        fused.angular_velocity_covariance = diagonal(NOT_REPORTED, 0.0, 0.0)
        fused.linear_acceleration_covariance = diagonal(accel[BNO], accel[BNO], accel[BNO])
        field = settings.mag_stddev**2
        self._mag_message.header.frame_id = bno.frame_id
        self._mag_message.magnetic_field_covariance = diagonal(field, field, field)
        for name, temperature in self._temperature_message.items():
            temperature.header.frame_id = settings.sensors[name].frame_id
        self._battery_message.header.frame_id = settings.battery_frame_id

    def publish(self, reading: Reading) -> None:
        """Publish one reading."""
        self._send[type(reading)](reading)

    def publish_link(self, now_ns: int, counts: LinkCounts, figures: dict[str, float], unit_id: str) -> None:
        """Publish LinkStatus; `figures` by the message's field names."""
        message = LinkStatus(unit_id=unit_id, **vars(counts), **figures)
        set_stamp(message, now_ns)
        self._link.publish(message)

    def publish_health(self, now_ns: int, prefix: str, hardware_id: str, entries: list[Health]) -> None:
        """Publish `/diagnostics`, names prefixed by node and namespace."""
        message = DiagnosticArray()
        set_stamp(message, now_ns)
        for entry in entries:
            message.status.append(
                DiagnosticStatus(
                    level=bytes([entry.level]),
                    name=f"{prefix}: {entry.task}",
                    message=entry.message,
                    hardware_id=hardware_id,
                    values=[KeyValue(key=key, value=value) for key, value in entry.values.items()],
                )
            )
        self._diagnostics.publish(message)

    def _send_imu(self, reading: ImuReading) -> None:
        sensor, stamp_ns, rate, force = reading
        message = self._imu[sensor]
        set_stamp(message, stamp_ns)
        if rate is not None:
            v = message.angular_velocity
            v.x, v.y, v.z = rate
        if force is not None:
            a = message.linear_acceleration
            a.x, a.y, a.z = force
        self._raw[sensor].publish(message)

    def _send_orientation(self, reading: OrientationReading) -> None:
        message = self._fused_message
        set_stamp(message, reading.stamp_ns)
        q, a = message.orientation, message.linear_acceleration
        q.w, q.x, q.y, q.z = reading.quaternion
        a.x, a.y, a.z = reading.force
        self._fused.publish(message)

    def _send_field(self, reading: FieldReading) -> None:
        message = self._mag_message
        set_stamp(message, reading.stamp_ns)
        field = message.magnetic_field
        field.x, field.y, field.z = reading.field
        self._mag.publish(message)

    def _send_temperature(self, reading: TemperatureReading) -> None:
        message = self._temperature_message[reading.sensor]
        set_stamp(message, reading.stamp_ns)
        message.temperature = float(reading.celsius)
        self._temperature[reading.sensor].publish(message)

    def _fill_battery(self) -> None:
        message = self._battery_message
        message.temperature = message.current = message.charge = message.capacity = _NAN
        message.design_capacity = message.percentage = _NAN
        message.power_supply_status = BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
        message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_LION
        message.present = True

    def _send_battery(self, reading: BatteryReading) -> None:
        message = self._battery_message
        set_stamp(message, reading.stamp_ns)
        message.voltage = reading.volts
        message.cell_voltage = [reading.volts]
        dead, good = BatteryState.POWER_SUPPLY_HEALTH_DEAD, BatteryState.POWER_SUPPLY_HEALTH_GOOD
        message.power_supply_health = dead if reading.low else good
        self._battery.publish(message)
