"""Bags in, arrays out: `load_run` reads one rosbag2 recording as a `Run`."""

from .reader import load_run
from .run import (
    ImuSeries,
    JointSeries,
    LinkCounts,
    MagSeries,
    PoseSeries,
    ReferencePose,
    Run,
    ScalarSeries,
)
from .storage import BagError, is_bag

__all__ = [
    "BagError",
    "ImuSeries",
    "JointSeries",
    "LinkCounts",
    "MagSeries",
    "PoseSeries",
    "ReferencePose",
    "Run",
    "ScalarSeries",
    "is_bag",
    "load_run",
]
