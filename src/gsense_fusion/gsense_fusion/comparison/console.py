"""The table of a comparison for a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from gsense_fusion.report.units import probability

from .changes import CHANGES, Comparison
from .words import difference, one_sentence, scalar_difference, status, value


def show(c: Comparison, console: Console) -> None:
    """Print warnings, the table of what was compared, and the conclusion."""
    for warning in c.warnings:
        console.print(f"note: {warning}", markup=False, soft_wrap=True)
    table = Table("what", "OLD", "NEW", "difference", "", box=None, pad_edge=False)
    if c.k is not None and c.k.p_value is not None:
        table.add_row("k", value(c.k.old, "k"), value(c.k.new, "k"), scalar_difference(c.k), probability(c.k.p_value))
    for e in c.effects:
        tested = "" if e.chi2 is None else f", chi2 = {e.chi2:.1f} of {e.dof}"
        p = "" if e.p_value is None else f", {probability(e.p_value)}"
        note = f" ({e.note})" if e.note else ""
        style = "bold" if e.status in CHANGES else None
        table.add_row(e.effect, "", "", "", f"{status(e.status, c)}{note}{tested}{p}", style=style)
        for d in e.parameters:
            table.add_row(f"  {d.name}", value(d.old, d.name), value(d.new, d.name), difference(d), _sigmas(d.z))
    if c.unexplained is not None:
        table.add_row("unexplained", c.old.unexplained or "-", c.new.unexplained or "-", "", status(c.unexplained, c))
    for s in c.scalars:
        old, new = value(s.old, s.name), value(s.new, s.name)
        p = "" if s.p_value is None else probability(s.p_value)
        table.add_row(s.name, old, new, scalar_difference(s), p)
    console.print(table, soft_wrap=True)
    console.print(one_sentence(c), markup=False, soft_wrap=True)


def _sigmas(z: float) -> str:
    return "" if z != z else f"{z:+.1f} standard errors"  # noqa: PLR0124  (NaN differs from itself)
