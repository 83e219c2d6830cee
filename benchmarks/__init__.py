"""Benchmarks: what a control step costs, as ratios of paired rounds in one process.

``python -m benchmarks`` (or ``./dev bench``) prints tables, ``--json FILE`` writes them.
"""

import os

# One core: ratios to a threaded BLAS would say more about the machine than about the code. The
# libraries read this when they are imported.
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
