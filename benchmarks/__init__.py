"""Benchmarks of the speed and the reliability of the toolkit.

``python -m benchmarks`` (or ``./dev bench``) prints speeds, ``python -m benchmarks.adversary`` and
``python -m benchmarks.crashes`` damage studies.
"""

import os

# One core: ratios to a threaded BLAS would say more about the machine than about the code. The
# libraries read this when they are imported.
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
