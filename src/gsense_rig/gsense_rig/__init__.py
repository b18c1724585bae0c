"""Controls the linear rail, or simulates it, and records what the graph publishes."""

import os

# Before numpy loads its BLAS: the loop and the simulation work on small matrices, where threads only spin.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
