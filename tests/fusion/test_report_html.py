"""The page: every verdict, self-contained, small, escaped, equal for equal input."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from tests.fusion import report_results as made

from gsense_fusion.identification.result import LoopResult, Plots, RunErrors
from gsense_fusion.report.figures import Figure, figures
from gsense_fusion.report.html import report_html

VOID = {"meta", "br", "img", "link", "input", "hr"}
LOADING = {"src", "srcset", "data", "poster", "action", "background"}


class Page(HTMLParser):
    """Checks nesting, gathers text, and everything that a browser would load or run."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.stack: list[str] = []
        self.loads: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.parts: list[str] = []
        self.feed(text)
        self.close()
        assert self.stack == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            local = name.split(":")[-1]
            if local in LOADING or (local == "href" and not (value or "").startswith("#")) or local.startswith("on"):
                self.loads.append(f"{tag} {name}={value}")
            if name == "id" and value is not None:
                self.ids.append(value)
        if tag not in VOID:
            self.stack.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.stack.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.stack, f"</{tag}> closes nothing"
        assert self.stack.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.stack and self.stack[-1] not in ("style", "script"):
            self.parts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.parts).split())


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return {name: report_html(make()) for name, make in made.ALL.items()}


@pytest.fixture(scope="module")
def drawn() -> tuple[Figure, ...]:
    return figures(made.effects_found())


@pytest.mark.parametrize("name", made.ALL)
def test_every_verdict_is_a_complete_self_contained_small_page(pages: dict[str, str], name: str) -> None:
    page = Page(pages[name])
    assert page.loads == []
    assert not {"script", "link", "iframe", "object", "img"} & set(page.tags)
    assert not re.search(r"@import|url\((?!#)|url\(['\"]?https?:", pages[name])
    assert len(pages[name].encode()) < 1_000_000
    assert len(page.ids) == len(set(page.ids))
    assert "Undefined" not in page.text
    assert "nan" not in page.text.lower().split()


def test_equal_input_gives_an_equal_page(pages: dict[str, str]) -> None:
    assert report_html(made.effects_found()) == pages["effects_found"]
    assert report_html(made.still_poses()) == pages["still_poses"]


def test_badges_and_sections_follow_the_verdict(pages: dict[str, str]) -> None:
    text = {name: Page(page).text for name, page in pages.items()}
    assert text["nothing_missing"].count("nothing is missing") >= 2  # badge and sentence
    assert "No effect of the catalogue is needed" in text["nothing_missing"]
    assert "effects found" in text["effects_found"]
    assert "correct the rig's reference attitude, not the gyro" in text["effects_found"]
    assert "cannot tell it from speed_pickup" in text["effects_found"]
    assert "board turned by 180 degrees" in text["effects_found"]
    assert "effects found, and something unexplained" in text["partly_unexplained"]
    assert "locked to the drive at order 2" in text["only_unexplained"]
    assert "2.00 Hz" in text["only_unexplained"]
    assert "Nearest effects of the catalogue: g_cubed" in text["only_unexplained"]
    assert "Unexplained" not in text["effects_found"]


def test_parameters_stand_in_both_units_with_their_interval(pages: dict[str, str]) -> None:
    text = Page(pages["effects_found"]).text
    assert "0.130 ± 0.004 deg/m" in text
    assert "0.00227 ± 0.00007 rad/m" in text
    assert "0.0562 ± 0.0011" in text  # g_xy = 1e-4 (rad/s)/(m/s^2) = 0.05619 deg/s/g, its 95 % interval 0.0011
    assert "(not identified)" in text  # column z of G: a thousand times wider


def test_numbers_of_runs_and_losses(pages: dict[str, str]) -> None:
    text = Page(pages["effects_found"]).text
    assert "2 fitted, 1 held out" in text
    assert "4 (0.02 %)" in text
    assert "5.10" in text  # ms
    assert "run_02 held out 5.00 150.0" in text


