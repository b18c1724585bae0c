"""What Python calls of a compiled filter: one sample without and with a field, and many; made of the filter's step."""

from __future__ import annotations

from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from gsense_fusion.compiling import kernel

from .kernels import SIGNATURE_BATCH, SIGNATURE_FIELD, SIGNATURE_IMU, load, store, vector


class Entries(NamedTuple):
    """Kernels of a `CompiledFilter`."""

    imu: Any
    field: Any
    batch: Any


def entries(step: Any, filter_name: str) -> Entries:
    """Compile the three around a step (`kernels.SIGNATURE_STEP`).

    Each is a copy of a function below that finds `step` among its globals: numba compiles the call into it, and the
    cache, which goes by the function's name, keeps one file for each filter.
    """

    def bound(template: Any) -> Any:
        made = FunctionType(template.__code__, {**globals(), "_step": step}, template.__name__)
        made.__qualname__ = f"{filter_name}{template.__name__}"
        return made

    return Entries(
        kernel(SIGNATURE_IMU, allocates=False)(bound(_imu)),
        kernel(SIGNATURE_FIELD, allocates=False)(bound(_field)),
        kernel(SIGNATURE_BATCH)(bound(_batch)),
    )


_step: Any = None  # the templates are never called themselves


def _imu(m, dt, rate, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, _step(m, load(m), dt, vector(rate), vector(force), (0.0, 0.0, 0.0), False))


def _field(m, dt, rate, force, mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, _step(m, load(m), dt, vector(rate), vector(force), vector(mag), True))


def _batch(m, dt, rate, force, mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    out = np.empty((dt.shape[0], 4))
    fields = mag.shape[0] > 0
    q = load(m)
    for i in range(dt.shape[0]):
        field = vector(mag[i]) if fields else (0.0, 0.0, 0.0)
        q = _step(m, q, dt[i], vector(rate[i]), vector(force[i]), field, fields)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q
    store(m, q)
    return out
