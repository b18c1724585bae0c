"""Command: hex files for the PIC16F15356, and their sizes."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from programs import FLASH_WORDS, PROGRAMS, RAM_BYTES, Builder, BuildError
from toolchain import ToolchainMissingError, ensure


def main() -> int:
    """Exit 0: built, or skipped with the reason on the last line; 1: a source was refused."""
    parser = argparse.ArgumentParser(prog="firmware/pic/build", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/pic"), metavar="DIR", help="default: out/pic")
    out = parser.parse_args().out
    try:
        builder = Builder(ensure(), out.resolve())
        for program in PROGRAMS:
            built = builder.build(program)
            print(
                f"{out / built.hex.name}: {built.flash_words} of {FLASH_WORDS} words of flash, "
                f"{built.ram_bytes} of {RAM_BYTES} bytes of RAM"
            )
    except ToolchainMissingError as reason:
        print(f"SKIP: {reason}")
    except BuildError as error:
        print(f"firmware/pic/build: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
