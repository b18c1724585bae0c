"""The watch node's line in /diagnostics."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from .watch import WatchReport

_STATES = {
    "rest": "rest: as predicted",
    "steady": "motion: as predicted",
    "other": "not tested: no steady motion, no rest",
}


def diagnostic(name: str, hardware_id: str, report: WatchReport | None, *, bias_from_rest: bool) -> Any:
    """DiagnosticStatus of one sensor's watch: WARN with the suspects while an alarm stands."""
    if report is None:
        return DiagnosticStatus(
            level=DiagnosticStatus.OK, name=name, message="waiting for samples", hardware_id=hardware_id
        )
    level = DiagnosticStatus.WARN if report.alarms else DiagnosticStatus.OK
    text = "; ".join(alarm.text for alarm in report.alarms) or _STATES[report.state]
    values = {
        "state": report.state,
        "angular_frequency": "" if report.angular_frequency is None else f"{report.angular_frequency:.3f}",
        "energy_by_order": " ".join(f"{energy:.1f}" for energy in report.energies),
        "suspects": " ".join(dict.fromkeys(name for alarm in report.alarms for name in alarm.suspects)),
        "since": " ".join(f"{alarm.since:.1f}" for alarm in report.alarms),
        "bias": "from rest" if bias_from_rest else "of the compensation file",
    }
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=name, message=text, hardware_id=hardware_id, values=pairs)
