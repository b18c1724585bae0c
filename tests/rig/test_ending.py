"""The rig's process ends in bounded time after a signal, even where its main thread is stuck."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

CODE = """
import ctypes, sys, threading
from gsense_rig.ending import Ending
ended = threading.Event()
Ending(ended, grace=0.5)
print("ready", flush=True)
if sys.argv[1] == "stuck":
    while True:
        ctypes.CDLL(None).sleep(600)  # no Python handler runs in here
assert ended.wait(60.0)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(("main_thread", "code"), [("stuck", 1), ("listens", 0)])
def test_a_signal_ends_it(main_thread: str, code: int, number: signal.Signals) -> None:
    command = [sys.executable, "-c", CODE, main_thread]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == code, errors
    assert ("most recent call first" in errors) == (main_thread == "stuck")
