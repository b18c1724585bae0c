"""A ROS domain that no other graph on this machine uses, so that the suite may run twice at a time."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from gsense_rig.demonstration.domain import free_domain


@contextmanager
def own_domain() -> Iterator[int]:
    """The number, in the environment too: nodes of this process and its children talk there, on this machine alone."""
    folder = Path(tempfile.gettempdir()) / f"gsense-test-domains-{os.getuid()}"
    folder.mkdir(exist_ok=True)
    while True:
        domain = free_domain()
        with (folder / str(domain)).open("w") as claim:
            try:
                fcntl.flock(claim, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
            with patch.dict(os.environ, own):
                yield domain
            return
