"""compensation.yaml (schema gsense-compensation/1) as typed values; its layout is in docs/architecture.md."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import yaml

from .document import Section, write_atomically

SCHEMA = "gsense-compensation/1"
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


class CompensationError(ValueError):
    """The file cannot be used; one line that names the file and the key."""


@dataclass(frozen=True)
class GSensitivity:
    """Rate that specific force makes: `matrix @ f`, rows gyro axes, columns accelerometer axes, (rad/s)/(m/s^2).

    `k` instead of a matrix is the thesis's equation 7.4: k [f_y, f_z, f_x].
    """

    matrix: Matrix | None = None
    k: float | None = None

    def __post_init__(self) -> None:
        if (self.matrix is None) == (self.k is None):
            raise ValueError("g_sensitivity has either matrix or k")

    @property
    def full_matrix(self) -> Matrix:
        """The matrix, also where k is given."""
        if self.matrix is not None:
            return self.matrix
        k = float(self.k or 0.0)
        return ((0.0, k, 0.0), (0.0, 0.0, k), (k, 0.0, 0.0))


@dataclass(frozen=True)
class TemperatureBias:
    """Rate `c (T' - reference)`; T' follows the die temperature with a first-order lag."""

    c: Vector
    """rad/s/K."""
    reference: float
    """degrees Celsius."""
    lag_s: float = 0.0
    """Time constant, s; 0: no lag."""


@dataclass(frozen=True)
class ReferenceTerm:
    """A true rotation of the rig: corrects the reference attitude, never the gyro."""

    effect: str
    parameters: dict[str, Vector]


Term = GSensitivity | TemperatureBias


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


def load_compensation(path: Path | str) -> CompensationFile:
    """Read and check a compensation file.

    Raises:
        CompensationError: unreadable, not YAML, or a key that is missing, unknown or of a wrong kind.
    """
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CompensationError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (UnicodeDecodeError, yaml.YAMLError) as error:
        raise CompensationError(f"{path}: not YAML ({' '.join(str(error).split())})") from error
    try:
        return _parse(content)
    except ValueError as error:
        raise CompensationError(f"{path}: {error}") from error


def _parse(content: Any) -> CompensationFile:
    top = Section("", content)
    schema = top.text("schema")
    if schema != SCHEMA:
        raise ValueError(f"schema is {schema!r}, this version reads {SCHEMA!r}")
    sensor = top.text("sensor")
    unit_id = top.optional_text("unit_id")
    bias: Vector = (0.0, 0.0, 0.0)
    if top.has("bias"):
        section = top.section("bias")
        section.unit("rad/s")
        bias = section.vector("value")
        section.no_others()
    terms = tuple(_term(section) for section in top.sections("terms"))
    delay = 0.0
    if top.has("timing"):
        section = top.section("timing")
        delay = section.number("gyro_delay_s", 0.0)
        section.no_others()
    reference = tuple(_reference(section) for section in top.sections("reference"))
    top.no_others()
    return CompensationFile(sensor, unit_id, bias, terms, delay, reference)


def _term(section: Section) -> Term:
    effect = section.text("effect")
    if effect not in _TERMS:
        raise ValueError(f"{section.path}effect: {effect!r} is not known; known: {', '.join(sorted(_TERMS))}")
    term = _TERMS[effect](section)
    section.no_others()
    return term


def _g_sensitivity(section: Section) -> GSensitivity:
    section.unit("(rad/s)/(m/s^2)")
    if section.has("matrix") == section.has("k"):
        raise ValueError(f"{section.path}matrix: give either matrix (3 rows of 3) or k")
    if section.has("k"):
        return GSensitivity(k=section.number("k"))
    return GSensitivity(matrix=section.matrix("matrix"))


def _temperature_bias(section: Section) -> TemperatureBias:
    section.unit("rad/s/K")
    lag = section.number("lag_s", 0.0)
    if lag < 0:
        raise ValueError(f"{section.path}lag_s: {lag} is negative")
    return TemperatureBias(section.vector("c"), section.number("reference"), lag)


_TERMS: dict[str, Callable[[Section], Term]] = {"g_sensitivity": _g_sensitivity, "temperature_bias": _temperature_bias}


def _reference(section: Section) -> ReferenceTerm:
    effect = section.text("effect")
    names = section.other_keys()
    return ReferenceTerm(effect, {name: section.vector(name) for name in names})


def write_compensation(path: Path | str, file: CompensationFile) -> None:
    """Write a compensation file; complete or not at all (a temporary name, then a rename).

    Raises:
        ValueError: a value that is not finite.
        OSError: the folder is not writable.
    """
    terms = [_term_document(term) for term in file.terms]
    document = {
        "schema": SCHEMA,
        "sensor": file.sensor,
        "unit_id": file.unit_id,
        "bias": {"value": _floats(file.bias), "unit": "rad/s"},
        "terms": terms,
        "timing": {"gyro_delay_s": _finite(file.gyro_delay_s)},
        "reference": [
            {"effect": term.effect} | {name: _floats(value) for name, value in term.parameters.items()}
            for term in file.reference
        ],
    }
    write_atomically(Path(path), yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=120))


def _term_document(term: Term) -> dict[str, Any]:
    if isinstance(term, TemperatureBias):
        return {
            "effect": "temperature_bias",
            "c": _floats(term.c),
            "reference": _finite(term.reference),
            "lag_s": _finite(term.lag_s),
            "unit": "rad/s/K",
        }
    value: dict[str, Any]
    if term.matrix is not None:
        value = {"matrix": [_floats(row) for row in term.matrix]}
    else:
        value = {"k": _finite(term.full_matrix[0][1])}
    return {"effect": "g_sensitivity", **value, "unit": "(rad/s)/(m/s^2)"}


def _floats(values: Vector) -> list[float]:
    return [_finite(value) for value in values]


def _finite(value: float) -> float:
    value = float(value)  # numpy's floats are no YAML
    if not isfinite(value):
        raise ValueError(f"a compensation file cannot hold {value}")
    return value
