import os
import time

import pytest

from gsense_driver.errors import PortLostError
from gsense_driver.port import LONGEST_PAUSE_S, Connection, SerialPort


class FakePort:
    def __init__(self, script):
        self.script = list(script)
        self.closed = False

    def read(self):
        if not self.script:
            raise PortLostError("unplugged")
        return self.script.pop(0)

    def close(self):
        self.closed = True


def test_a_lost_port_is_opened_again_with_growing_pauses_and_said_once():
    ports = [FakePort([b"ab", b""]), None, None, None, None, None, FakePort([b"cd"])]
    opened, pauses, lines = [], [], []

    def opener():
        port = ports.pop(0)
        if port is None:
            raise PortLostError("no such file")
        opened.append(port)
        return port

    connection = Connection(opener, pauses.append, lambda line, warning: lines.append((line, warning)))
    got = [connection.read() for _ in range(11)]
    assert [data for data in got if data] == [b"ab", b"cd"]
    assert pauses == [0.05, 0.1, 0.2, 0.4, LONGEST_PAUSE_S]
    assert [warning for _, warning in lines] == [False, True, False]
    assert "unplugged" in lines[1][0]
    assert opened[0].closed
    assert connection.opened == 2
    assert connection.problem is None


def test_a_port_that_is_read_already():
    master, slave = os.openpty()
    first = SerialPort(os.ttyname(slave), 460800)
    try:
        with pytest.raises(PortLostError, match="another program reads it"):
            SerialPort(os.ttyname(slave), 460800)
    finally:
        first.close()
        os.close(slave)
        os.close(master)


def test_a_pseudo_terminal_is_read_and_its_end_is_noticed():
    master, slave = os.openpty()
    port = SerialPort(os.ttyname(slave), 460800, timeout_s=0.2)
    os.close(slave)
    os.write(master, b"\x00\x01\x0d\x0a\x13\x11\xff")  # raw: nothing is translated or swallowed
    data = b""
    deadline = time.monotonic() + 60
    while len(data) < 7 and time.monotonic() < deadline:
        data += port.read()
    assert data == b"\x00\x01\x0d\x0a\x13\x11\xff"
    os.close(master)
    with pytest.raises(PortLostError):
        port.read()
    port.close()


def test_what_cannot_be_opened_is_said_in_one_line():
    for url in ("/dev/no-such-port", "nonsense://x"):
        with pytest.raises(PortLostError) as caught:
            SerialPort(url, 460800)
        assert "\n" not in str(caught.value)
        assert str(caught.value)


def test_any_pyserial_url_will_do():
    port = SerialPort("loop://", 460800, timeout_s=0.01)
    assert port.read() == b""
    port.close()
