"""Rosenbrock methods: what a step costs."""

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
    ("law", "attempt", "step"),
    [(BrownMcPhee(), 748, 442), (LuGre(), 1016, 631)],
    ids=["bm", "lugre"],
)
def test_attempt_costs_no_more_instructions_than_it_did(law: Law, attempt: int, step: int) -> None:
    """The other methods, and whatever comes, must not make the default one dearer."""
    system = assemble(rabinowicz(law))
    assert build_step(system, RODAS5P).n_instructions() <= attempt
    assert build_fixed(system, RODAS5P).n_instructions() <= step
