"""A fit gives the same bits in every process, whatever the number of threads of BLAS."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
from identification import Fit, InverseDynamics, synthetic_drive_data
fit = Fit(InverseDynamics(), "lugre", synthetic_drive_data(speeds=(0.05,), dwell=0.4), starts=1)
fit = fit.solve(throw=False)
print(" ".join(e.value.hex() for e in fit.parameters.values()))
print(" ".join((e.standard_error or 0.0).hex() for e in fit.parameters.values()))
print(" ".join(s.hex() for s in fit.noise.values()), fit.evaluations)
"""


@pytest.mark.heavy
def test_processes_side_by_side_agree_to_the_bit(capsys: pytest.CaptureFixture[str]) -> None:
    exec(SCRIPT)
    here = capsys.readouterr().out
    threads = {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "4"}
    there = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=os.environ | threads, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert here == there.stdout and here.strip()
