"""What the page knows: records, orientation, the message to a page, the folder."""

from __future__ import annotations

import json
import math
import os

import numpy as np
import pytest

from gsense_rig.campaign.index import Index
from gsense_rig.campaign.plan import Plan, PlanRun
from gsense_rig.dashboard.attitude import Quaternion
from gsense_rig.dashboard.folder import DEPTH, MAX_LISTED, Folder
from gsense_rig.dashboard.snapshot import Viewing, graph_message, plain_filters
from gsense_rig.dashboard.state import (
    BatterySeen,
    GraphState,
    LinkSeen,
    Note,
    RigSeen,
    in_namespace,
    raw_sensor,
    sensor_and_filter,
)
from gsense_rig.dashboard.trace import SPAN, STEP, Cursor, Trace

RIG = RigSeen(2, (False, True, False, False), 1, 0.0, math.nan, 0.002, 0, "")


def filled(times, column=lambda t: t):
    trace = Trace(1)
    for t in times:
        trace.add(t, (column(t),))
    return trace


def test_bins_are_means_at_20_hz_and_the_open_one_is_kept_back():
    new = filled(np.arange(0.0025, 1.0, 0.005)).since(Cursor())
    assert [row[0] for row in new.rows] == list(range(19))
    assert new.rows[4][1] == pytest.approx(0.225)


def test_a_page_gets_each_bin_once():
    trace = filled(np.arange(0.0, 1.0, 0.005))
    first = trace.since(Cursor())
    assert first.afresh
    assert trace.since(first.cursor).rows == []
    for t in np.arange(1.0, 2.0, 0.005):
        trace.add(t, (t,))
    second = trace.since(first.cursor)
    assert not second.afresh
    bins = [row[0] for row in first.rows + second.rows]
    assert bins == list(range(39))


def test_a_gap_has_no_bins():
    bins = [row[0] for row in filled([*np.arange(0.0, 0.5, 0.005), *np.arange(1.0, 1.5, 0.005)]).since(Cursor()).rows]
    assert bins == [*range(10), *range(20, 29)]


def test_only_the_last_minute_is_kept():
    trace = filled(np.arange(0.0, 2 * SPAN, STEP / 2))
    assert len(trace.since(Cursor()).rows) == round(SPAN / STEP)


def test_a_clock_that_is_set_back_begins_anew_and_a_late_sample_does_not():
    trace = filled(np.arange(100.0, 101.0, 0.005))
    cursor = trace.since(Cursor()).cursor
    trace.add(100.9, (0.0,))
    assert not trace.since(cursor).afresh
    for t in np.arange(5.0, 5.2, 0.005):
        trace.add(t, (t,))
    new = trace.since(cursor)
    assert new.afresh
    assert [row[0] for row in new.rows] == [100, 101, 102]


def test_what_is_not_finite_is_left_out():
    trace = filled([0.0, math.nan, 0.06], lambda t: t)
    trace.add(0.07, (math.inf,))
    trace.add(0.2, (1.0,))
    assert trace.since(Cursor()).rows == [[0, 0.0], [1, 0.06]]


@pytest.mark.parametrize(
    ("axis", "expected"), [((1, 0, 0), (30, 0, 0)), ((0, 1, 0), (0, 30, 0)), ((0, 0, 1), (0, 0, 30))]
)
def test_angles_of_a_turn_about_one_axis(axis, expected):
    half = math.radians(15)
    q = Quaternion.of(*(2 * math.cos(half), *(2 * math.sin(half) * a for a in axis)))  # made to unit length
    assert q.roll_pitch_heading() == pytest.approx(expected, abs=1e-9)
    assert q.inclination() == pytest.approx(0.0 if axis[2] else 30.0)
    assert q.angle_to(Quaternion(1, 0, 0, 0)) == pytest.approx(30.0)
    assert q.angle_to(Quaternion(-q.w, -q.x, -q.y, -q.z)) == pytest.approx(0.0, abs=1e-6)


def test_no_rotation():
    assert Quaternion.of(0, 0, 0, 0) is None
    assert Quaternion.of(math.nan, 0, 0, 0) is None


