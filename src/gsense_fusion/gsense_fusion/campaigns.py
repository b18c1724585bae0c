"""The bags of a campaign's folder, with their roles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_fusion.bags import is_bag
from gsense_fusion.identification.types import IdentificationError, Role

INDEX = "index.yaml"


def campaign_bags(path: Path) -> list[tuple[Path, Role]]:
    """The bags of a campaign with their roles: those that are done in index.yaml; without one, all, to be fitted.

    Args:
        path: A folder with index.yaml, that file, a folder of bags, or one bag.

    Raises:
        IdentificationError: there are none; one line.
    """
    if not path.exists():
        raise IdentificationError(f"{path}: no such file or folder")
    path = path.parent if path.name == INDEX else path
    if (path / INDEX).is_file():
        return _indexed(path)
    if is_bag(path):
        return [(path, Role.FIT)]
    bags = sorted(p for p in path.iterdir() if is_bag(p)) if path.is_dir() else []
    if not bags:
        raise IdentificationError(f"{path}: neither a report (report.json) nor a campaign ({INDEX} or bags)")
    return [(bag, Role.FIT) for bag in bags]


def _indexed(folder: Path) -> list[tuple[Path, Role]]:
    path = folder / INDEX
    try:
        runs: Sequence[dict[str, str]] = parse_yaml(path.read_text(encoding="utf-8"))["runs"]
        done = [(folder / r["bag"], Role(r["role"])) for r in runs if r["state"] == "done"]
    except (OSError, KeyError, TypeError, ValueError) as error:
        text = f"{type(error).__name__}: {error}"
        raise IdentificationError(f"{path}: no index of a campaign ({text})") from error
    if not done:
        raise IdentificationError(f"{path}: no run is done; make the campaign first")
    return done
