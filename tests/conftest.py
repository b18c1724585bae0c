"""Marks what waits for real time (nodes, boards, recorders), so that `./rig test -m "not slow"` is quick."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings
from tests.domains import own_domain

# As the packages do, before numpy loads its BLAS: on small matrices its threads only spin against one another.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# A loaded machine is no failure.
settings.register_profile(
    "gsense", parent=settings.default, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("gsense")

SLOW = (
    "tests/fusion/identification/test_curves.py",
    "tests/fusion/identification/test_invariance.py",
    "tests/firmware/test_emulator_core.py",
    "tests/graph/",
    "tests/firmware/test_faults.py",
    "tests/firmware/test_host_board.py",
    "tests/driver/test_bridge_node.py",
    "tests/driver/test_board_truth.py",
    "tests/fusion/test_fusion_node.py",
    "tests/fusion/watch/test_watch_node.py",
    "tests/rig/test_record.py",
    "tests/rig/test_rig_node.py",
    "tests/rig/test_loop_process.py",
)


def pytest_configure() -> None:
    """What a script runs in its background ignores SIGINT, and the programs that tests interrupt would inherit that."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module")
def domain() -> Iterator[int]:
    with own_domain() as number:
        yield number


@pytest.fixture(autouse=True)
def signals_as_before() -> Iterator[None]:
    """A node's main() ends with signals ignored; called within a test it would make all later children deaf to them."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        place = item.path.relative_to(config.rootpath).as_posix()
        if place.startswith(SLOW):
            item.add_marker(pytest.mark.slow)
    if hasattr(config, "workerinput"):
        from tests.scheduling import order

        items.sort(key=order)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    from tests.scheduling import processes

    return processes(config)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    from tests.scheduling import Turns

    return Turns(config, log)
