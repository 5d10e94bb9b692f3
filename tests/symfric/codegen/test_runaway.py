"""A step that is too long for a plant is found, and a shorter one that is not."""

from pathlib import Path

import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Model, Variable
from symfric.codegen import Block, generate, plant_block, verify
from symfric.codegen.runner import run_vm
from symfric.codegen.verification import longest_step, runs_away, step_size
from symfric.emitter.c99 import REALS
from symfric.foundation.programs import Compiler
from symfric.scenes import Arm

x = Variable("x", "m", start=1.0, nominal=2.0)


def decay(h: float | None = None) -> Block:
    """x' = -1000 x by an explicit method, which is stable up to h = 3.3 ms."""
    return plant_block(Model("decay", x=(x,), ode=-1000 * x.symbol), h=h, method="dopri5")


@pytest.mark.parametrize("lost", [np.nan, np.inf, -2.1e10])
def test_the_first_step_that_loses_a_state_is_found(lost: float) -> None:
    rows = np.ones((5, 1))
    assert runs_away(decay(), rows) is None
    rows[2:] = lost
    assert runs_away(decay(), rows) == 3
    assert runs_away(decay(), np.full((5, 1), 1.9e10)) is None


def test_step_size_is_a_parameter_or_a_constant() -> None:
    assert step_size(decay()) == 1e-3
    assert step_size(decay(4e-3)) == 4e-3
    assert step_size(Block("none", states=(x,), next=x.symbol)) is None


@pytest.mark.parametrize(("below", "longest"), [(4e-3, 2e-3), (0.02, 2e-3), (0.01, 2e-3)])
def test_the_longest_step_that_holds_is_below_the_limit(below: float, longest: float) -> None:
    assert longest_step(decay(), np.zeros((200, 0)), below) == longest


def test_no_step_is_promised_where_none_is_found() -> None:
    growing = plant_block(Model("grow", x=(x,), ode=2e3 * x.symbol))
    assert longest_step(growing, np.zeros((20_000, 0)), 1e-3) is None
    assert longest_step(decay(1e-3), np.zeros((200, 0)), 1e-3) is None


def test_the_status_says_how_long_a_step_may_be(compiler: Compiler, tmp_path: Path) -> None:
    found = verify(generate(decay(4e-3), tmp_path, real="double", kit=False), adjustable=decay)
    assert not found.ok
    assert found.status.startswith("failed: after ")
    assert "steps of 0.004 s it runs away, in CasADi as in C: that step is too long" in found.status
    assert found.status.endswith(", 0.002 s is not")
    alone = verify(generate(decay(4e-3), tmp_path, real="double", kit=False))
    assert alone.status.endswith("try a shorter one, or the method backward_euler, which is the "
                                 "most robust")  # fmt: skip
    assert verify(generate(decay(2e-3), tmp_path, real="double", kit=False)).ok


@pytest.mark.heavy
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
def test_a_falling_arm_stays_bounded_by_the_method_of_mechanisms(law: BrownMcPhee | LuGre) -> None:
    """By rodas3 it is lost within 3 s at 1 ms."""
    block = plant_block(Arm(law).model())
    assert "backward Euler" in block.discretisation
    rows = run_vm(block, REALS["double"], np.zeros((4000, 6)))
    assert runs_away(block, rows) is None
    assert np.abs(rows[:, 6:12]).max() < 200.0


def test_only_mechanisms_with_friction_are_integrated_that_way() -> None:
    assert "RODAS3" in plant_block(Model("decay", x=(x,), ode=-x.symbol)).discretisation
