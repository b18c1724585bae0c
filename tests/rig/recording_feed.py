"""A sensor feed for tests of the loop process: leaves behind in a file how the carriage ended."""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class RecordingFeed:
    path: Path

    def __post_init__(self):
        self.rows = []

    def advance(self, history):
        self.rows.append(history)

    def close(self):
        history = np.concatenate(self.rows)
        report = {
            "rows": len(history),
            "largest_gap": float(np.diff(history[:, 0]).max()),
            "peak_speed": float(np.abs(history[:, 2]).max()),
            "last_speed": float(history[-1, 2]),
            "last_current": float(history[-1, 4]),
        }
        temporary = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        temporary.write_text(json.dumps(report))
        temporary.rename(self.path)


def fail(reason):
    raise ValueError(reason)
