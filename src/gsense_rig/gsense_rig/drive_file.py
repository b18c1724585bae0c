"""The identified drive as a file: written by tuning, read at the rig's start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import yaml

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_rig.control.tuning import IDENTIFIED, TuneError, drive_from_mapping

if TYPE_CHECKING:
    from pathlib import Path

    from gsense_rig.plant.parameters import DriveParameters

SCHEMA = "gsense-drive/1"


def write(path: Path, drive: DriveParameters) -> None:
    """Write what was identified, by way of a temporary name.

    Raises:
        OSError: the file cannot be written.
    """
    names = (*IDENTIFIED, "static_friction")
    document = {"schema": SCHEMA, "drive": {name: getattr(drive, name) for name in names}}
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    temporary.replace(path)


def read(path: Path, nominal: DriveParameters) -> DriveParameters:
    """The nominal drive with the file's numbers.

    Raises:
        TuneError: the file is not a drive file; the message is one line that names it.
    """
    try:
        document = parse_yaml(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TuneError(f"{path}: {str(error).splitlines()[0]}") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise TuneError(f"{path}: no drive file (schema {SCHEMA}); call rig/tune to make one")
    try:
        return drive_from_mapping(document.get("drive"), nominal)
    except TuneError as error:
        raise TuneError(f"{path}: {error}") from error
