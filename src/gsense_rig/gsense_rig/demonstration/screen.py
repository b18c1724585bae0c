"""What a person sees while the demonstration works: a line a step, with its progress; plain where no terminal is."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

PLAIN_EVERY = 5.0
"""s from one line of progress to the next where stderr is no terminal."""


class Step:
    """One step at work."""

    def __init__(self, console: Console, title: str, bar: Progress | None, task: TaskID | None) -> None:
        self.title = title
        self.result = ""
        self.begun = time.monotonic()
        self._console = console
        self._bar, self._task = bar, task
        self._told = self.begun

    def show(self, text: str, part: float | None = None) -> None:
        """What is going on; `part` 0 to 1 where it is known."""
        if self._bar is not None and self._task is not None:
            total = None if part is None else 1.0
            self._bar.update(
                self._task, description=f"{escape(self.title)}  [dim]{escape(text)}", total=total, completed=part or 0.0
            )
        elif time.monotonic() - self._told >= PLAIN_EVERY:
            self._told = time.monotonic()
            done = "" if part is None else f" {100 * part:3.0f} %"
            self._console.print(f"    {self.title}:{done} {text}", markup=False, highlight=False)

    def done(self, result: str) -> None:
        """What came out; shown when the step ends."""
        self.result = result


class Screen:
    """Writes to stderr."""

    def __init__(self) -> None:
        self.console = Console(stderr=True, soft_wrap=True)

    def say(self, text: str) -> None:
        """A line of text."""
        self.console.print(text, markup=False, highlight=False)

    @contextmanager
    def step(self, title: str) -> Iterator[Step]:
        """A step: shown while it lasts, and left as one line with its result and duration."""
        if self.console.is_terminal:
            columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(24), TimeElapsedColumn())
            with Progress(*columns, console=self.console, transient=True) as bar:
                step = Step(self.console, title, bar, bar.add_task(escape(title), total=None))
                yield step
        else:
            self.console.print(f"  . {title}", markup=False, highlight=False)
            step = Step(self.console, title, None, None)
            yield step
        seconds = time.monotonic() - step.begun
        self.console.print(
            f"  [green]*[/] [bold]{escape(title)}[/]  {escape(step.result)} [dim]({seconds:.1f} s)", highlight=False
        )
