"""A command that is asked to end unwinds, wherever the signal meets its main thread."""

import os
import signal
import time

import pytest

from gsense_driver.user_input.interruption import Interrupted, Interruption


class SignalledWhileDropped:
    """The signal comes while the interpreter runs its `__del__`, which lets no exception out."""

    reached = False

    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):  # the handler runs between two of these
            pass
        SignalledWhileDropped.reached = True


def wait(seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.01)


def test_a_signal_raises_with_its_number():
    with Interruption((signal.SIGTERM,)) as asked, pytest.raises(Interrupted) as raised:
        os.kill(os.getpid(), signal.SIGTERM)
    assert raised.value.args == (signal.SIGTERM,)
    assert asked.number == signal.SIGTERM


def test_an_exception_that_the_interpreter_drops_comes_again(capsys):
    with Interruption() as asked:
        dropped = SignalledWhileDropped()
        del dropped  # the exception ends here, within `__del__`
        assert asked.number == signal.SIGINT
        assert not SignalledWhileDropped.reached
        with pytest.raises(Interrupted):
            wait(10.0)
    assert capsys.readouterr().err == ""


def test_other_dropped_exceptions_are_told_as_before(monkeypatch):
    told = []
    monkeypatch.setattr("sys.unraisablehook", lambda dropped: told.append(dropped.exc_value))

    class Broken:
        def __del__(self):
            raise ValueError("mine")

    with Interruption():
        broken = Broken()
        del broken
    assert [str(error) for error in told] == ["mine"]


def test_the_handlers_of_before_are_back_and_none_is_heard_once_it_is_over():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with Interruption() as asked:
        asked.over()
        os.kill(os.getpid(), signal.SIGTERM)
        wait(0.1)
        assert asked.number is None
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
