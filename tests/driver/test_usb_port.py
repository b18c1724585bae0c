from types import SimpleNamespace

import pytest
from tests.driver.test_settings import values

from gsense_driver.errors import PortLostError, SettingError
from gsense_driver.settings import make_settings
from gsense_driver.usb_port import UsbIds, find_device, parse_usb


def info(device, vid=None, pid=None, serial=None):
    return SimpleNamespace(device=device, vid=vid, pid=pid, serial_number=serial)


PORTS = [
    info("/dev/ttyS0"),
    info("/dev/ttyUSB3", 0x10C4, 0xEA60, "A1"),
    info("/dev/ttyUSB1", 0x10C4, 0xEA60, "B2"),
    info("/dev/ttyACM0", 0x0403, 0x6001),
]


def test_a_device_is_found_by_its_ids_wherever_it_is_plugged_in():
    assert find_device("usb:0403:6001", lambda: PORTS) == "/dev/ttyACM0"
    assert find_device("USB:10c4:ea60:B2", lambda: PORTS) == "/dev/ttyUSB1"
    moved = [info("/dev/ttyUSB9", 0x10C4, 0xEA60, "B2")]
    assert find_device("usb:10c4:ea60:B2", lambda: moved) == "/dev/ttyUSB9"


@pytest.mark.parametrize("port", ["/dev/ttyUSB0", "socket://localhost:7000", "/dev/serial/by-id/usb-Silabs-if00"])
def test_other_ports_are_taken_as_they_are(port):
    assert find_device(port, lambda: pytest.fail("the list is not needed")) == port


def test_none_and_several_are_told_with_what_there_is():
    with pytest.raises(PortLostError, match=r"no USB device is usb:1234:5678; there is: usb:10C4:EA60:A1, "):
        find_device("usb:1234:5678", lambda: PORTS)
    with pytest.raises(PortLostError, match="no USB device is usb:10C4:EA60:C3"):
        find_device("usb:10c4:ea60:C3", lambda: PORTS)
    with pytest.raises(PortLostError, match=r"2 devices .* A1 \(/dev/ttyUSB3\), B2"):
        find_device("usb:10c4:ea60", lambda: PORTS)
    with pytest.raises(PortLostError, match="there is: none"):
        find_device("usb:10c4:ea60", lambda: PORTS[:1])


@pytest.mark.parametrize("port", ["usb:", "usb:10c4", "usb:10c4:", "usb:xyz:1", "usb:10c4:ea6"])
def test_ids_that_are_none_are_refused_at_configuring(port):
    with pytest.raises(SettingError, match="port: ") as caught:
        make_settings(values(port=port))
    assert port in str(caught.value)
    assert parse_usb("usb:10c4:ea60:a:b") == UsbIds(0x10C4, 0xEA60, "a:b")
