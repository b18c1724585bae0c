"""The parser of a command, taken from its own entry point just before it would parse."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from unittest import mock

from reference.packages import Executable

# `record` is a node as well; these arguments lead to its parser.
_ARGUMENTS = {"record": ["--repair", "bag"]}


class _ParserFoundError(Exception):
    def __init__(self, parser: argparse.ArgumentParser) -> None:
        super().__init__(parser.prog)
        self.parser = parser


@dataclass(frozen=True)
class Option:
    """One argument of a command."""

    names: str
    value: str
    default: str
    text: str


def parser_of(executable: Executable) -> argparse.ArgumentParser | None:
    """The command's parser; None where it has none (a node)."""

    def stop(parser: argparse.ArgumentParser, *_: object, **__: object) -> Any:
        raise _ParserFoundError(parser)

    main = getattr(importlib.import_module(executable.module), executable.function)
    arguments = [executable.name, *_ARGUMENTS.get(executable.name, [])]
    with (
        mock.patch.object(argparse.ArgumentParser, "parse_args", stop),
        mock.patch.object(argparse.ArgumentParser, "parse_known_args", stop),
        mock.patch.object(sys, "argv", arguments),
    ):
        try:
            main()
        except _ParserFoundError as found:
            return found.parser
    return None


def options(parser: argparse.ArgumentParser) -> Iterator[Option]:
    """The parser's arguments but --help, in its order."""
    for action in parser._actions:  # noqa: SLF001  (argparse has no other way to list them)
        if "--help" not in action.option_strings and action.help != argparse.SUPPRESS:
            yield _option(action)


def _option(action: argparse.Action) -> Option:
    name = action.dest.upper()
    value = " or ".join(map(str, action.choices)) if action.choices else _words(action.metavar or name)
    if action.nargs == 0:
        value = ""
    elif action.nargs in ("+", "*"):
        value += " ..."
    names = ", ".join(action.option_strings) or str(action.metavar or name)
    plain = action.default in (None, False, argparse.SUPPRESS) or action.default == []
    default = "needed" if action.required else "" if plain else _words(action.default)
    if action.dest == "jobs" and default:  # the number of this machine's
        default = "one a core"
    text = " ".join(((action.help or "") % {"default": action.default}).split())
    return Option(names, "" if names == value else value, default, text)


def _words(default: object) -> str:
    if isinstance(default, (list, tuple)):
        return " ".join(map(str, default))
    return str(default)
