"""The study's tables from its outcomes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import beta

from .judge import Outcome


def upper_bound(hits: int, n: int, confidence: float = 0.95) -> float:
    """One-sided Clopper-Pearson bound of a rate."""
    return 1.0 if hits >= n else float(beta.ppf(confidence, hits + 1, n - hits))


def show(outcomes: Sequence[Outcome], console: Console) -> None:
    """Print everything."""
    good = [o for o in outcomes if o.verdict != "error"]
    errors = [o for o in outcomes if o.verdict == "error"]
    nulls = [o for o in good if o.group == "null"]
    if nulls:
        alarms = [o for o in nulls if not o.exact]
        bound = upper_bound(len(alarms), len(nulls))
        console.print(
            f"false alarms on null sessions: {len(alarms)} of {len(nulls)} (95 % upper bound {100 * bound:.1f} %)"
        )
    console.print(_table(good))
    _figures(good, console)
    if any(o.peers for o in good):
        console.print(_peers(good))
    for o in [*errors, *(o for o in good if not o.exact)]:
        what = "ERROR" if o.verdict == "error" else o.verdict
        found = ", ".join(o.found)
        console.print(
            f"  seed {o.seed} {o.label} lambda {o.energy:g}: {what} [{found}] {o.why}", highlight=False, markup=False
        )


def _table(good: Sequence[Outcome]) -> Table:
    table = Table(title="by effect and whitened energy")
    for head in (
        "group",
        "effect",
        "lambda",
        "n",
        "exact",
        "with rivals",
        "missed",
        "unexplained",
        "wrong+confident",
        "full/noise",
    ):
        table.add_column(head, justify="left" if head in ("group", "effect") else "right")
    for key in sorted({(o.group, o.label, o.energy) for o in good}):
        mine = [o for o in good if (o.group, o.label, o.energy) == key]
        n = len(mine)
        rates = [sum(o.exact for o in mine), sum(o.within_rivals for o in mine)]
        rates += [sum(o.verdict == v for o in mine) for v in ("nothing_missing", "unexplained")] + [
            sum(o.wrong for o in mine)
        ]
        cells = [f"{100 * r / n:.0f} %" for r in rates]
        if key[0] == "null":
            cells[2] = "-"  # nothing to miss
        table.add_row(key[0], key[1], f"{key[2]:g}", str(n), *cells, f"{np.median([o.floor_ratio for o in mine]):.3f}")
    return table


def _figures(good: Sequence[Outcome], console: Console) -> None:
    known = [o for o in good if o.group in ("single", "pair") and o.energy >= 400]
    if known:
        ratio = [o.floor_ratio for o in known]
        console.print(
            f"lambda >= 400: full / realised noise: median {np.median(ratio):.3f}, "
            f"90th percentile {np.quantile(ratio, 0.9):.3f}"
        )
        removed = [o.removed for o in known if np.isfinite(o.removed)]
        console.print(f"lambda >= 400: removable error removed: median {100 * np.median(removed):.1f} %")
    wrong = [o for o in good if o.wrong and o.group in ("single", "pair") and o.energy >= 400]
    if known:
        console.print(
            f"lambda >= 400: wrong and confident: {len(wrong)} of {len(known)}, "
            f"{sum(o.said_open for o in wrong)} of these with what is missing listed as undecided"
        )
    stated = [o.stated_floor_ratio for o in good]
    if stated:
        low, high = np.quantile(stated, [0.1, 0.9])
        console.print(
            f"stated noise floor / realised noise: median {np.median(stated):.3f}, 10 % to 90 % {low:.3f} to {high:.3f}"
        )
    _intervals(good, console)
    outside = [o for o in good if o.group == "outside" and o.energy >= 4000]
    if outside:
        flagged = np.mean([o.verdict == "unexplained" for o in outside])
        alone = np.mean([o.exact for o in outside])
        console.print(
            f"outside the catalogue, lambda 4000: flagged {100 * flagged:.0f} %, "
            f"with no other claim {100 * alone:.0f} %"
        )
    without = [o for o in good if o.without]
    if without:
        left = sum(o.without == "unexplained" for o in without)
        console.print(
            f"the true effect and its rivals out of the catalogue, lambda 4000: "
            f"{left} of {len(without)} sessions unexplained"
        )
    console.print(
        f"processor time of one analysis: median {np.median([o.seconds for o in good]):.1f} s" if good else "no session"
    )


def _intervals(good: Sequence[Outcome], console: Console) -> None:
    """How often the 95 % intervals of parameters whose truth is known hold it, where the right set was found."""
    clear = [o for o in good if o.exact and (o.group == "null" or o.energy >= 400)]
    everything = np.array([z for o in clear for z in o.z.values()])
    if not len(everything):
        return
    inside = np.mean(np.abs(everything) < 1.96)
    console.print(f"95 % intervals of all parameters: cover {100 * inside:.1f} % of {len(everything)}")
    for name in sorted({k for o in clear for k in o.z}):
        z = np.array([o.z[name] for o in clear if name in o.z])
        inside = np.mean(np.abs(z) < 1.96)
        console.print(
            f"  {name}: covers {100 * inside:.0f} % of {len(z)}; z mean {z.mean():+.2f}, deviation {z.std():.2f}"
        )


def _peers(good: Sequence[Outcome]) -> Table:
    """The engine beside other methods on the same sessions; singles of lambda 400 and above."""
    nulls = [o for o in good if o.group == "null" and o.peers]
    singles = {e: [o for o in good if o.group == "single" and o.energy == e and o.peers] for e in (400.0, 4000.0)}
    table = Table(title="other methods on the same sessions (singles)")
    heads = ("method", "false alarms", "exact at 400", "exact at 4000", "held-out / noise at 400", "at 4000")
    for head in heads:
        table.add_column(head, justify="left" if head == "method" else "right")

    def row(name: str, exact: Callable[[Outcome], bool | None], ratio: Callable[[Outcome], float]) -> None:
        cells = [_share([_negated(exact(o)) for o in nulls])]
        cells += [_share([exact(o) for o in singles[e]]) for e in singles]
        cells += [_spread([ratio(o) for o in singles[e]]) for e in singles]
        table.add_row(name, *cells)

    row("gsense", lambda o: o.exact, lambda o: o.floor_ratio)
    for name in dict.fromkeys(n for o in good for n in o.peers):
        row(name, lambda o, n=name: o.peers[n]["exact"], lambda o, n=name: float(o.peers[n]["floor_ratio"]))  # type: ignore[misc]
    return table


def _negated(value: bool | None) -> bool | None:
    return None if value is None else not value


def _share(hits: Sequence[bool | None]) -> str:
    """Per cent and number; a dash for methods that select nothing."""
    known = [h for h in hits if h is not None]
    return f"{100 * np.mean(known):.0f} % of {len(known)}" if known else "-"


def _spread(values: Sequence[float]) -> str:
    """Median and 90th percentile."""
    return f"{np.median(values):.2f} ({np.quantile(values, 0.9):.2f})" if values else "-"
