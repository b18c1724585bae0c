"""compare.json (schema gsense-compare/1) from a comparison."""

from __future__ import annotations

import json
from typing import Any

from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.document import plain

from .changes import FALSE_ALARM, Comparison, Difference, EffectChange, ScalarChange
from .snapshot import Snapshot
from .words import one_sentence

SCHEMA = "gsense-compare/1"


def comparison_document(c: Comparison) -> dict[str, Any]:
    """The content of compare.json."""
    return {
        "schema": SCHEMA,
        "verdict": c.verdict,
        "sentence": one_sentence(c),
        "old": _report(c.old),
        "new": _report(c.new),
        "warnings": list(c.warnings),
        "false_alarm": FALSE_ALARM,
        "level": c.level,
        "k": None if c.k is None else _scalar(c.k),
        "effects": [_effect(e) for e in c.effects],
        "unexplained": None if c.unexplained is None else c.unexplained.value,
        "scalars": {s.name: _scalar(s) for s in c.scalars},
    }


def comparison_json(c: Comparison) -> str:
    """compare.json as text."""
    return json.dumps(plain(comparison_document(c)), indent=1, allow_nan=False) + "\n"


def _report(s: Snapshot) -> dict[str, Any]:
    return {
        "path": s.path,
        "sensor": s.sensor,
        "unit_id": s.unit_id,
        "declared": list(s.declared),
        "verdict": s.verdict,
        "found": sorted(n for n, e in s.effects.items() if e.presence.value == "found"),
        "unexplained": s.unexplained,
    }


def _effect(e: EffectChange) -> dict[str, Any]:
    return {
        "effect": e.effect,
        "owner": e.owner,
        "status": e.status.value,
        "chi2": e.chi2,
        "dof": e.dof,
        "p_value": e.p_value,
        "note": e.note,
        "parameters": {d.name: _difference(d) for d in e.parameters},
    }


def _difference(d: Difference) -> dict[str, Any]:
    both = d.old is not None and d.new is not None
    return {
        "old": _parameter(d.old),
        "new": _parameter(d.new),
        "difference": d.value if both else None,
        "stderr": d.stderr if both else None,
        "identified": d.identified,
        "unit": d.unit,
    }


def _parameter(p: Parameter | None) -> dict[str, float] | None:
    return None if p is None else {"value": p.value, "stderr": p.stderr}


def _scalar(s: ScalarChange) -> dict[str, Any]:
    return {
        "old": _parameter(s.old),
        "new": _parameter(s.new),
        "difference": s.difference.value,
        "stderr": s.difference.stderr if s.p_value is not None else None,
        "unit": s.unit,
        "p_value": s.p_value,
    }
