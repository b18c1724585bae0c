import pytest

from gsense_driver.errors import SettingError
from gsense_driver.settings import PARAMETERS, TRANSPORT_DELAY, default_transport_delay, make_settings
from gsense_driver.transport import delays_by_type, transport_delay


def values(**changes):
    out = {parameter.name: parameter.default for parameter in PARAMETERS}
    out[TRANSPORT_DELAY] = 0.002
    return {**out, **{name.replace("__", "."): value for name, value in changes.items()}}


def test_defaults_are_those_of_the_contract():
    settings = make_settings(values())
    assert settings.baud == 460800
    assert settings.pipeline.protocol == "binary"
    assert settings.pipeline.scales.bno_gyro_lsb_per_dps == 16.0
    assert settings.pipeline.scales.mpu_gyro_range_dps == 500
    assert settings.pipeline.scales.mpu_accel_range_g == 4
    assert all(sensor.mounting.identity for sensor in settings.sensors.values())


@pytest.mark.parametrize(
    "change",
    [
        {"port": " "},
        {"baud": 0},
        {"protocol": "morse"},
        {"transport_delay": -1.0},
        {"transport_delay": float("nan")},
        {"mpu6050__mounting": "y x z"},
        {"mpu6050__gyro_range_dps": 300},
        {"bno055__gyro_lsb_per_dps": 0.0},
        {"mpu6050__gyro_noise_density": float("nan")},
        {"text__columns": ["who"]},
    ],
)
def test_bad_values_are_refused_by_name(change):
    (name,) = change
    with pytest.raises(SettingError, match=name.replace("__", r"\.")) as caught:
        make_settings(values(**change))
    assert "\n" not in str(caught.value)


def test_transport_delay_is_computed_from_burst_air_and_baud():
    fast, slow = transport_delay(460800), transport_delay(115200)
    assert slow - fast == pytest.approx(340 / 115200 - 340 / 460800)
    assert 0.002 < fast < 0.003
    delays = delays_by_type(fast)
    assert delays[1] == fast
    assert delays[3] < delays[1] < delays[2] < delays[4]
    assert default_transport_delay("/dev/pts/7", 460800) == 0.0
    assert default_transport_delay("/dev/ttyUSB0", 460800) == fast