def test_figures_in_order(drawn: tuple[Figure, ...], pages: dict[str, str]) -> None:
    assert [f.key for f in drawn] == made.FIGURE_KEYS
    assert [i for i in Page(pages["effects_found"]).ids if i.startswith("figure-")] == [
        f"figure-{key}" for key in made.FIGURE_KEYS
    ]
    assert [i for i in Page(pages["still_poses"]).ids if i.startswith("figure-")] == ["figure-per_run", "figure-poses"]


def test_what_has_no_data_is_absent() -> None:
    result = made.effects_found()
    empty = replace(result, plots=Plots(), ranking=(), notes=(), undecided=(), declared_parameters={}, runs=())
    assert figures(empty) == ()
    text = Page(report_html(empty)).text
    assert "Figures" not in text
    assert "Models tried" not in text


def test_figures_are_well_formed_and_light(drawn: tuple[Figure, ...]) -> None:
    for figure in drawn:
        root = ET.fromstring(figure.svg)
        assert root.get("viewBox") is not None
        assert root.get("width") is None  # it scales with the page
        assert len(figure.svg) < 150_000, figure.key


def test_without_findings_the_full_model_is_not_drawn_over_the_declared(
    drawn: tuple[Figure, ...], pages: dict[str, str]
) -> None:
    assert all("with the findings" in f.svg for f in drawn)
    assert "with the findings" not in pages["nothing_missing"]


def test_a_long_run_stays_light() -> None:
    trace = made.plots(samples=400_000).attitude
    (figure,) = figures(replace(made.effects_found(), plots=Plots(attitude=trace)))
    assert len(figure.svg) < 200_000


def test_odd_values_do_not_break_the_page() -> None:
    plots = Plots(per_run=(RunErrors("rest", None, 0.0, 0.0, 0.0, 0.0),), spectrum_hz=np.array([1.0, 2.0]))
    odd = made.rail()
    parameters = {**odd.parameters, "t_z": replace(odd.parameters["t_y"], stderr=float("inf"))}
    rms = replace(made.effects_found().rate_rms, raw=float("nan"), full=0.0)
    result = replace(
        made.effects_found(), plots=plots, findings=(replace(odd, parameters=parameters, p_value=0.0),), rate_rms=rms
    )
    assert "± unbounded" in Page(report_html(result)).text


def test_flat_data_can_be_drawn() -> None:
    plots = made.plots()
    assert plots.orders is not None
    assert plots.ellipse is not None
    zero = np.zeros((20, 3))
    flat = Plots(
        orders=replace(plots.orders, declared=zero, full=zero, noise=zero),
        ellipse=replace(plots.ellipse, measured=np.zeros(73), declared=np.zeros(73), full=np.zeros(73)),
    )
    assert [f.key for f in figures(replace(made.effects_found(), plots=flat))] == ["orders", "ellipse"]


NASTY = "<script>alert(1)</script>&\"' $x_1$ \u202e"


def _nasty() -> LoopResult:
    result = made.partly_unexplained()
    plots = made.plots()
    assert plots.ellipse is not None
    assert plots.position is not None
    assert plots.attitude is not None
    plots = Plots(
        per_run=tuple(replace(e, bag=NASTY, angular_frequency=None) for e in plots.per_run),
        ellipse=replace(plots.ellipse, bag=NASTY),
        position=replace(plots.position, bag=NASTY),
        attitude=replace(plots.attitude, run=NASTY),
    )
    assert result.unexplained is not None
    return replace(
        result,
        sensor=NASTY,
        unit_id=NASTY,
        runs=tuple(replace(r, bag=f"/data/{NASTY}") for r in result.runs),
        findings=(replace(made.rail(), equation=NASTY, source=NASTY, alternatives=(NASTY,)),),
        unexplained=replace(result.unexplained, description=NASTY, nearest_effects=(NASTY,)),
        notes=(NASTY,),
        undecided=(NASTY,),
        plots=plots,
    )


def test_text_from_bags_is_escaped_everywhere() -> None:
    text = report_html(_nasty())
    page = Page(text)
    assert "<script" not in text
    assert page.loads == []
    assert page.text.count("<script>alert(1)</script>") > 8
