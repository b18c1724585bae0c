"""The command line of a node: `--help` tells its parameters, for machines without `ros2 param describe`."""

from __future__ import annotations

import shutil
from argparse import RawDescriptionHelpFormatter
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import fill
from types import SimpleNamespace
from typing import Any

from gsense_driver.user_input.arguments import ArgumentParser

_INDENT = 8


@dataclass(frozen=True)
class Parameter:
    """A parameter as a node declares it."""

    name: str
    default: Any
    descriptor: Any
    """rcl_interfaces' ParameterDescriptor."""


class _Notes:
    """Stands in the node's place: writes down what is declared; every parameter has its default."""

    def __init__(self) -> None:
        self.parameters: dict[str, Parameter] = {}

    def declare_parameter(self, name: str, default: Any, descriptor: Any) -> Any:
        self.parameters[name] = Parameter(name, default, descriptor)
        return self.get_parameter(name)

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self.parameters[name].default)


def node_parser(program: str, about: str, declare: Callable[[Any], object]) -> ArgumentParser:
    """The parser of a node that has no arguments of its own.

    Args:
        program: the executable's name.
        about: what the node does.
        declare: declares the node's parameters.
    """
    width = max(60, shutil.get_terminal_size().columns - 2)
    notes = _Notes()
    declare(notes)
    lines = ["parameters, each by `--ros-args -p NAME:=VALUE`, or in a file by `--ros-args --params-file FILE`:"]
    for parameter in notes.parameters.values():
        lines.append(f"  {parameter.name} ({_default(parameter)})")
        lines.append(fill(_meaning(parameter), width, initial_indent=" " * _INDENT, subsequent_indent=" " * _INDENT))
    usage = f"{program} [--ros-args -p NAME:=VALUE ...]"
    return ArgumentParser(
        program, usage, fill(about, width), "\n".join(lines), formatter_class=RawDescriptionHelpFormatter
    )


def allowed(descriptor: Any) -> str:
    """Range or choice of a parameter; empty where any value will do."""
    for found in (*descriptor.floating_point_range, *descriptor.integer_range):
        return f"{found.from_value:g} to {found.to_value:g}"
    return str(descriptor.additional_constraints)


def shown(value: Any) -> str:
    """A default in words."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return str(value)


def _default(parameter: Parameter) -> str:
    return f"default: {shown(parameter.default) or 'empty'}"


def _meaning(parameter: Parameter) -> str:
    limits = allowed(parameter.descriptor)
    return f"{parameter.descriptor.description}{f'; {limits}' if limits else ''}"