def test_names():
    assert sensor_and_filter("/mpu6050/vqf_gcomp/imu/data", "/") == ("mpu6050", "vqf_gcomp")
    assert sensor_and_filter("/lab/mpu6050/vqf/imu/data", "/lab") == ("mpu6050", "vqf")
    assert sensor_and_filter("/lab/mpu6050/vqf/imu/data", "/") is None
    assert sensor_and_filter("/bno055/imu/data", "/") is None
    assert raw_sensor("/lab/mpu6050/imu/data_raw", "/lab") == "mpu6050"
    assert raw_sensor("/lab2/mpu6050/imu/data_raw", "/lab") is None
    assert in_namespace("rig: loop", "/")
    assert not in_namespace("lab/rig: loop", "/")
    assert in_namespace("lab/rig: loop", "/lab")
    assert plain_filters(("madgwick", "madgwick_gcomp", "vqf_gcomp")) == ["madgwick", "vqf"]


def graph() -> GraphState:
    state = GraphState()
    for t in np.arange(0.0, 1.0, 0.005):
        state.take_joint(t, 0.1 * t, 0.1)
        state.take_imu("mpu6050", t, (0.1, 0.2, 0.3), (0.0, 0.0, 9.8), now=10.0)
        state.take_orientation("mpu6050", "vqf", t, Quaternion(1, 0, 0, 0), now=10.0)
        state.take_orientation("mpu6050", "vqf_gcomp", t, Quaternion(math.cos(0.01), math.sin(0.01), 0, 0), now=10.0)
    state.take_imu("lisy300", 0.0, (0.0, 0.0, 0.3), None, now=10.0)
    state.filters = {"mpu6050": ("vqf", "vqf_gcomp")}
    state.take_rig(RIG, 10.0)
    return state


def test_message_to_a_page():
    message = graph_message(graph(), Viewing(), now=10.1)
    json.dumps(message, allow_nan=False)
    assert (message["rig"]["mode"], message["rig"]["light"]) == ("IDLE", "GREEN")
    assert message["rig"]["current"] is None  # not sensed
    assert message["rig"]["position"] == pytest.approx(0.0995)
    assert message["rig"]["reference"] == pytest.approx(0.1015)
    assert message["rig"]["switches"] == [False, True, False, False]
    assert message["sensors"] == ["lisy300", "mpu6050"]
    assert (message["sensor"], message["filter"]) == ("mpu6050", "vqf")  # the one with an orientation
    assert message["imu"]["rows"][-1][1:] == pytest.approx([0.1, 0.2, 0.3, 0.0, 0.0, 9.8])
    assert message["attitude"]["apart"] == pytest.approx(math.degrees(0.02), abs=1e-3)
    assert message["attitude"]["gcomp"]["angles"][0] == pytest.approx(math.degrees(0.02), abs=1e-3)


def test_without_a_filter_the_usual_sensor_comes_first() -> None:
    state = GraphState()
    for name in ("bno055", "lisy300", "mpu6050"):
        _ = state.sensors[name]
    assert graph_message(state, Viewing(), now=0.0)["sensor"] == "mpu6050"
    state.filters["lisy300"] = ("madgwick",)
    assert graph_message(state, Viewing(), now=0.0)["sensor"] == "lisy300"
    assert graph_message(state, Viewing(sensor="bno055"), now=0.0)["sensor"] == "bno055"


def test_message_of_an_empty_graph():
    message = graph_message(GraphState(), Viewing(), now=0.0)
    json.dumps(message, allow_nan=False)
    assert message["rig"] is None
    assert message["link"] is None
    assert message["attitude"] == {"raw": None, "gcomp": None, "apart": None}


def test_another_view_starts_its_charts_anew():
    state, viewing = graph(), Viewing()
    assert graph_message(state, viewing, 10.0)["imu"]["rows"]
    assert not graph_message(state, viewing, 10.0)["imu"]["rows"]
    viewing.choose("mpu6050", "vqf")
    again = graph_message(state, viewing, 10.0)["imu"]
    assert again["afresh"]
    assert again["rows"]


def test_silence_is_said():
    state = graph()
    state.take_note("rig: loop", Note(0, "on time"), 10.0)
    state.take_note("bridge: link", Note(2, "no frames"), 13.0)
    late = graph_message(state, Viewing(), now=16.0)
    assert late["rig"]["silent"]
    assert late["imu"]["silent"]
    assert late["attitude"]["raw"]["silent"]
    assert [(note["level"], note["name"], note["text"]) for note in late["notes"]] == [
        (3, "rig: loop", "silent for 6 s"),
        (2, "bridge: link", "no frames"),
    ]
    assert not graph_message(state, Viewing(), now=73.0)["notes"]


