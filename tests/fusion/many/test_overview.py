"""What many reports say together: k of a unit over time, and the page."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.fusion.comparison import reports

from gsense_fusion.comparison.snapshot import snapshot
from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.types import Parameter
from gsense_fusion.many.document import summary_json
from gsense_fusion.many.overview import Overview, Row, overview
from gsense_fusion.many.page import one_line, summary_html
from gsense_fusion.many.work import State
from gsense_fusion.report.document import report_document

ELEMENTS = ("g_xy", "g_yz", "g_zx")
DAY_NS = 86400 * 10**9
K, STDERR = 1.7e-4, 3e-6


def row(number: int, k: float, unit_id: str | None = "A7", known: tuple[str, ...] = ELEMENTS) -> Row:
    """A report whose elements of k are all so large, as far as they are known."""
    draw = np.random.default_rng(number)
    result = reports.result(number, unit_id=unit_id)
    errors = {n: STDERR if n in known or n not in ELEMENTS else 1.7e-4 for n in reports.NAMES}
    g = {
        n: Parameter(k + STDERR * draw.standard_normal() if n in known else 0.0, e, "(rad/s)/(m/s^2)")
        for n, e in errors.items()
    }
    spread = Covariance(reports.NAMES, np.diag([e**2 for e in errors.values()]), np.full(9, 1.7e-4))
    result = replace(
        result,
        declared_parameters={**result.declared_parameters, "g_sensitivity": g},
        covariances={**result.covariances, "g_sensitivity": spread},
    )
    report = snapshot(report_document(result), f"session {number}")
    return Row(f"s{number}", State.DONE, report=report, start_ns=1_770_000_000 * 10**9 + number * DAY_NS)


def many(*rows: Row) -> Overview:
    return overview(rows)


def test_k_is_the_weighted_mean_of_what_is_known() -> None:
    k = row(1, K, known=("g_xy", "g_zx")).k
    assert k is not None
    assert k.elements == ("g_xy", "g_zx")
    assert k.value.stderr == pytest.approx(STDERR / np.sqrt(2))
    assert k.value.value == pytest.approx(K, abs=4 * STDERR)
    assert row(1, K, known=()).k is None


def test_k_that_stays_and_k_that_moves() -> None:
    still = many(*(row(n, K) for n in range(12)))
    (unit,) = still.units
    assert unit.constancy is not None
    assert unit.constancy.dof == 11
    assert unit.constancy.p_value > still.level
    assert unit.constancy.mean.value == pytest.approx(K, abs=4 * unit.constancy.mean.stderr)
    moved = many(*(row(n, K + 2 * STDERR * n) for n in range(12)))
    assert moved.units[0].constancy is not None
    assert moved.units[0].constancy.p_value < 1e-9
    assert "k moved in A7" in one_line(moved)


def test_sessions_that_know_other_elements_are_left_out() -> None:
    view = many(*(row(n, K) for n in range(4)), row(5, 3 * K, known=("g_xy",)))
    assert view.units[0].constancy is not None
    assert view.units[0].constancy.dof == 3


def test_units_are_apart_and_in_order_of_time() -> None:
    view = many(row(3, K, "B"), row(2, K, "A"), row(1, K, "B"), row(0, K, None), Row("x", State.FAILED, "broken <b>"))
    assert [(u.unit_id, [r.name for r in u.rows]) for u in view.units] == [
        ("A", ["s2"]),
        ("B", ["s1", "s3"]),
        ("not named", ["s0"]),
    ]
    document = json.loads(summary_json(view))
    assert document["schema"] == "gsense-many/1"
    assert document["states"] == {"done": 4, "failed": 1}
    assert document["entries"][4] == {"name": "x", "state": "failed", "reason": "broken <b>"}
    assert document["entries"][0]["start"] == "2026-02-05T02:40:00+00:00"
    assert document["entries"][0]["report"] == "s3/report.html"
    page = summary_html(view)
    assert page == summary_html(view)
    assert "broken &lt;b&gt;" in page
    assert 'href="s3/report.html"' in page
    assert "<script" not in page
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_a_page_without_any_report() -> None:
    view = many(Row("x", State.FAILED, "no such bag"), Row("y", State.PENDING))
    assert "no such bag" in summary_html(view)
    assert one_line(view) == "2 sessions of 0 units; 1 failed; 1 not reached yet"
