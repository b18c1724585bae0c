"""YAML that others wrote: plain values, or a ValueError of one line whatever it holds."""

from __future__ import annotations

from typing import Any

import yaml

_QUICK = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml's where there is one: ten times as quick."""
_MANY = 10_000
"""Openers of a level; libyaml's loader recurses on the C stack, and ends the process where it is nested too deep."""


def parse_yaml(text: str) -> Any:
    """The content of a document.

    Raises:
        ValueError: it is not YAML, or holds values that no YAML has (the month 99); one line, with the line's number
            where that is known.
    """
    deep = max(map(text.count, ("[", "{", "- ", "? "))) > _MANY
    try:
        try:
            return yaml.load(text, yaml.SafeLoader if deep else _QUICK)  # noqa: S506 # safe ones
        except yaml.YAMLError:
            return yaml.safe_load(text)  # says more truly where the mistake is
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = "" if mark is None else f"line {mark.line + 1}: "
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or error
        raise ValueError(f"{where}not YAML ({' '.join(str(problem).split())})") from error
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    except Exception as error:  # PyYAML's constructors let through what int(), datetime() and others raise
        raise ValueError(f"not YAML ({type(error).__name__}: {' '.join(str(error).split())})") from error
