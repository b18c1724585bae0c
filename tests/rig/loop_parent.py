"""A parent of the loop process for tests that kill it: starts homing, prints the loop's pid, then waits."""

import sys
import time
from functools import partial
from pathlib import Path

from tests.rig.recording_feed import RecordingFeed

from gsense_rig.loop.client import LoopProcess
from gsense_rig.loop.messages import Home
from gsense_rig.loop.spec import ProcessSpec

if __name__ == "__main__":
    memory = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    spec = ProcessSpec(position=-0.22, feed_factory=partial(RecordingFeed, Path(sys.argv[1])), memory=memory)
    moving = []
    loop = LoopProcess(spec, lambda t: moving.append(t) if abs(t.velocity) > 0.2 else None)
    loop.wait_ready()
    loop.request(Home(loop.next_id()))
    while not moving:
        time.sleep(0.01)
    print(loop.pid, flush=True)
    time.sleep(60.0)
