"""How the monitor shows its state: a rich view for a terminal, one line for everything else."""

from __future__ import annotations

from rich.console import Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from gsense_driver.monitor_state import MonitorState, Verdict

_LEVELS = {0: ("ok", "green"), 1: ("warning", "yellow"), 2: ("error", "red"), 3: ("stale", "dim")}


def line(state: MonitorState, now_s: float) -> str:
    """All that matters in one line of plain text."""
    link = state.link
    if link is None or state.silent(now_s):
        return "no driver reports: is a bridge running in this namespace and ROS_DOMAIN_ID?"
    rates = " ".join(f"{name} {topic.rate.value(now_s):.0f}" for name, topic in state.topics.items())
    battery = "unknown" if state.battery_v is None else f"{state.battery_v:.2f} V"
    temperatures = " ".join(f"{name} {celsius:.1f} C" for name, celsius in sorted(state.temperatures.items()))
    worst = state.worst()
    parts = (
        f"{link.rate_hz:.0f} frames/s",
        f"received {link.received} lost {link.lost} corrupt {link.corrupt} ({100 * link.loss:.3f} %)",
        f"restarts {link.restarts}",
        f"clock {link.clock_offset_s:.6f} s {link.clock_skew_ppm:+.2f} ppm",
        f"battery {battery}",
        temperatures or "temperature unknown",
        f"Hz: {rates}",
        f"{_LEVELS[worst.level][0]}: {worst.reason}",
    )
    return " | ".join(parts)


def view(state: MonitorState, now_s: float, title: str) -> Panel:
    """The live view."""
    if state.silent(now_s):
        return Panel(Text(line(MonitorState(()), now_s), style="red"), title=title)
    return Panel(Group(_sensors(state, now_s), _link(state), _verdicts(state)), title=title)


def _sensors(state: MonitorState, now_s: float) -> Table:
    table = Table(box=None, expand=True)
    for name, justify in (("topic", "left"), ("Hz", "right"), ("last value", "left")):
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for name, topic in state.topics.items():
        rate = topic.rate.value(now_s)
        style = "" if rate else "dim"
        table.add_row(name, f"{rate:.1f}", topic.value or "none yet", style=style)
    return table


def _link(state: MonitorState) -> Table:
    link = state.link
    table = Table(box=None, show_header=False)
    if link is None:
        return table
    table.add_row("unit", link.unit_id or "not stated")
    lost = f"{link.lost} lost, {link.corrupt} corrupt ({100 * link.loss:.3f} %), {link.duplicate} duplicate"
    table.add_row("link", f"{link.rate_hz:.1f} frames/s, {link.received} received, {lost}, {link.reordered} reordered")
    table.add_row("last second", Text(f"{link.lost_since} lost, {link.corrupt_since} corrupt", _worse(link.lost_since)))
    table.add_row("board", f"up {link.uptime_s:.0f} s, {link.restarts} restarts seen")
    table.add_row("clock", f"offset {link.clock_offset_s:.6f} s, skew {link.clock_skew_ppm:+.2f} ppm")
    table.add_row("battery", "unknown" if state.battery_v is None else f"{state.battery_v:.3f} V")
    for sensor, celsius in sorted(state.temperatures.items()):
        table.add_row(f"{sensor} die", f"{celsius:.1f} degrees C")
    return table


def _verdicts(state: MonitorState) -> Table:
    table = Table(box=None, show_header=False)
    for task, verdict in state.verdicts.items():
        table.add_row(task, _word(verdict), verdict.reason)
    return table


def _word(verdict: Verdict) -> Text:
    word, colour = _LEVELS[verdict.level]
    return Text(word, style=colour)


def _worse(count: int) -> str:
    return "yellow" if count else ""
