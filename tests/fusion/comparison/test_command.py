"""`close_loop --compare`: its files, the page, its one-line refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from rich.console import Console
from tests.fusion.comparison.reports import result, with_rail
from tests.fusion.test_report_html import Page

from gsense_fusion.campaigns import campaign_bags
from gsense_fusion.close_loop import main
from gsense_fusion.comparison.command import compare_paths
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import IdentificationError, Role
from gsense_fusion.report.document import report_json


def saved(folder: Path, made: LoopResult) -> Path:
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(report_json(made), encoding="utf-8")
    return folder


def test_table_json_and_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, out = saved(tmp_path / "old", result(1)), saved(tmp_path / "new", with_rail(2)), tmp_path / "out"
    assert main(["--compare", str(old), str(new / "report.json"), "--out", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2:] == [str(out / "compare.json"), str(out / "compare.html")]
    assert "rail_curvature (rig) entered" in lines[-3]
    assert any(line.split()[:2] == ["t_y", "0.0003"] or line.split()[:1] == ["t_y"] for line in lines)
    document = json.loads((out / "compare.json").read_text(encoding="utf-8"))
    assert document["schema"] == "gsense-compare/1"
    assert document["verdict"] == "changed"
    effects = {e["effect"]: e for e in document["effects"]}
    assert effects["rail_curvature"]["status"] == "entered"
    assert effects["g_sensitivity"]["dof"] == 3
    assert not effects["g_sensitivity"]["parameters"]["g_xy"]["identified"]
    assert document["new"]["found"] == ["rail_curvature"]
    text = (out / "compare.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.loads == []
    assert not {"script", "link", "iframe", "object", "img"} & set(page.tags)
    assert len(text.encode()) < 1_000_000
    assert [i for i in page.ids if i.startswith("figure-")] == [
        "figure-rail_curvature", "figure-g_sensitivity", "figure-differences", "figure-errors", "figure-noise",
        "figure-delay",
    ]  # fmt: skip
    assert "something changed" in page.text
    assert "nan" not in page.text.lower().split()


def test_without_out_the_table_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new = saved(tmp_path / "a", result(1)), saved(tmp_path / "b", result(2))
    assert main(["--compare", str(old), str(new)]) == 0
    assert "nothing changed" in capsys.readouterr().out.splitlines()[-1]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b"]


def test_a_campaign_is_analysed_first(tmp_path: Path) -> None:
    old, campaign = saved(tmp_path / "old", result(1)), tmp_path / "campaign"
    campaign.mkdir()
    runs = [
        {"bag": "run_00", "role": "fit", "state": "done"},
        {"bag": "run_01", "role": "held_out", "state": "done"},
        {"bag": "run_02", "role": "fit", "state": "pending"},
    ]
    (campaign / "index.yaml").write_text(yaml.safe_dump({"runs": runs}), encoding="utf-8")
    asked: list[list[tuple[Path, Role]]] = []

    def analyse(bags: list[tuple[Path, Role]]) -> LoopResult:
        asked.append(bags)
        return result(2)

    assert compare_paths(old, campaign, None, analyse, Console(quiet=True)) == []
    assert asked == [[(campaign / "run_00", Role.FIT), (campaign / "run_01", Role.HELD_OUT)]]


def test_a_folder_of_bags_is_fitted_whole(tmp_path: Path) -> None:
    for name in ("b", "a"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "metadata.yaml").touch()
    (tmp_path / "notes").mkdir()
    assert campaign_bags(tmp_path) == [(tmp_path / "a", Role.FIT), (tmp_path / "b", Role.FIT)]
    assert campaign_bags(tmp_path / "a") == [(tmp_path / "a", Role.FIT)]
    (tmp_path / "index.yaml").write_text("runs: [{bag: a}]", encoding="utf-8")
    with pytest.raises(IdentificationError, match="no index of a campaign"):
        campaign_bags(tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing", None, "no such file or folder"),
        ("empty/", None, "neither a report (report.json) nor a campaign"),
        ("text.json", "hello", "no report of close_loop"),
        ("other.json", '{"schema": "x/1"}', "schema 'x/1' is not gsense-close-loop/1"),
        ("half.json", '{"schema": "gsense-close-loop/1"}', "not a whole report (KeyError: 'runs')"),
    ],
)
def test_refusals_are_one_line_and_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | None, words: str
) -> None:
    old, path, out = saved(tmp_path / "old", result(1)), tmp_path / name, tmp_path / "out"
    if name.endswith("/"):
        path.mkdir()
    if content is not None:
        path.write_text(content, encoding="utf-8")
    assert main(["--compare", str(old), str(path), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert len(error.splitlines()) == 1
    assert str(path) in error
    assert words in error
    assert not out.exists()


def test_arguments_that_do_not_go_together(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["--compare", "a", "b", "--fit", "c"], ["--fit", "a"], ["--out", "a"], ["--compare", "a"]):
        with pytest.raises(SystemExit) as raised:
            main(arguments)
        assert raised.value.code == 2
        assert capsys.readouterr().err.startswith("close_loop: ")
