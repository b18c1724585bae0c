"""Attitude with and without g-compensation, and closing the loop on the gyro's model."""

import os

# Before numpy loads its BLAS: everything here works on small matrices, where threads only spin against one another.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
