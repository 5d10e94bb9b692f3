"""`ocp` loads its names on demand, and `solve` without what only a run needs."""

import subprocess
import sys

HEAVY = (
    "matplotlib", "scipy", "multiprocessing", "ocp.strategies", "ocp.checking", "ocp.friction",
    "ocp.mpc",
    "symfric.multibody", "symfric.integrator.simulate", "symfric.laws.catalogue",
)  # fmt: skip


def test_solve_is_imported_without_what_only_a_run_needs() -> None:
    code = "from ocp import solve\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(HEAVY) & set(done.stdout.split())
