"""The peers' STLSQ against PySINDy's on the same matrices: the same columns, the same coefficients?

    python -m pip install --target DIR pysindy
    ./rig exec python tests/study/stlsq.py DIR

PySINDy brings scikit-learn with it, which nothing else here needs: it is no requirement of the study.
"""

from __future__ import annotations

import itertools
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from tests.study import peers  # noqa: E402
from tests.study.cases import Case, with_disturbances  # noqa: E402
from tests.study.simulator import simulate  # noqa: E402

KINDS = ((), ("rectification",), ("rail_curvature", "time_offset"), ("brush_current",), ("temperature_bias",))
RATE_HZ = 25.0
ENERGY = 4000.0


def main() -> int:
    """Compare on sessions of the study; 0 where every choice of columns is the same."""
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    sys.path.append(sys.argv[1])  # behind the environment's own numpy and scipy
    try:
        import pysindy
    except ImportError as error:
        print(f"{sys.argv[1]}: no pysindy there ({error}); python -m pip install --target DIR pysindy", file=sys.stderr)
        return 2
    warnings.simplefilter("ignore")
    apart = [x for number, kinds in enumerate(KINDS) for x in _apart(pysindy, 20_001 + number, kinds)]
    same = [x for x in apart if x is not None]
    print(f"PySINDy {pysindy.__version__}: the same columns in {len(same)} of {len(apart)} fits;")
    print(f"coefficients differ by at most {max(same, default=0.0):.1e} of the largest")
    return 0 if len(same) == len(apart) else 1


def _apart(pysindy: Any, seed: int, kinds: tuple[str, ...]) -> Iterator[float | None]:
    """Of every threshold and axis of a session: the largest difference over the largest coefficient.

    None where the columns are not the same.
    """
    data = peers._prepare(simulate(with_disturbances(Case("peers", kinds, ENERGY, seed, RATE_HZ))))
    xx, xy, _, n = peers._grams(data, data.fit)
    X, y = (np.concatenate([part[i] for i in data.fit]) for part in (data.columns, data.rate))
    size = np.sqrt(np.diag(xx) / n)
    live = size > 0
    free = np.isin(data.group, (-1, 0))[live]
    for threshold, axis in itertools.product(peers.THRESHOLDS, range(3)):
        keep = peers._thresholded(data, xx, xy, n, axis, threshold)
        ours = (peers._least_squares(xx, xy[:, axis], keep) * size)[live]
        rival = pysindy.STLSQ(threshold, alpha=1e-9 * n, sparse_ind=list(np.flatnonzero(~free)), unbias=False)
        rival.fit(X[:, live] / size[live], y[:, [axis]])
        theirs = np.zeros(len(ours))
        theirs[~free], theirs[free] = rival.coef_.ravel(), rival.optvar_non_sparse_.ravel()
        alike = np.array_equal(ours != 0, theirs != 0)
        yield float(np.abs(ours - theirs).max() / np.abs(ours).max()) if alike else None


if __name__ == "__main__":
    sys.exit(main())
