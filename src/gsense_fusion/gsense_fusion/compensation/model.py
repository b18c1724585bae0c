"""compensation.yaml (schema gsense-compensation/1) as typed values; its layout is in docs/calibration.md."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from gsense_driver.user_input.yaml_text import parse_yaml

from .document import Matrix, Section, Vector, write_atomically
from .terms import Term, parse_term, term_document
from .terms.numbers import finite, floats

SCHEMA = "gsense-compensation/1"


class CompensationError(ValueError):
    """The file cannot be used; one line that names the file and the key."""


@dataclass(frozen=True)
class ReferenceTerm:
    """A true rotation of the rig: corrects the reference attitude, never the gyro."""

    effect: str
    parameters: dict[str, Vector | float]


def rail_power(key: str) -> int | None:
    """Power of the position that a parameter of rail_curvature belongs to: t 1, u 2, w3 3 ...; None for another key."""
    known = {"t": 1, "u": 2}
    return int(key[1:]) if key[:1] == "w" and key[1:].isdecimal() else known.get(key)


@dataclass(frozen=True)
class AccelerometerCorrection:
    """True specific force = matrix (f - bias)."""

    matrix: Matrix
    bias: Vector
    """m/s^2."""


@dataclass(frozen=True)
class MagnetometerCorrection:
    """True field = soft_iron (B - hard_iron), up to the choice of its mean strength."""

    hard_iron: Vector
    """T."""
    soft_iron: Matrix


@dataclass(frozen=True)
class CompensationFile:
    """All that the file says."""

    sensor: str
    unit_id: str | None = None
    bias: Vector = (0.0, 0.0, 0.0)
    """rad/s, of the compensated rate; for a start without rest."""
    terms: tuple[Term, ...] = ()
    """Subtracted from the angular rate, in order."""
    gyro_delay_s: float = 0.0
    """The gyro's samples are this much later than the accelerometer's."""
    reference: tuple[ReferenceTerm, ...] = ()
    accelerometer: AccelerometerCorrection | None = None
    magnetometer: MagnetometerCorrection | None = None


def load_compensation(path: Path | str) -> CompensationFile:
    """Read and check a compensation file.

    Raises:
        CompensationError: unreadable, not YAML, or a key that is missing, unknown or of a wrong kind.
    """
    path = Path(path)
    try:
        content = parse_yaml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CompensationError(f"{path}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise CompensationError(f"{path}: not UTF-8 text ({error.reason} at byte {error.start})") from error
    except ValueError as error:
        raise CompensationError(f"{path}: {error}") from error
    try:
        return _parse(content)
    except ValueError as error:
        raise CompensationError(f"{path}: {error}") from error


def _parse(content: Any) -> CompensationFile:
    top = Section("", content)
    schema = top.text("schema")
    if schema != SCHEMA:
        raise ValueError(f"schema is {schema[:60]!r}, this version reads {SCHEMA!r}")
    file = CompensationFile(
        sensor=top.text("sensor"),
        unit_id=top.optional_text("unit_id"),
        bias=_bias(top),
        terms=tuple(parse_term(section) for section in top.sections("terms")),
        gyro_delay_s=_delay(top),
        reference=tuple(_reference(section) for section in top.sections("reference")),
        accelerometer=_accelerometer(top),
        magnetometer=_magnetometer(top),
    )
    top.no_others()
    return file


def _bias(top: Section) -> Vector:
    if not top.has("bias"):
        return (0.0, 0.0, 0.0)
    section = top.section("bias")
    section.unit("rad/s")
    bias = section.vector("value")
    section.no_others()
    return bias


def _delay(top: Section) -> float:
    if not top.has("timing"):
        return 0.0
    section = top.section("timing")
    delay = section.number("gyro_delay_s", 0.0)
    section.no_others()
    return delay


def _reference(section: Section) -> ReferenceTerm:
    effect = section.text("effect")
    return ReferenceTerm(effect, {name: section.number_or_vector(name) for name in section.other_keys()})


def _accelerometer(top: Section) -> AccelerometerCorrection | None:
    if not top.has("accelerometer"):
        return None
    section = top.section("accelerometer")
    section.unit("m/s^2")
    correction = AccelerometerCorrection(section.matrix("matrix"), section.vector("bias"))
    section.no_others()
    return correction


def _magnetometer(top: Section) -> MagnetometerCorrection | None:
    if not top.has("magnetometer"):
        return None
    section = top.section("magnetometer")
    section.unit("T")
    correction = MagnetometerCorrection(section.vector("hard_iron"), section.matrix("soft_iron"))
    section.no_others()
    return correction


def write_compensation(path: Path | str, file: CompensationFile) -> None:
    """Write a compensation file; complete or not at all (a temporary name, then a rename).

    Raises:
        ValueError: a value that is not finite.
        OSError: the folder is not writable.
    """
    write_atomically(Path(path), compensation_yaml(file))


def compensation_yaml(file: CompensationFile) -> str:
    """The document as text; raises ValueError where a value is not finite."""
    document = {
        "schema": SCHEMA,
        "sensor": file.sensor,
        "unit_id": file.unit_id,
        "bias": {"value": floats(file.bias), "unit": "rad/s"},
        "terms": [term_document(term) for term in file.terms],
        "timing": {"gyro_delay_s": finite(file.gyro_delay_s)},
        "reference": [_reference_document(term) for term in file.reference],
    }
    if file.accelerometer is not None:
        document["accelerometer"] = {
            "matrix": floats(file.accelerometer.matrix),
            "bias": floats(file.accelerometer.bias),
            "unit": "m/s^2",
        }
    if file.magnetometer is not None:
        document["magnetometer"] = {
            "hard_iron": floats(file.magnetometer.hard_iron),
            "soft_iron": floats(file.magnetometer.soft_iron),
            "unit": "T",
        }
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=120)


def _reference_document(term: ReferenceTerm) -> dict[str, Any]:
    values = {n: floats(v) if isinstance(v, tuple) else finite(v) for n, v in term.parameters.items()}
    return {"effect": term.effect, **values}
