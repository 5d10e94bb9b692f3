"""`ocp` loads its names on demand, and `solve` without what only a run needs."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import ocp

HEAVY = (
    "matplotlib", "scipy", "multiprocessing", "ocp.strategies", "ocp.checking", "ocp.friction",
    "ocp.mpc",
    "symfric.multibody", "symfric.integrator.simulate", "symfric.laws.catalogue",
)  # fmt: skip


def test_every_name_that_a_checker_sees_is_there_and_no_other() -> None:
    (block,) = [
        node for node in ast.parse(Path(str(ocp.__file__)).read_text(encoding="utf-8")).body
        if isinstance(node, ast.If)
    ]  # fmt: skip
    lines = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    seen = {alias.asname: str(line.module) for line in lines for alias in line.names}
    assert seen == ocp._places  # pyright: ignore[reportAttributeAccessIssue]
    for name, place in seen.items():
        assert getattr(ocp, str(name)) is getattr(importlib.import_module(place), str(name))


def test_solve_is_imported_without_what_only_a_run_needs() -> None:
    code = "from ocp import solve\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(HEAVY) & set(done.stdout.split())
