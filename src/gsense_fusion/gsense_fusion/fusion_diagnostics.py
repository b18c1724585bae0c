"""The fusion node's line in /diagnostics."""

from __future__ import annotations

from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from .attitude.fusion import FusionStatus


def diagnostic(name: str, hardware_id: str, status: FusionStatus) -> Any:
    """DiagnosticStatus of one sensor's fusion: WARN while it waits for samples or has not seen rest."""
    counts = status.counts
    if not counts.samples:
        level, text = DiagnosticStatus.WARN, "no samples yet"
    elif not status.running:
        level, text = DiagnosticStatus.OK, status.start
    elif not status.rest_seen:
        level, text = DiagnosticStatus.WARN, status.start
    else:
        level, text = DiagnosticStatus.OK, status.start
    bias = np.degrees(status.bias[False])
    rate = 1.0 / status.usual_s if status.usual_s else 0.0
    values = {
        "samples": counts.samples,
        "rate_hz": f"{rate:.2f}",
        "gaps": counts.gaps,
        "missing": counts.missing,
        "out_of_order": counts.out_of_order,
        "repeated": counts.repeated,
        "resets": counts.resets,
        "magnetometer": "used" if status.uses_field else "not used",
        "bias_deg_s": " ".join(f"{value:.4f}" for value in bias),
    }
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=name, message=text, hardware_id=hardware_id, values=pairs)
