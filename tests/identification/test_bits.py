"""A fit gives the same bits in every process, whoever else works on the machine."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
from symfric.bench.identification_memory import case
fit = case(1).solve(throw=False)
print(" ".join(e.value.hex() for e in fit.parameters.values()))
print(" ".join((e.standard_error or 0.0).hex() for e in fit.parameters.values()))
print(" ".join(s.hex() for s in fit.noise.values()), fit.evaluations)
"""

POOL = """
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from symfric.bench.identification_memory import case
if __name__ == "__main__":
    fit = replace(case(1), starts=3)
    ends = []
    for executor in (None, ProcessPoolExecutor(2)):
        made = fit.solve(executor, throw=False)
        ends.append(([e.value.hex() for e in made.parameters.values()], len(made.starts)))
    print(ends[0] == ends[1])
"""


def started(script: str, **variables: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", script],
        env=os.environ | variables,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.heavy
def test_processes_side_by_side_agree_to_the_bit() -> None:
    threads = ["1", "4"]
    running = [started(SCRIPT, OPENBLAS_NUM_THREADS=n, OMP_NUM_THREADS=n) for n in threads]
    ends = [process.communicate(timeout=300) for process in running]
    assert [p.returncode for p in running] == [0] * len(threads), ends[0][1]
    assert len({out for out, _ in ends}) == 1
    assert ends[0][0].strip()


@pytest.mark.heavy
def test_a_process_pool_gives_the_bits_of_one_process() -> None:
    process = started(POOL)
    out, said = process.communicate(timeout=300)
    assert out.strip() == "True", said
