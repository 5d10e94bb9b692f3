"""The C of a controller: no warnings, nothing foreign, the bits of the virtual machine."""

from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler
from receding import controller, linear_model

from ocp.formulation.expressions import effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.controller import controller_of
from symfric.foundation.compiler import find_compiler

pytestmark = needs_compiler


def check(made: object, folder: Path) -> None:
    found = made.to_c(folder).verify(30)
    assert found.warnings == ()
    assert not found.foreign
    assert found.difference == 0.0
    assert found.ok


def test_drive(tmp_path: Path) -> None:
    check(controller(), tmp_path)
    text = (tmp_path / "drive_mpc.c").read_text() + (tmp_path / "drive_mpc.h").read_text()
    assert "malloc" not in text
    assert "static const" in text


@pytest.mark.parametrize("kept", ["nothing", "end", "rows", "rates"])
def test_parts_that_are_absent_are_left_out(kept: str, tmp_path: Path) -> None:
    cost = track("x", "far", 3.0) + effort("a", 0.1) + effort("b", 0.1)
    more = {
        "rows": {"bounds": {"a": (None, 1.0), "w": (-1.0, 2.0)}},
        "rates": {"rates": {"b": (-9.0, 9.0)}},
    }
    phase = Phase(linear_model(), T=0.3, end={"x": 1.0} if kept == "end" else {})
    check(controller_of(Problem(phase, cost, p={"far": 0.0}, **more.get(kept, {})), 0.1), tmp_path)


def test_engines_agree_to_the_bit_in_a_cycle_with_active_bounds() -> None:
    actions = [controller().start(b).step([0.0, 0.5], {"goal": 0.3}) for b in ("vm", "compiled")]
    first, second = actions
    assert first.program_iterations > 0
    assert first.controls == second.controls
    assert first.residual == second.residual
    np.testing.assert_equal(first.iterations, second.iterations)


def test_c_is_c_plus_plus_too(tmp_path: Path) -> None:
    files = controller().to_c(tmp_path).files
    compiler = find_compiler()
    assert compiler is not None
    said = compiler.run("-x", "c++", "-Wall", "-Wextra", "-fsyntax-only", str(files[1]))
    assert said == ""
