"""Topics of the sensor that a node's parameter names: a name of ours, or any publisher of sensor_msgs/Imu."""

from __future__ import annotations

from dataclasses import dataclass

_RAW = "/imu/data_raw"


@dataclass(frozen=True)
class SensorTopics:
    """Where a node listens, and the name under which it publishes."""

    name: str
    """`mpu6050`, relative; `/vectornav/imu`, absolute. Prefix of outputs, and the name in a compensation file."""
    imu: str
    mag: str
    temperature: str
    own: str
    """Orientation by the sensor itself: in a whole topic's own messages."""

    @classmethod
    def of(cls, sensor: str) -> SensorTopics:
        """From the parameter `sensor`: a name (`mpu6050`), or a whole topic, which begins with a slash (`/imu`).

        A whole topic that ends in `imu/data_raw` belongs to a sensor of that prefix, and brings its other topics along.
        Else field and temperature are expected beside it, as `<parent>/mag` and `<parent>/temperature`: remap these.

        Raises:
            ValueError: it names nothing.
        """
        wanted = sensor.strip()
        name = wanted.rstrip("/")
        if not name.strip("/"):
            raise ValueError(f"parameter sensor: a sensor's name or a whole topic is needed, not {sensor!r}")
        if not name.startswith("/"):
            return cls._named(name)
        if name.endswith(_RAW) and name != _RAW:
            return cls._named(name.removesuffix(_RAW))
        parent = name.rpartition("/")[0]
        return cls(name, imu=name, mag=f"{parent}/mag", temperature=f"{parent}/temperature", own=name)

    @classmethod
    def _named(cls, name: str) -> SensorTopics:
        return cls(name, f"{name}{_RAW}", f"{name}/imu/mag", f"{name}/temperature", f"{name}/imu/data")
