import casadi as ca
import numpy as np
import pytest
from phases import unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.solving.watch import Seen, not_finite, plainly, worst
from ocp.transcription.program import Program, outside, worst_of
from ocp.transcription.schemes import Radau, make_meshes
from ocp.transcription.transcribe import discretise


def program(**more: object) -> Program:
    problem = unit_move(bounds={"a": (-8.0, 8.0)}, **more)
    return discretise(problem, Radau()).on(make_meshes(problem, 4)).program


def seen(made: Program, w: np.ndarray, g: np.ndarray) -> Seen:
    return Seen(w, 7.5, g, w, g, worst_of(made, w, g))


def test_the_worst_of_rows_and_bounds_is_named_with_its_time() -> None:
    made = program()
    w = np.clip(np.zeros(made.w.numel()), made.lower_w, made.upper_w)
    g = np.zeros(made.g.numel())
    assert worst(made, seen(made, w, g), plainly) == (
        "The best iterate satisfies all constraints, at a cost of 7.5."
    )
    inputs = [k for k, place in enumerate(made.unknowns) if place.name == "a"]
    w[inputs[2]] = 8.5
    assert outside(w, made.lower_w, made.upper_w)[inputs[2]] == 0.5
    assert worst(made, seen(made, w, g), plainly) == (
        "Most violated is the bound on a at 0.5 of the duration, by 0.5 in scaled units."
    )
    rows = [k for k, place in enumerate(made.rows) if place.name == "the equation of v"]
    g[rows[-1]] = -0.75
    assert worst(made, seen(made, w, g), plainly) == (
        "Most violated is the equation of v at 1 of the duration, by 0.75 in scaled units."
    )


@pytest.mark.parametrize(
    ("cost", "said"),
    [
        (integral(lambda s: ca.log(s.a)), "It is the cost."),
        (integral(lambda s: s.a**2 + ca.sqrt(s.v)), "It is the derivative of the cost in v at"),
        (at_end(lambda s: ca.sqrt(s.x)), "It is the derivative of the cost in x at 1 of"),
    ],
)
def test_what_is_no_number_is_named(cost: object, said: str) -> None:
    made = program(cost=cost, end={})
    w = np.zeros(made.w.numel())
    assert not_finite(made, w, made.values, plainly).startswith(said)
    good = program()
    assert not_finite(good, w, good.values, plainly) == ""
