"""Which bags a command line names, and as what."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest
import yaml

from gsense_fusion.cli import add_bag_arguments, named_roles
from gsense_fusion.identification.types import IdentificationError, Role


def _named(*arguments: str | Path) -> list[tuple[Path, Role]]:
    parser = argparse.ArgumentParser()
    add_bag_arguments(parser)
    return named_roles(parser.parse_args([str(a) for a in arguments]))


def _campaign(folder: Path, roles: list[str]) -> Path:
    folder.mkdir()
    runs = [{"bag": f"run_{i:02d}", "role": role, "state": "done"} for i, role in enumerate(roles)]
    (folder / "index.yaml").write_text(yaml.safe_dump({"runs": runs}), encoding="utf-8")
    return folder


def test_campaigns_and_single_bags_are_one_session(tmp_path: Path) -> None:
    old, new = _campaign(tmp_path / "old", ["fit", "held_out"]), _campaign(tmp_path / "new", ["held_out"])
    more, judge = tmp_path / "more", tmp_path / "judge"
    assert _named("--campaign", old, new / "index.yaml", "--fit", more, "--held-out", judge) == [
        (old / "run_00", Role.FIT),
        (more, Role.FIT),
        (old / "run_01", Role.HELD_OUT),
        (new / "run_00", Role.HELD_OUT),
        (judge, Role.HELD_OUT),
    ]


def test_a_bag_of_a_campaign_is_not_named_again(tmp_path: Path) -> None:
    campaign = _campaign(tmp_path / "campaign", ["fit", "held_out"])
    with pytest.raises(IdentificationError, match="a run that is fitted cannot judge"):
        _named("--campaign", campaign, "--fit", campaign / "run_01")
    with pytest.raises(IdentificationError, match="named twice"):
        _named("--campaign", campaign, campaign)


def test_no_campaign_is_said(tmp_path: Path) -> None:
    with pytest.raises(IdentificationError, match="no such file or folder"):
        _named("--campaign", tmp_path / "nowhere")
    with pytest.raises(IdentificationError, match="nor a campaign"):
        _named("--campaign", tmp_path)
