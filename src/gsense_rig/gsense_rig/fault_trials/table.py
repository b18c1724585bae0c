"""The fault table as text (Markdown)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gsense_rig.fault_trials.trial import Outcome, Row

END_STOP_FREE = 0.29  # m: where the buffers begin
COLUMNS = (
    ("fault, injected at 8 rad/s", 36), ("bound ms", 8), ("safe after ms", 13), ("stops in mm", 11), ("peak A", 6),
    ("named", 14), ("anywhere: safe after ms", 23), ("farthest mm", 11), ("hits buffer m/s", 15),
)  # fmt: skip


def header() -> str:
    """Column names and rule."""
    names = " | ".join(name.ljust(width) for name, width in COLUMNS)
    return f"| {names} |\n|{'|'.join('-' * (width + 2) for _, width in COLUMNS)}|"


def line(row: Row) -> str:
    """One fault."""
    centre, anywhere = row.centre, row.anywhere or row.centre
    hit = max(centre.hit_speed, anywhere.hit_speed)
    values = (
        row.case.name,
        "" if row.case.bound is None else f"{row.case.bound * 1e3:.0f}",
        f"{centre.found * 1e3:.1f}",
        f"{centre.distance * 1e3:.0f}",
        f"{centre.current:.1f}",
        centre.fault.name.lower() if row.case.faults else "by the guard",
        f"{anywhere.found * 1e3:.1f}" if row.anywhere else "",
        f"{max(centre.farthest, anywhere.farthest) * 1e3:.0f}",
        f"{hit:.2f}" if hit else "",
    )
    cells = " | ".join(value.ljust(width) for value, (_, width) in zip(values, COLUMNS, strict=True))
    return f"| {cells} |"


def failures(row: Row) -> list[str]:
    """What a fault's outcome should not have been."""
    case, found = row.case, []
    late = max(outcome.found for outcome in (row.centre, row.anywhere) if outcome is not None)
    if case.bound is not None and late > case.bound + 1e-9:
        found.append(f"{case.name}: safe after {late * 1e3:.1f} ms, bound {case.bound * 1e3:.0f} ms")
    if case.faults and row.centre.fault not in case.faults:
        found.append(f"{case.name}: named {row.centre.fault.name}")
    for outcome in filter(None, (row.centre, row.anywhere)):
        found += _physical(case.name, outcome, case.coasts)
    return found


def _physical(name: str, outcome: Outcome, coasts: bool) -> list[str]:
    found = []
    if not outcome.stopped:
        found.append(f"{name}: the carriage is not at rest with the motor off")
    if outcome.farthest >= END_STOP_FREE and not coasts:
        found.append(f"{name}: the carriage reached {outcome.farthest * 1e3:.0f} mm")
    return found
