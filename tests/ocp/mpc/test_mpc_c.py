"""Generated C of controllers: warnings, symbols, and optimality of its plans."""

from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler
from receding import controller, linear_model, positioning

from ocp.formulation.expressions import effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.closed_loop import Optimality
from ocp.mpc.controller import Controller, controller_of
from ocp.mpc.design import CycleData, CycleStatus
from symfric.foundation.programs import CompileError, find_compiler

pytestmark = needs_compiler


def check(made: Controller, folder: Path, most: float) -> None:
    found = made.to_c(folder).verify(12)
    assert found.warnings == ()
    assert not found.foreign
    assert found.difference < 1e-5
    assert found.ok
    assert_optimal(made, most)


def assert_optimal(made: Controller, most: float) -> None:
    """Check residual and status of each plan, and the mean number of programs, in a hard loop."""
    design, session, random = made.design, made.start(), np.random.default_rng(0)
    h, second_opinion = design.horizon, Optimality(design)
    own = list(design.measured)
    nominal, limits = h.model.nominal("x")[own], (design.settings.tolerance, 20)
    measured, goals, programs = design.x0[own], design.r0, list[int]()
    for k in range(61):
        if k % 25 == 0:
            goals = design.r0 + random.normal(size=design.r0.size)
        if k % 60 == 39:
            measured = 10.0 * nominal * random.normal(size=nominal.size)
        if k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        data = CycleData(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        action, plan = session.cycle(measured, data, *limits), session.plan
        if k % 60 == 59:
            assert action.status is CycleStatus.BAD_INPUT
        else:
            expected = second_opinion.residual(plan, data)
            assert action.residual == pytest.approx(expected, rel=1e-2, abs=1e-4)
            assert action.converged is (action.residual <= limits[0])
            assert plan.X[0, own].tolist() == measured.tolist()
            programs.append(action.iterations if action.converged else limits[1])
        measured = plan.X[1, own] + 0.01 * nominal * random.normal(size=nominal.size)
    assert np.mean(programs) < most


def test_drive(tmp_path: Path) -> None:
    check(controller(), tmp_path, 3.6)
    text = (tmp_path / "drive_mpc.c").read_text() + (tmp_path / "drive_mpc.h").read_text()
    assert "malloc" not in text
    assert "static const" in text


@pytest.mark.parametrize("ends", [False, True])
def test_parts_that_are_absent_are_left_out(ends: bool, tmp_path: Path) -> None:
    """Conditions at the end, or rows and rates."""
    cost = track("x", "far", 3.0) + effort("a", 0.1) + effort("b", 0.1)
    bounds, rates = {"a": (None, 1.0), "w": (-1.0, 2.0)}, {"b": (-9.0, 9.0)}
    more = {} if ends else {"bounds": bounds, "rates": rates}
    phase = Phase(linear_model(), T=0.3, end={"x": 1.0} if ends else {})
    check(controller_of(Problem(phase, cost, p={"far": 0.0}, **more), 0.1), tmp_path, 2.2)


def test_missing_compiler_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = controller_of(positioning(), 0.01, name="uncompiled")
    monkeypatch.setenv("PATH", "")
    monkeypatch.setenv("CC", "")
    with pytest.raises(CompileError, match=r"start: expected a C compiler .* install gcc or clang"):
        made.start()
    found = made.to_c(tmp_path).verify()
    assert not found.ok
    assert "no C compiler found" in found.status


def test_wrong_residual_or_control_in_the_files_is_found(tmp_path: Path) -> None:
    made = controller_of(positioning(), 0.01)
    for old, new in (
        ("fabs(S[i] * nominal_u[i])", "0.9 * fabs(S[i] * nominal_u[i])"),
        ("    u = m->u[0][0];", "    u = m->u[1][0];"),
    ):
        generated = made.to_c(tmp_path)
        text = generated.files[1].read_text()
        assert text.count(old) == 1
        generated.files[1].write_text(text.replace(old, new))
        assert "differs by" in generated.verify(30).status


def test_c_is_c_plus_plus_too(tmp_path: Path) -> None:
    files = controller().to_c(tmp_path).files
    compiler = find_compiler()
    assert compiler is not None
    command = ("-x", "c++", "-Wall", "-Wextra", "-fsyntax-only", str(files[1]))
    assert compiler.run(*command) == ""
