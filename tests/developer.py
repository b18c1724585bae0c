"""The developers' commands (benchmarks, studies): their options, told with defaults; a wrong one is a line."""

from __future__ import annotations

import argparse

from gsense_driver.user_input.arguments import ArgumentParser


class _Format(argparse.RawDescriptionHelpFormatter, argparse.ArgumentDefaultsHelpFormatter):
    """The docstring as it is written, and every option's default."""


def arguments(command: str, doc: str | None) -> ArgumentParser:
    """A parser for `command`, as it is typed, that `doc` describes."""
    return ArgumentParser(prog=command, description=doc, formatter_class=_Format)
