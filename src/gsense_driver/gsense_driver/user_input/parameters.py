"""Parameters that a node was given and does not have: ROS ignores them, here they are one line."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from difflib import SequenceMatcher, get_close_matches
from itertools import pairwise
from pathlib import Path
from typing import Any

from rclpy.exceptions import ParameterException

from gsense_driver.user_input.yaml_text import parse_yaml

QOS = "qos_overrides."
"""Begins parameters of ROS that a node has only where it asks for them."""
_SLIP = 0.8
"""Likeness of two names of which one is taken for the other mistyped (difflib's ratio)."""


class UnknownParameterError(ParameterException):
    """A parameter that the node does not have; the message names the nearest one that it has, or all of them."""

    def __init__(self, name: str, near: str | None, own: Sequence[str]) -> None:
        hint = f"the nearest one is {near}" if near else f"this node has {', '.join(own)}"
        Exception.__init__(self, f"parameter {name} is unknown; {hint}")


def refuse_unknown(node: Any, arguments: Sequence[str] | None = None) -> None:
    """To be called by a node that has declared its parameters.

    What stands in a section for all nodes of a parameter file (`/**`) may be another node's, unless it looks like one
    of this node's, mistyped.

    Args:
        node: rclpy's node.
        arguments: the command line; None: that of this process.

    Raises:
        UnknownParameterError: a parameter was meant for this node, which does not have it.
    """
    own = sorted(node.get_parameters_by_prefix(""))
    given = node._parameter_overrides  # noqa: SLF001 - rclpy tells it nowhere else
    unknown = [name for name in sorted(set(given) - set(own)) if not name.startswith(QOS)]
    if not unknown:
        return
    meant = set(_named(sys.argv if arguments is None else arguments, node.get_name()))
    for name in unknown:
        near = (get_close_matches(name, own, 1) or [None])[0]
        if name in meant or (near and _is_slip(name, near)):
            raise UnknownParameterError(name, near, own)
    node.get_logger().info(f"taken for other nodes' parameters: {', '.join(unknown)}")


def _is_slip(name: str, right: str) -> bool:
    """Whether a name is another one with a letter too many, too few or wrong, or with letters in another order."""
    one, other = (text.replace("_", "").lower() for text in (name, right))
    return sorted(one) == sorted(other) or SequenceMatcher(None, one, other).ratio() >= _SLIP


def _named(arguments: Sequence[str], node: str) -> Iterator[str]:
    """Names of parameters that the command line and files give to this very node."""
    for word, value in pairwise(arguments):
        if word in ("-p", "--param"):
            yield value.partition(":=")[0].rpartition(":")[2]
        elif word == "--params-file":
            with suppress(OSError, ValueError):  # ROS has read it before, and said what is wrong with it
                yield from _in_file(parse_yaml(Path(value).read_text(encoding="utf-8")), node)


def _in_file(content: Any, node: str) -> Iterator[str]:
    """Names in the sections of one node, whatever its namespace."""
    for key, section in content.items() if isinstance(content, dict) else ():
        if str(key).rpartition("/")[2] == node and isinstance(section, dict):
            yield from _flat(section.get("ros__parameters", {}))
        yield from _in_file(section, node)


def _flat(section: Any, prefix: str = "") -> Iterator[str]:
    """Names with dots."""
    for key, value in section.items() if isinstance(section, dict) else ():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"
