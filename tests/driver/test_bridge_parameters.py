"""The bridge's parameters: checked, and in effect at once where they may change."""

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from tests.driver import wire
from tests.driver.bridge_rig import start

pytestmark = pytest.mark.usefixtures("domain")


def test_parameters_are_checked_and_live_ones_take_effect(rig):
    start(rig)
    (bad,) = rig.node.set_parameters([Parameter("mpu6050.mounting", value="y x z")])
    assert not bad.successful
    assert "mirror" in bad.reason
    (fixed,) = rig.node.set_parameters([Parameter("port", value="/dev/null")])
    assert not fixed.successful
    (good,) = rig.node.set_parameters([Parameter("mpu6050.frame_id", value="chip")])
    assert good.successful
    thread, _ = rig.play(wire.Board().frames(1.0))
    assert rig.spin_until(lambda: not thread.is_alive() and len(rig.got["mpu6050/imu/data_raw"]) >= 190)
    assert rig.got["mpu6050/imu/data_raw"][-1].header.frame_id == "chip"


def test_a_raw_log_that_cannot_be_made_fails_the_configuring(rig, tmp_path):
    rig.node.set_parameters([Parameter("raw_log", value=str(tmp_path / "none" / "a.raw"))])
    assert rig.node.trigger_configure() == TransitionCallbackReturn.FAILURE
    rig.node.set_parameters([Parameter("raw_log", value="")])
    assert rig.node.trigger_configure() == TransitionCallbackReturn.SUCCESS


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("transport_delay", 0.2),
        ("transport_delay", float("nan")),
        ("mpu6050.gyro_range_dps", 300),
        ("mpu6050.gyro_noise_density", -1.0),
        ("bno055.gyro_lsb_per_dps", 0.0),
        ("baud", 9600),
        ("raw_log", "/tmp/x"),
        ("port", "/dev/ttyUSB7"),
    ],
)
def test_a_parameter_out_of_range_or_not_live_is_refused_while_configured(rig, name, value):
    before = rig.node.get_parameter(name).value
    assert rig.node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    (result,) = rig.node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert result.reason
    assert rig.node.get_parameter(name).value == before