def test_a_note_names_its_node_once():
    state = graph()
    state.take_note("lab/rig: rig", Note(1, "not homed"), 10.0)
    state.take_note("lab/rig: loop", Note(0, "on time"), 10.0)
    assert [note["name"] for note in graph_message(state, Viewing(), 10.0)["notes"]] == ["rig", "rig: loop"]


def test_link_and_battery():
    state = graph()
    state.take_link(LinkSeen("u", 900, 90, 10, 0, 299.97, 1.0, -47.04, 12.0, 3), 10.0)
    state.battery = BatterySeen(4.07, math.nan)
    message = graph_message(state, Viewing(), now=10.0)
    assert message["link"]["loss"] == pytest.approx(0.1)
    assert message["link"]["clock_skew_ppm"] == -47.0
    assert message["battery"] == {"voltage": 4.07, "percentage": None}


def test_folder(tmp_path):
    plan = Plan("minimum", tuple(PlanRun("static", duration=10.0) for _ in range(3)))
    (tmp_path / "c").mkdir()
    Index.of_plan(plan, "unit-7").with_done(0, "sha256:0").write(tmp_path / "c")
    (tmp_path / "c/.unfinished/run_01").mkdir(parents=True)
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad/index.yaml").write_text("runs: [")
    report = tmp_path / "r"
    report.mkdir()
    (report / "report.html").write_text("<p>")
    found = {"schema": "gsense-close-loop/1", "sensor": "mpu6050", "unit_id": "unit-7", "verdict": "effects_found"}
    (report / "report.json").write_text(json.dumps({**found, "findings": [{"effect": "rail_curvature"}]}))
    (tmp_path / "mine.html").write_text("<p>")  # no page of ours
    (report / "linked.html").symlink_to(tmp_path / "mine.html")
    (report / "linked.json").write_text(json.dumps(found))
    deep = tmp_path.joinpath(*"x" * (DEPTH + 1))
    deep.mkdir(parents=True)
    (deep / "report.html").write_text("<p>")
    (deep / "report.json").write_text(json.dumps(found))
    seen = Folder(tmp_path).look()
    campaigns = {campaign.path: campaign for campaign in seen.campaigns}
    assert set(campaigns) == {"c", "bad"}
    assert (campaigns["c"].done, campaigns["c"].total) == (1, 3)
    assert (campaigns["c"].recording, campaigns["c"].next_run, campaigns["c"].unit_id) == ("run_01", "run_01", "unit-7")
    os.utime(tmp_path / "c/.unfinished/run_01", (0, 0))  # the campaign was interrupted
    assert next(c.recording for c in Folder(tmp_path).look().campaigns if c.path == "c") == ""
    assert "is not an index" in campaigns["bad"].problem
    assert "\n" not in campaigns["bad"].problem
    assert [(r.path, r.text) for r in seen.reports] == [
        ("r/report.html", "mpu6050 unit-7: effects found (rail_curvature)")
    ]
    json.dumps(seen.to_dict())


def test_no_folder(tmp_path):
    assert Folder(tmp_path / "none").look().to_dict() == {"campaigns": [], "reports": [], "left_out": 0}


def test_a_folder_is_read_again_only_where_it_changed(tmp_path, monkeypatch):
    for number in range(MAX_LISTED + 3):
        (tmp_path / f"{number}.html").write_text("<p>")
        (tmp_path / f"{number}.json").write_text('{"schema": "gsense-many/1"}')
    folder = Folder(tmp_path)
    first = folder.look()
    assert len(first.reports) == MAX_LISTED + 3
    assert (len(first.to_dict()["reports"]), first.to_dict()["left_out"]) == (MAX_LISTED, 3)
    reads = []
    monkeypatch.setattr(json, "loads", lambda text: reads.append(text) or {})
    assert folder.look() == first
    assert reads == []
    (tmp_path / "1.json").write_text('{"schema": "something else"}')
    assert len(folder.look().reports) == MAX_LISTED + 2
    assert len(reads) == 1
