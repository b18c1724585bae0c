"""One message to one page: the graph as it stands, and the charts' new bins."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gsense_rig.dashboard.state import Note
from gsense_rig.dashboard.trace import Cursor, Trace
from gsense_rig.safety.modes import Fault, Light, Mode

if TYPE_CHECKING:
    from gsense_rig.dashboard.state import GraphState, Orientation

GCOMP = "_gcomp"
SILENT = 2.0  # s after which the page says so
SILENT_NOTE = 5.0  # s; diagnostics come once a second
FORGET_NOTE = 60.0  # s; who has been silent for so long was ended
STALE = 3  # the level of diagnostic_msgs


@dataclass
class Viewing:
    """What one page shows, and how far it has read. Another view starts its charts anew."""

    sensor: str = ""
    filter: str = ""
    cursors: dict[tuple[str, ...], Cursor] = field(default_factory=dict)

    def choose(self, sensor: str, filter_: str) -> None:
        """Show these; empty: the first there is."""
        self.sensor, self.filter = sensor, filter_
        self.cursors.clear()

    def read(self, key: tuple[str, ...], trace: Trace) -> dict[str, Any]:
        """New bins of a trace."""
        new = trace.since(self.cursors.get(key, Cursor()))
        self.cursors[key] = new.cursor
        return {"afresh": new.afresh, "rows": new.rows}


USUAL_SENSOR = "mpu6050"
"""The default of the commands' `--sensor`."""


def plain_filters(names: tuple[str, ...]) -> list[str]:
    """Filters of topic names, each once: with `vqf_gcomp` alone, `vqf`."""
    return sorted({name.removesuffix(GCOMP) for name in names})


def number(value: float | None, digits: int) -> float | None:
    """Rounded; None where unknown or not finite, for JSON has neither NaN nor infinity."""
    return None if value is None or not math.isfinite(value) else round(value, digits)


def graph_message(state: GraphState, viewing: Viewing, now: float) -> dict[str, Any]:
    """The state for one page; moves its cursors on."""
    sensors = sorted(state.sensors)
    sensor = viewing.sensor if viewing.sensor in sensors else _first_choice(state, sensors)
    filters = plain_filters(state.filters.get(sensor, ()))
    filter_ = viewing.filter if viewing.filter in filters else next(iter(filters), "")
    return {
        "rig": _rig(state, now),
        "carriage": viewing.read(("carriage",), state.carriage),
        "link": _link(state, now),
        "battery": _battery(state),
        "sensors": sensors,
        "sensor": sensor,
        "imu": _imu(state, viewing, sensor, now),
        "filters": filters,
        "filter": filter_,
        "attitude": _attitude(state, viewing, sensor, filter_, now),
        "notes": _notes(state, now),
    }


def _first_choice(state: GraphState, sensors: list[str]) -> str:
    """A sensor whose orientation is published, else the one that every command takes, else any."""
    with_filters = [name for name in sensors if state.filters.get(name)]
    return next(iter([*with_filters, *(name for name in sensors if name == USUAL_SENSOR), *sensors]), "")


def _rig(state: GraphState, now: float) -> dict[str, Any] | None:
    rig = state.rig
    if rig is None:
        return None
    return {
        "silent": now - state.rig_heard > SILENT,
        "mode": _name(Mode, rig.mode),
        "light": _name(Light, rig.light),
        "switches": list(rig.switches),
        "fault": _name(Fault, rig.fault),
        "fault_text": rig.fault_text,
        "position": number(state.position, 5),
        "velocity": number(state.velocity, 4),
        "reference": number(state.reference, 5),
        "tracking_error": number(rig.tracking_error, 6),
        "current": number(rig.current, 3),
        "duty": number(rig.duty, 3),
    }


def _name(kind: Any, value: int) -> str:
    try:
        return str(kind(value).name)
    except ValueError:
        return str(value)


def _link(state: GraphState, now: float) -> dict[str, Any] | None:
    link = state.link
    if link is None:
        return None
    return {
        "silent": now - state.link_heard > SILENT + 1.0,
        "unit_id": link.unit_id,
        "rate_hz": number(link.rate_hz, 1),
        "received": link.received,
        "lost": link.lost,
        "lost_lately": link.lost_lately,
        "corrupt": link.corrupt,
        "restarts": link.restarts,
        "loss": number(link.loss, 6),
        "clock_offset_s": number(link.clock_offset_s, 3),
        "clock_skew_ppm": number(link.clock_skew_ppm, 1),
        "uptime_s": number(link.uptime_s, 0),
    }


def _battery(state: GraphState) -> dict[str, Any] | None:
    battery = state.battery
    if battery is None:
        return None
    return {"voltage": number(battery.voltage, 3), "percentage": number(battery.percentage, 3)}


def _imu(state: GraphState, viewing: Viewing, name: str, now: float) -> dict[str, Any] | None:
    sensor = state.sensors.get(name)
    if sensor is None:
        return None
    return {
        "silent": now - sensor.heard > SILENT,
        "has_force": sensor.has_force,
        "temperature": number(sensor.temperature, 2),
        **viewing.read(("imu", name), sensor.trace),
    }


def _attitude(state: GraphState, viewing: Viewing, sensor: str, filter_: str, now: float) -> dict[str, Any]:
    raw = state.orientations.get((sensor, filter_))
    gcomp = state.orientations.get((sensor, filter_ + GCOMP))
    apart = None
    if raw is not None and gcomp is not None and raw.quaternion is not None and gcomp.quaternion is not None:
        apart = number(raw.quaternion.angle_to(gcomp.quaternion), 3)
    return {
        "raw": _orientation(raw, viewing, (sensor, filter_, "raw"), now),
        "gcomp": _orientation(gcomp, viewing, (sensor, filter_, "gcomp"), now),
        "apart": apart,
    }


def _orientation(
    seen: Orientation | None, viewing: Viewing, key: tuple[str, ...], now: float
) -> dict[str, Any] | None:  # fmt: skip
    if seen is None or seen.quaternion is None:
        return None
    q = seen.quaternion
    return {
        "silent": now - seen.heard > SILENT,
        "q": [round(value, 6) for value in (q.w, q.x, q.y, q.z)],
        "angles": [round(angle, 3) for angle in q.roll_pitch_heading()],
        "tilt": viewing.read(key, seen.tilt),
    }


def _notes(state: GraphState, now: float) -> list[dict[str, Any]]:
    """Diagnostics, the worst first; one that nobody repeats is said to be silent, then left out."""
    known = [(_aged(note, now - heard), name) for name, (note, heard) in state.notes.items()]
    found = sorted(((note, name) for note, name in known if note), key=lambda entry: (-entry[0].level, entry[1]))
    return [{"level": note.level, "name": _shown(name), "text": note.text} for note, name in found]


def _aged(note: Note, age: float) -> Note | None:
    if age < SILENT_NOTE:
        return note
    return Note(STALE, f"silent for {age:.0f} s") if age < FORGET_NOTE else None


def _shown(status_name: str) -> str:
    """`rig` of "lab/rig: rig", `bridge: link` of "lab/bridge: link": the page shows one namespace."""
    node, _, task = (part.strip() for part in status_name.rpartition("/")[2].partition(":"))
    return node if task in ("", node) else f"{node}: {task}"
