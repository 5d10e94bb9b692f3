import numpy as np
import pytest
from phases import fastest_move, there_and_back, unit_move

from ocp.formulation.phase import FREE, Free
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import solve_on, solve_once
from ocp.transcription.program import Place
from ocp.transcription.schemes import Legendre, Radau, make_meshes
from ocp.transcription.transcribe import discretise


def test_a_unit_move_costs_twelve() -> None:
    """Piecewise constant a on N intervals: J = 12 N^2 / (N^2 - 1)."""
    for N in (4, 10):
        solution = solve_once(unit_move(), N)
        assert solution.cost == pytest.approx(12 * N**2 / (N**2 - 1), rel=1e-8)
        assert solution.message == "ocp 'double integrator': " + solution.status.value


@pytest.mark.parametrize("scheme", [Radau(2), Radau(4), Legendre(2)])
def test_schemes_give_the_same(scheme: Radau | Legendre) -> None:
    """All are exact for a double integrator under constant input."""
    assert solve_once(unit_move(), 10, scheme).cost == pytest.approx(1200 / 99, rel=1e-8)


def test_a_program_is_solved_many_times_with_other_numbers() -> None:
    discretised = discretise(fastest_move(), Radau())
    meshes = [np.linspace(0.0, 1.0, 11)]
    transcription = discretised.on(meshes)
    prepared = Ipopt().prepared(transcription.program)
    first = solve_on(transcription, prepared)
    again = solve_on(transcription, prepared, first)
    assert again.iterations < first.iterations / 2
    cold = solve_on(transcription, prepared, first, warm=False)
    assert cold.iterations > again.iterations
    late = discretised.on([np.linspace(0.0, 1.0, 11) ** 1.2])
    other = solve_on(late, prepared, values=late.program.values)
    assert other.cost == pytest.approx(solve_on(late, Ipopt().prepared(late.program)).cost)
    assert other.cost != first.cost
    with pytest.raises(ValueError, match=r"values: expected 12 numbers of parameters, got 3"):
        solve_on(late, prepared, values=[1.0, 2.0, 3.0])


def test_times_of_places_go_on_over_the_phases() -> None:
    problem = there_and_back(scenarios={"dry": {}, "oiled": {}})
    transcription = discretise(problem, Radau()).on(make_meshes(problem, 4))
    w = np.zeros(transcription.program.w.numel())
    said = [
        transcription.when(w, Place("v", span, s))
        for span, s in ((0, 0.25), (1, 0.25), (3, 1.0), (2, np.nan))
    ]
    assert said == [
        "at t = 0.25 s in out of scenario dry",
        "at t = 1.25 s in back of scenario dry",
        "at t = 2 s in back of scenario oiled",
        "in out of scenario oiled",
    ]


def test_free_durations_and_scenarios() -> None:
    quick = solve_once(unit_move(T=Free(0.5, 2.0), bounds={"a": (-16.0, 16.0)}), 20)
    assert pytest.approx(2.0) == quick.T
    several = unit_move(
        start={"x": (-0.5, 0.0), "v": FREE}, scenarios={"a": {}, "b": {}}, shared=["a"]
    )
    solution = solve_once(several, 10)
    assert list(solution.scenarios) == ["a", "b"]
    np.testing.assert_allclose(solution.scenarios["a"]["a"], solution.scenarios["b"]["a"])
