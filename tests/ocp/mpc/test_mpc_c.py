"""Generated C of controllers: warnings, symbols, and bits of a reference in NumPy."""

from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler
from receding import controller, linear_model, positioning
from receding_numpy import NumpyCycles

from ocp.formulation.expressions import effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.controller import Controller, controller_of
from ocp.mpc.design import CycleData
from symfric.foundation.programs import CompileError, find_compiler

pytestmark = needs_compiler


def check(made: Controller, folder: Path) -> None:
    found = made.to_c(folder).verify(12)
    assert found.warnings == ()
    assert not found.foreign
    assert found.difference < 1e-5
    assert found.ok
    assert_same_bits(made, 61)


def assert_same_bits(made: Controller, cycles: int) -> None:
    """Compare controls, residuals and counts with the reference over a loop hard on both."""
    design, session = made.design, made.start()
    h, reference, random = design.horizon, NumpyCycles(design), np.random.default_rng(0)
    own = list(design.measured)
    nominal, settings = h.model.nominal("x")[own], design.settings
    measured, goals = design.x0[own], design.r0
    for k in range(cycles):
        if k % 25 == 0:
            goals = design.r0 + random.normal(size=design.r0.size)
        if k % 60 == 39:
            measured = 10.0 * nominal * random.normal(size=nominal.size)
        if k % 60 == 59:
            measured = np.full(nominal.size, np.nan)
        t = h.step * (k + np.arange(h.count + 1.0))
        data = CycleData(np.tile(goals, (h.count + 1, 1)), t, design.p0, design.bounds)
        limits = settings.tolerance, settings.iterations
        action = session.cycle(measured, data, *limits)
        u, report = reference.cycle(measured, data, *limits)
        assert list(action.controls.values()) == u.tolist()
        assert action.status is report.status
        assert (action.residual, action.violation) == (report.residual, report.violation)
        assert (action.iterations, action.program_iterations) == (report.iterations, report.program)
        measured = session.plan.X[1, own] + 0.01 * nominal * random.normal(size=nominal.size)


def test_drive(tmp_path: Path) -> None:
    check(controller(), tmp_path)
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
    check(controller_of(Problem(phase, cost, p={"far": 0.0}, **more), 0.1), tmp_path)


def test_bits_are_those_of_the_reference_in_a_cycle_with_active_bounds() -> None:
    made = controller()
    session, reference = made.start(), NumpyCycles(made.design)
    data = session.data({"goal": 0.3}, 0.0, None, None)
    action = session.cycle(np.array([0.0, 0.5]), data, 1e-3, 20)
    u, report = reference.cycle(np.array([0.0, 0.5]), data, 1e-3, 20)
    assert action.program_iterations > 0
    assert list(action.controls.values()) == u.tolist()
    assert action.residual == report.residual
    assert action.iterations == report.iterations


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
