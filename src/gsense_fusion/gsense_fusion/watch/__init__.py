"""Watching live: is the residual between measured and predicted rate still noise, and if not, what does it look like?

The way of a sample: `prediction` (residual) -> `history`, `window` (the last half minute, with the encoder) ->
`orders`, `spectrum`, `levels` (tests) -> `suspects` (names) -> `watcher` (alarms that last). No ROS and no clock;
`watch_node` wires.
"""

from .prediction import Prediction
from .watcher import Alarm, Watcher, WatchReport, WatchSettings

__all__ = ["Alarm", "Prediction", "WatchReport", "WatchSettings", "Watcher"]
