"""The cache of compiled kernels: fresh while the same code would be compiled, stale once anything below changes."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import config

CALLED = """
from gsense_fusion.compiling import kernel
SHIFT = {shift}

@kernel("f8(f8)")
def below(x):
    return {factor} * x
"""
CALLING = """
from gsense_fusion.compiling import kernel
from kernels_below import SHIFT, below

@kernel("f8(f8)")
def above(x):
    return below(x) + SHIFT
"""
Load = Callable[..., Any]


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Load:
    """Writes both files, the calling one once, and imports them as a new process would."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "kernels_above.py").write_text(CALLING)

    def write_and_import(factor: float, shift: float, comment: str = "") -> Any:
        (tmp_path / "kernels_below.py").write_text(CALLED.format(factor=factor, shift=shift) + comment)
        for name in ("kernels_above", "kernels_below"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module("kernels_above").above

    return write_and_import


def hits(made: Any) -> int:
    return sum(made.stats.cache_hits.values())


def test_a_change_below_is_compiled_and_what_did_not_change_is_not(load: Load) -> None:
    first = load(2.0, 1.0)
    assert (first(3.0), hits(first)) == (7.0, 0)
    again = load(2.0, 1.0, comment="# a comment does not count\n")
    assert (again(3.0), hits(again)) == (7.0, 1)
    kernel_below = load(5.0, 1.0)
    assert (kernel_below(3.0), hits(kernel_below)) == (16.0, 0)
    constant_below = load(5.0, 4.0)
    assert (constant_below(3.0), hits(constant_below)) == (19.0, 0)


def test_a_kernel_takes_nothing_but_its_signature(load: Load) -> None:
    with pytest.raises(TypeError):
        load(2.0, 1.0)(np.zeros(3))
