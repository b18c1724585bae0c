"""summary.json (schema gsense-many/1)."""

from __future__ import annotations

import json
from typing import Any

from gsense_fusion.closing import REPORT_HTML
from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.document import plain

from .folder import iso
from .overview import Overview, Row, Scalar, Unit

SCHEMA = "gsense-many/1"


def summary_json(view: Overview) -> str:
    """The document as text."""
    document = {
        "schema": SCHEMA,
        "sessions": len(view.rows),
        "states": dict(view.states),
        "verdicts": dict(view.verdicts),
        "false_alarm_level": view.level,
        "units": [_unit(unit, view.level) for unit in view.units],
        "entries": [_row(row) for row in view.rows],
    }
    return json.dumps(plain(document), indent=1, allow_nan=False) + "\n"


def _unit(unit: Unit, level: float) -> dict[str, Any]:
    c = unit.constancy
    return {
        "sensor": unit.sensor,
        "unit_id": unit.unit_id,
        "sessions": [row.name for row in unit.rows],
        "effects": dict(unit.effects),
        "k": None
        if c is None
        else {**_parameter(c.mean), "chi2": c.chi2, "dof": c.dof, "p_value": c.p_value, "moved": c.p_value < level},
    }


def _row(row: Row) -> dict[str, Any]:
    out: dict[str, Any] = {"name": row.name, "state": row.state.value, "reason": row.reason or None}
    report = row.report
    if report is None:
        return out
    return {
        **out,
        "report": f"{row.name}/{REPORT_HTML}",
        "sensor": report.sensor,
        "unit_id": report.unit_id,
        "start": None if row.start_ns is None else iso(row.start_ns),
        "seconds": row.seconds,
        "verdict": report.verdict,
        "unexplained": report.unexplained,
        "findings": [
            {
                "effect": e.effect,
                "owner": e.owner,
                "alternatives": list(e.alternatives),
                "parameters": {name: _parameter(p) for name, p in e.parameters.items()},
            }
            for e in row.found
        ],
        "k": _scalar(row.k),
        "rate_rms": {**report.rate_rms, "unit": "rad/s"},
    }


def _scalar(k: Scalar | None) -> dict[str, Any] | None:
    return None if k is None else {**_parameter(k.value), "elements": list(k.elements)}


def _parameter(p: Parameter) -> dict[str, Any]:
    return {"value": p.value, "stderr": p.stderr, "unit": p.unit}
