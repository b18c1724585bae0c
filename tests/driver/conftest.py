"""The bridge on a pseudo-terminal, for each test that asks for it."""

import pytest


@pytest.fixture
def rig(tmp_path):
    import rclpy
    from tests.driver.bridge_rig import Rig

    context = rclpy.Context()
    rclpy.init(context=context)
    rig = Rig(tmp_path / "tty", context)
    yield rig
    rig.stop = True
    rig.node.close()
    rig.executor.shutdown()
    rig.node.destroy_node()
    rig.probe.destroy_node()
    rclpy.try_shutdown(context=context)
    if rig.link.is_symlink():
        rig.unplug()
