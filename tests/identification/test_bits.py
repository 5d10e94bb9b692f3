"""A fit gives the same bits in every process, whatever the number of threads of BLAS."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
from identification import Fit, InverseDynamics, synthetic_drive_data
fit = Fit(InverseDynamics(), "lugre", synthetic_drive_data(speeds=(0.02, 0.08)), starts=2)
fit = fit.solve(throw=False)
print(" ".join(e.value.hex() for e in fit.parameters.values()))
print(" ".join((e.standard_error or 0.0).hex() for e in fit.parameters.values()))
print(" ".join(s.hex() for s in fit.noise.values()), fit.evaluations)
"""


@pytest.mark.heavy
def test_processes_side_by_side_agree_to_the_bit() -> None:
    running = [
        subprocess.Popen(
            [sys.executable, "-c", SCRIPT],
            env=os.environ | {"OPENBLAS_NUM_THREADS": n, "OMP_NUM_THREADS": n},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for n in ("1", "4")
    ]
    ends = [process.communicate(timeout=300) for process in running]
    assert [p.returncode for p in running] == [0, 0], ends[0][1]
    assert ends[0][0] == ends[1][0] and ends[0][0].strip()
