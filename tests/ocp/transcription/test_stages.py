import casadi as ca
import numpy as np
import pytest
from discretised import stage
from phases import UNIT, there_and_back, unit_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import FREE, Free, Phase
from ocp.formulation.problem import Problem
from ocp.transcription.program import Program
from ocp.transcription.schemes import Legendre, Radau, Scheme, make_meshes
from ocp.transcription.transcribe import discretise

EFFORT = integral(lambda s: s.a**2)


def program(problem: Problem, intervals: int = 3, scheme: Scheme | None = None) -> Program:
    return discretise(problem, scheme or Radau()).on(make_meshes(problem, intervals)).program


@pytest.mark.parametrize("scheme", [Radau(2), Legendre(2)])
def test_stages_are_nodes_with_the_interval_behind_them(scheme: Scheme) -> None:
    """Phases follow each other: the last node of one has no more unknowns."""
    made = program(there_and_back(path=[lambda s: s.v <= 9.0]), 2, scheme).stages
    assert made is not None
    assert made.nx == (2,) * 6
    assert made.nu == (5, 5, 0, 5, 5, 0)
    assert made.ng == (6, 6, 0, 6, 6, 0)
    assert sum(made.equality) == 4 * 4 + 5 * 2


def test_the_jacobian_has_the_form_that_stages_promise() -> None:
    problem = Problem(
        Phase(stage(), 1.0, end={"x": 0.1, "power": (None, 2.0)}, via={0.5: {"power": 0.1}}),
        integral(lambda s: s.force**2),
    )
    made = program(problem, 4)
    assert made.stages is not None
    nx, nu, ng = made.stages.nx, made.stages.nu, made.stages.ng
    at = np.random.default_rng(1).standard_normal(made.w.numel())
    jacobian = ca.DM(made.jacobian(at, made.values)[1]).full()
    row = column = 0
    for k in range(len(nx)):
        width = nx[k] + nu[k]
        rows = jacobian[row : row + (nx[k + 1] if k + 1 < len(nx) else 0)]
        if rows.size:
            after = slice(column + width, column + width + nx[k + 1])
            np.testing.assert_array_equal(rows[:, after], np.eye(nx[k + 1]))
            assert not rows[:, :column].any()
            assert not rows[:, after.stop :].any()
        row += rows.shape[0]
        own = jacobian[row : row + ng[k]]
        assert not own[:, :column].any()
        assert not own[:, column + width :].any()
        row, column = row + ng[k], column + width
    assert (row, column) == jacobian.shape


@pytest.mark.parametrize(
    ("problem", "reason"),
    [
        (unit_move(T=Free(0.5, 2.0)), "a free duration"),
        (unit_move(scenarios={"a": {}, "b": {}}), "several scenarios"),
        (
            Problem(Phase(stage(), 1.0, end={"x": 0.1}), integral(lambda s: s.force**2),
                    choose={"m": (0.5, 2.0)}),
            "the chosen parameter m",
        ),
        (
            Problem(Phase(UNIT, 1.0, start={"x": FREE}), EFFORT, periodic=["x"]),
            "x, which depends on more than its interval",
        ),
        (
            Problem(Phase(UNIT, 1.0) >> Phase(UNIT, 1.0, link={"v": None}), EFFORT),
            "states that restart after a phase",
        ),
        (
            Problem(
                Phase(UNIT, 1.0) >> Phase(UNIT, 1.0, joins=[lambda a, b: a.v + b.v >= 0]), EFFORT
            ),
            "join 1, which depends on more than its interval",
        ),
    ],
)  # fmt: skip
def test_what_couples_more_than_neighbours_is_named(problem: Problem, reason: str) -> None:
    made = program(problem)
    assert made.stages is None
    assert made.unstaged.endswith(reason)
