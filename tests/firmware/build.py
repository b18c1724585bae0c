"""Builds firmware and tests, sanitized and instrumented, in a folder that is kept between runs."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
OPTIONS = ("-DGSENSE_SANITIZE=ON", "-DGSENSE_COVERAGE=ON", "-DCMAKE_BUILD_TYPE=Debug")


class BuildError(RuntimeError):
    """Configuring or compiling failed; the text is the compiler's."""


def build_folder(name: str, fallback: Path) -> Path:
    """Under .rig where the entry script keeps its things, else a temporary folder."""
    return ROOT / ".rig" / "cache" / name if (ROOT / ".rig").is_dir() else fallback / name


def build(folder: Path, *options: str) -> Path:
    """Configures and makes everything; fast where nothing changed."""
    for command in (
        ["cmake", "-S", str(FIRMWARE), "-B", str(folder), *OPTIONS, *options],
        ["cmake", "--build", str(folder), "--parallel", "2"],
    ):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise BuildError(f"{' '.join(command)}\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return folder


def has_cmocka(folder: Path) -> bool:
    """Whether the compiler finds cmocka's header and library (folder: for the probe's output)."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "probe.c"
    source.write_text(
        "#include <stdarg.h>\n#include <stddef.h>\n#include <stdint.h>\n#include <setjmp.h>\n#include <cmocka.h>\n"
        "int main(void) { return 0; }\n"
    )
    compiler = shutil.which("cc") or shutil.which("gcc")
    command = [str(compiler), str(source), "-lcmocka", "-o", str(folder / "probe")]
    return compiler is not None and subprocess.run(command, capture_output=True, check=False).returncode == 0
