"""Number of files of the project whose functions run during a call."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
COUNT = """
import inspect
import sys
from pathlib import Path

import symfric

root = Path(symfric.__file__).parents[1]
packages = tuple(str(root / name) for name in ("symfric", "ocp", "identification"))


def files(call):
    seen = set()

    def watch(frame, event, _):  # of calls only: it traces no lines
        if frame.f_code.co_flags & inspect.CO_OPTIMIZED:  # functions, not modules being imported
            seen.add(frame.f_code.co_filename)

    sys.settrace(watch)
    try:
        call()
    finally:
        sys.settrace(None)
    return sum(name.startswith(packages) for name in seen)
"""
SIMULATE = """
from symfric import LuGre, rabinowicz, simulate

scene = rabinowicz(LuGre())
vm = {"backend": "vm"}  # a compiled step that becomes available between the calls adds files
print(*(files(lambda: simulate(scene, 20.0, **vm)) for _ in range(2)))
"""
FIT = """
from identification import Fit, InverseDynamics, synthetic_drive_data

data = synthetic_drive_data(seed=1, rate=250.0)
print(files(Fit(InverseDynamics(), "stribeck", data, starts=1).solve))
"""
SOLVE = """
from ocp import Phase, Problem, integral, solve
from symfric import BrownMcPhee, drive

stage = drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, v_t=1e-5, N_t=1e-3), m=1.0, N=1.0)
out = Phase(stage, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0})
back = Phase(stage, T=1.0, end={"x": 0.0, "v": 0.0})
move = Problem(out >> back, integral(lambda s: s.force**2))
print(files(lambda: solve(move)))
"""
GENERATE = """
from symfric import LuGre
from symfric.codegen import generate

print(files(lambda: generate(LuGre(), "c")))
"""


MOST = {
    "simulate, first": 31,
    "simulate, second": 14,
    "Fit.solve": 51,
    "ocp.solve": 90,
    "generate": 30,
}


def test_a_call_runs_code_in_few_files(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", COUNT + SIMULATE + FIT + SOLVE + GENERATE], cwd=tmp_path,
        capture_output=True, text=True, check=True,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    found = dict(zip(MOST, map(int, done.stdout.split()), strict=True))
    assert all(0 < n <= MOST[name] for name, n in found.items()), found
