"""The command line's arguments: what is wrong with them in one line."""

from __future__ import annotations

import argparse
from typing import NoReturn


class ArgumentParser(argparse.ArgumentParser):
    """argparse's own, without the usage before the message: that is for `--help`."""

    def error(self, message: str) -> NoReturn:
        """Exit 2 with one line on stderr."""
        self.exit(2, f"{self.prog}: {message}; {self.prog} --help lists what it takes\n")
