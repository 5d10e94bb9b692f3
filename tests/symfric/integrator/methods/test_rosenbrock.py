"""Rosenbrock methods: what a step costs."""

import casadi as ca
import pytest
from closed_forms import assemble

from symfric import BrownMcPhee, Law, LuGre, rabinowicz
from symfric.integrator.methods.tableaux import METHODS, RODAS5P
from symfric.integrator.step.attempt import build_fixed, build_step


@pytest.mark.parametrize(("name", "stages"), [("rodas5p", 8), ("rodas4p", 6), ("rodas3", 4)])
def test_work_of_a_step_is_its_stages_and_one_factorisation(name: str, stages: int) -> None:
    system = assemble(rabinowicz(LuGre()))
    assert METHODS[name].work(system) == (stages, 1, 1)


@pytest.mark.parametrize(
    ("law", "attempt", "step", "divisions"),
    [(BrownMcPhee(), 1002, 451, 46), (LuGre(), 1273, 645, 49)],
    ids=["bm", "lugre"],
)
def test_attempt_costs_no_more_instructions_than_it_did(
    law: Law, attempt: int, step: int, divisions: int
) -> None:
    """The other methods, and whatever comes, must not make the default one dearer.

    A division takes the time of ten others; there were 45 and 57, of which 28 and 31 stayed. Of
    those here 9 tangents take 18, and 241 instructions: libm's took more time, in branches.
    """
    system = assemble(rabinowicz(law))
    whole = build_step(system, RODAS5P)
    operations = [whole.instruction_id(k) for k in range(whole.n_instructions())]
    assert len(operations) <= attempt
    assert operations.count(ca.OP_DIV) <= divisions
    assert build_fixed(system, RODAS5P).n_instructions() <= step
