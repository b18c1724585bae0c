"""The manifest: what is understood, what is refused in one line, and how sessions get their names."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from gsense_fusion.many.entries import Session, find_sessions
from gsense_fusion.many.manifest import Choices, ManifestError, parse_manifest

HERE = Path("/data/all.yaml")


def sessions(folder: Path, *entries: object) -> list[Session]:
    text = yaml.safe_dump({"entries": list(entries)})
    return find_sessions(parse_manifest(text, folder / "all.yaml", Choices()), folder)


def bag(folder: Path, size: int = 10) -> Path:
    folder.mkdir(parents=True)
    (folder / "metadata.yaml").write_text("x" * size)
    return folder


def campaign(folder: Path, *roles: str) -> Path:
    runs = [{"bag": f"run_{i}", "role": role, "state": "done"} for i, role in enumerate(roles)]
    for run in runs:
        bag(folder / run["bag"])
    (folder / "index.yaml").write_text(yaml.safe_dump({"runs": [*runs, {**runs[0], "bag": "no", "state": "pending"}]}))
    return folder


def test_an_entry_overrides_the_command_line() -> None:
    text = """
entries:
  - {campaign: march, sensor: bno055, effects: mine.py, latitude: 49.2, rail_azimuth: 30, unit_id: B7}
  - {fit: run_1, held_out: [run_2], declared: [bias]}
"""
    first, second = parse_manifest(text, HERE, Choices(sensor="lisy300", latitude=1.0, rail_azimuth=2.0))
    declared = ("bias", "g_sensitivity")
    assert first.choices == Choices("bno055", declared, Path("/data/mine.py"), 49.2, 30.0)
    assert (first.campaign, first.unit_id) == ("march", "B7")
    assert second.choices == Choices("lisy300", ("bias",), None, 1.0, 2.0)
    assert (second.fit, second.held_out) == (("run_1",), ("run_2",))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "a mapping is needed, not nothing"),
        ("entries: []", "has no list `entries:`"),
        ("entries: 3", "entries: a list is needed"),
        ("entries: [3]", "entries[0]: a mapping is needed"),
        ("entries: [{campaign: a, fit: b}]", "entries[0]: give either `campaign:` or `fit:`"),
        ("entries: [{name: a}]", "entries[0]: give either"),
        ("entries: [{campaign: a, held_out: b}]", "`held_out:` goes with `fit:`"),
        ("entries: [{fit: [1, 2]}]", "entries[0].fit: a text or a list of texts is needed"),
        ("entries: [{campaign: a, latitude: .nan}]", "entries[0].latitude: a finite number is needed"),
        ("entries: [{campaign: a, sensors: b}]", "entries[0].sensors: not a key of this schema"),
        ("entries: [{campaign: a}]\nmore: 1", "more: not a key"),
        ("schema: gsense-index/1\nruns: []", "the index of a campaign, not a manifest: --campaign /data in place of"),
        ("entries: [", "line 1: not YAML"),
        ("a: &a [*a]", "not a key"),
    ],
)
def test_what_is_not_understood_is_refused_with_its_place(text: str, words: str) -> None:
    with pytest.raises(ManifestError) as caught:
        parse_manifest(text, HERE, Choices())
    line = str(caught.value)
    assert line.startswith("/data/all.yaml:")
    assert words in line
    assert "\n" not in line


def test_campaigns_by_pattern_with_the_roles_of_their_index(tmp_path: Path) -> None:
    for name in ("b", "a"):
        campaign(tmp_path / name, "fit", "held_out")
    (tmp_path / "notes.txt").write_text("")
    found = sessions(tmp_path, {"campaign": "*"}, {"campaign": str(tmp_path / "*/index.yaml"), "sensor": "bno055"})
    assert [s.name for s in found] == ["a", "b", "a-bno055", "b-bno055"]
    assert [(p.name, role.value) for p, role in found[0].request.bags] == [("run_0", "fit"), ("run_1", "held_out")]
    assert found[0].size == 20
    assert all(s.problem is None for s in found)


def test_bags_by_pattern(tmp_path: Path) -> None:
    for n in range(4):
        bag(tmp_path / "march" / f"run_{n}")
    (found,) = sessions(tmp_path, {"fit": "march/run_*", "held_out": ["march/run_2"]})
    assert found.name == "march"
    assert [(p.name, role.value) for p, role in found.request.bags] == [
        ("run_0", "fit"),
        ("run_1", "fit"),
        ("run_3", "fit"),
        ("run_2", "held_out"),
    ]


def test_what_is_missing_is_that_sessions_own_problem(tmp_path: Path) -> None:
    campaign(tmp_path / "good", "fit")
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "index.yaml").write_bytes(b"\xff\xfe")
    found = sessions(
        tmp_path,
        {"campaign": "gone*"},
        {"campaign": "good"},
        {"campaign": "bad"},
        {"fit": "run_[0-9]"},
        {"fit": ["one"], "held_out": ["one"], "name": "twice"},
    )
    problems = [s.problem for s in found]
    assert problems[1] is None
    for problem, words in zip(
        (problems[0], *problems[2:]),
        ("no campaign matches", "no index of a campaign", "no bag matches", "cannot judge"),
        strict=True,
    ):
        assert problem is not None
        assert words in problem


def test_the_first_keeps_its_name_and_later_ones_say_more(tmp_path: Path) -> None:
    for month in ("march", "june"):
        campaign(tmp_path / month / "A7", "fit")
    found = sessions(tmp_path, *({"campaign": f"{m}/A7", "sensor": s} for m in ("march", "june") for s in ("a", "b")))
    assert [s.name for s in found] == ["A7", "A7-b", "A7-a", "june-A7"]


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ([{"campaign": "a", "name": "x"}, {"campaign": "b", "name": "x"}], "both named 'x'"),
        ([{"campaign": "a", "name": "../x"}], "no name of a folder"),
        ([{"campaign": "a", "name": ".x"}], "no name of a folder"),
        ([{"campaign": "*", "name": "x"}], "matches 2 campaigns; leave the name out"),
    ],
)
def test_names_that_cannot_be_are_refused(tmp_path: Path, entries: list[object], words: str) -> None:
    for name in ("a", "b"):
        campaign(tmp_path / name, "fit")
    with pytest.raises(ManifestError, match=words.replace("(", "\\(")):
        sessions(tmp_path, *entries)
