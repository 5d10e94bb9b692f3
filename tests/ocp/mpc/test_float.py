"""Controllers in float, and their cost on Cortex-M cores."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from backends import needs_compiler
from cortex import on_target
from receding import controller, linear_model, positioning, rubbing
from tables import sampled

from ocp.formulation.expressions import effort, track
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.mpc.closed_loop import Optimality
from ocp.mpc.controller import Controller, controller_of, disturbed
from ocp.mpc.design import CycleStatus
from ocp.mpc.session import Session
from ocp.mpc.source import typed
from ocp.mpc.target import measure_controller
from symfric import BrownMcPhee
from symfric.embedded import Absent
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.scenes import Drive

pytestmark = needs_compiler


def pair() -> Controller:
    cost = track("x", "far", 10.0) + track("v", 0.0, 1.0) + track("w", 0.0, 1.0)
    cost += effort("a", 0.01) + effort("b", 0.01)
    bounds = {"a": (-3.0, 3.0), "b": (-1.0, 1.0)}
    problem = Problem(Phase(linear_model(), T=2.0), cost, bounds=bounds, p={"far": 0.0})
    return controller_of(problem, 0.1, steps=1)


CONTROLLERS = {
    "drive": controller,
    "pair": pair,
    "rates": lambda: controller_of(positioning(rates={"force": (-200.0, 200.0)}), 0.01),
}


@pytest.mark.parametrize("name", sampled(CONTROLLERS, of=3))
def test_float_is_verified_with_half_the_memory(name: str, tmp_path: Path) -> None:
    made = CONTROLLERS[name]()
    found = made.to_c(tmp_path, "float").verify()
    assert found.ok, found
    if made is controller():  # which other tests compile, too
        assert found.bytes == made.start().bytes // 2
    text = (tmp_path / f"{made.design.name}_f32.c").read_text()
    assert "double" not in text
    assert "HUGE_VALFF" not in text


def test_loops_in_float_and_double_agree() -> None:
    """Same noise and disturbances; the states differ by rounding."""
    made, paths = controller(), dict[str, np.ndarray]()
    for real in (DOUBLE, FLOAT):
        loop = disturbed(Session(made.design, real=real), 60, scale=0.1, broken=False)
        paths[real.name] = np.array([measured for measured, *_ in loop])
    assert np.abs(paths["float"] - paths["double"]).max() < 2e-3 * np.abs(paths["double"]).max()


def test_rounding_errors_end_the_iterations_and_enter_the_residual() -> None:
    made = controller()
    session, check = Session(made.design, real=FLOAT), Optimality(made.design)
    statuses = set[CycleStatus]()
    for _, data, action in disturbed(session, 100, broken=False):  # references of about 1 m
        statuses.add(action.status)
        true = check.residual(session.plan, data)
        assert true <= 4.0 * max(action.residual, made.design.settings.tolerance)
        if action.status is CycleStatus.ROUNDED:
            assert not action.converged
            assert action.residual > made.design.settings.tolerance
            assert action.iterations < made.design.settings.iterations
    assert {CycleStatus.CONVERGED, CycleStatus.ROUNDED} <= statuses
    assert "rounding" in CycleStatus.ROUNDED.sentence


def test_mass_and_friction_are_fields() -> None:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2)
    free = Drive(law, m=1.0, N=1.0).model(free=["m", "mu_s", "mu_d"])
    made = controller_of(positioning(free), 0.01)
    heavy = controller_of(positioning(Drive(replace(law, mu_s=7.0), m=2.0, N=1.0).model()), 0.01)
    goal, x = {"goal": 0.1}, [0.0, 0.0]
    (force,) = made.start().step(x, goal, p={"m": 2.0, "mu_s": 7.0}).controls.values()
    (other,) = heavy.start().step(x, goal).controls.values()
    assert force == pytest.approx(other, rel=1e-6)


def test_text_of_double_becomes_float() -> None:
    text = "const double a = 0.5 * x1.y + 1e5 * fabs(b) - 12.25e-3; /* 0.1.0 */ HUGE_VAL; b[2]"
    assert typed(text, DOUBLE) is text
    assert typed(text, FLOAT) == (
        "const float a = 0.5f * x1.y + 1e5 * fabsf(b) - 12.25e-3f; /* 0.1.0 */ HUGE_VALF; b[2]"
    )
    assert typed("2.0f + 1.0e-5f", FLOAT) == "2.0f + 1.0e-5f"


@on_target
def test_a_drive_in_float_fits_into_ten_milliseconds_of_a_small_core(tmp_path: Path) -> None:
    """With one quadratic program in a cycle: 168 MHz, two clock cycles for an instruction."""
    made = controller_of(positioning(rubbing()), 0.01, iterations=1)
    found = measure_controller(made.to_c(tmp_path, "float"), "m4f", cycles=60)
    assert found.ok
    assert found.error < 1e-3
    assert found.average < found.maximum < 0.01 * 168e6 / 2
    assert found.data < 8000


@on_target
def test_cycles_that_the_timer_cannot_count_are_not_reported(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("ocp.mpc.target.LONGEST", 1e4)
    found = measure_controller(controller().to_c(tmp_path, "float"), cycles=3)
    assert found.status.startswith("not measured: cycles of more than") and not found.ok


def test_bad_arguments_and_absent_tools_are_named(tmp_path: Path) -> None:
    made = controller()
    with pytest.raises(ValueError, match="to_c: real: expected"):
        made.to_c(tmp_path, "half")
    files = made.to_c(tmp_path, "float")
    assert measure_controller(files, tools=Absent(("qemu-system-arm",))).status.startswith("skip")
    for wrong, message in (
        ({"core": "m5"}, "measure_controller: core"),
        ({"cycles": 0}, "measure_controller: cycles"),
        ({"scale": 0.0}, "measure_controller: scale"),
    ):
        with pytest.raises(ValueError, match=message):
            measure_controller(files, **wrong)
