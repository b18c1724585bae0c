"""The manifest: which sessions are to be analysed, and how. YAML in, typed entries out; no file but itself is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_fusion.compensation.document import Section


class ManifestError(ValueError):
    """The manifest or the folder cannot be used; the message is one line."""


@dataclass(frozen=True)
class Choices:
    """How a session is analysed, where the entry does not say otherwise; as the options of `close_loop`."""

    sensor: str = "mpu6050"
    declared: tuple[str, ...] = ("bias", "g_sensitivity")
    effects: Path | None = None
    latitude: float | None = None
    rail_azimuth: float | None = None


@dataclass(frozen=True)
class ManifestEntry:
    """One entry as it is written: a pattern of campaigns, or patterns of bags that make one session."""

    place: str
    """What messages call it, e.g. `entries[3]`."""
    choices: Choices
    campaign: str | None = None
    fit: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    name: str | None = None
    unit_id: str | None = None
    """Of bags that do not name their unit."""


def parse_manifest(text: str, path: Path, choices: Choices) -> tuple[ManifestEntry, ...]:
    """The entries of a manifest.

    Args:
        text: The YAML.
        path: Of the manifest: relative paths in it start from its folder.
        choices: What the command line says.

    Raises:
        ManifestError: it is not YAML, or says what is not understood; one line with the entry and the key.
    """
    try:
        document = parse_yaml(text)
        _no_index(document, path)
        top = Section("", document)
        entries = [_entry(section, path, choices) for section in top.sections("entries")]
        top.no_others()
    except ValueError as error:
        raise ManifestError(f"{path}: {error}") from error
    if not entries:
        raise ManifestError(f"{path}: has no list `entries:` with at least one entry")
    return tuple(entries)


def _no_index(document: object, path: Path) -> None:
    """A campaign's index has a list of runs too, and lies where a manifest may lie."""
    if isinstance(document, dict) and str(document.get("schema")).startswith("gsense-index/"):
        raise ValueError(f"the index of a campaign, not a manifest: --campaign {path.parent} in place of --manifest")


def _entry(section: Section, path: Path, choices: Choices) -> ManifestEntry:
    campaign = section.optional_text("campaign")
    fit, held_out = _texts(section, "fit"), _texts(section, "held_out")
    place = section.path.rstrip(".")
    if (campaign is None) == (not fit):
        raise ValueError(f"{place}: give either `campaign:` or `fit:` (with `held_out:`)")
    if campaign is not None and held_out:
        raise ValueError(f"{place}: `held_out:` goes with `fit:`; a campaign's index says its roles")
    effects = section.optional_text("effects")
    entry = ManifestEntry(
        place,
        Choices(
            section.optional_text("sensor") or choices.sensor,
            _texts(section, "declared") or choices.declared,
            choices.effects if effects is None else path.parent / effects,
            section.number("latitude") if section.has("latitude") else choices.latitude,
            section.number("rail_azimuth") if section.has("rail_azimuth") else choices.rail_azimuth,
        ),
        campaign,
        fit,
        held_out,
        section.optional_text("name"),
        section.optional_text("unit_id"),
    )
    section.no_others()
    return entry


def _texts(section: Section, key: str) -> tuple[str, ...]:
    """One text or a list of them; empty where the key is absent."""
    if not section.has(key):
        return ()
    return section.texts(key)
