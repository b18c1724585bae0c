"""What the set-up shows while it works, on stderr."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

_QUIET_S = 10.0  # a line at least this often where stderr is not a terminal
_TERMINAL_S = 0.2


def say(text: str) -> None:
    """Print one line."""
    print(f"gsense: {text}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def step(name: str) -> Iterator[Callable[[str], None]]:
    """Show a step's name, its progress through the function that is handed out, and its duration."""
    start = time.monotonic()
    last = start
    terminal = sys.stderr.isatty()
    say(f"{name} ...")

    def update(text: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < (_TERMINAL_S if terminal else _QUIET_S):
            return
        last = now
        line = f"gsense: {name}: {text}, {now - start:.0f} s"
        print(f"\r{line:<100}" if terminal else line, end="" if terminal else "\n", file=sys.stderr, flush=True)

    yield update
    if terminal and last != start:
        print("\r", end="", file=sys.stderr)
    say(f"{name}: done in {time.monotonic() - start:.1f} s{' ' * 60 if terminal else ''}")
