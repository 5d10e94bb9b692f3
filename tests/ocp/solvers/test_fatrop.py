import os
import signal

import casadi as ca
import numpy as np
import pytest
from discretised import dae, stage
from phases import there_and_back, unit_move

from ocp.formulation.expressions import at_end, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import Fatrop, Ipopt
from ocp.solving.one_solve import solve_once
from ocp.solving.starts import start_of
from ocp.transcription.program import Progress
from ocp.transcription.schemes import Legendre, Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Status

PUSHED = Problem(
    Phase(stage(), 1.0, end={"x": 0.1, "v": 0.0}, via={0.5: {"x": (0.06, None)}}),
    integral(lambda s: s.force**2),
    bounds={"force": (-20.0, 20.0), "power": (None, 3.0)},
    path=[lambda s: s.v <= 0.15],
)
ALGEBRAIC = Problem(
    Phase(dae(), 1.0, start={"x": 0.5}),
    integral(lambda s: s.u**2) + at_end(lambda s: (s.x - 1) ** 2),
)


@pytest.mark.parametrize("problem", [PUSHED, ALGEBRAIC, there_and_back()])
def test_it_finds_what_ipopt_finds(problem: Problem, capfd: pytest.CaptureFixture[str]) -> None:
    two = solve_once(problem, 20, solver=Ipopt())
    one = solve_once(problem, 20, solver=Fatrop(), guess=two)  # which may know other minima
    assert one.ok
    assert one.cost == pytest.approx(two.cost, rel=1e-6)
    for name, values in two.states.items():
        np.testing.assert_allclose(one[name], values, atol=1e-5)
    assert capfd.readouterr() == ("", "")


def test_its_multipliers_fulfil_the_optimality_conditions() -> None:
    transcription = discretise(PUSHED, Radau()).on(make_meshes(PUSHED, 10))
    program = transcription.program
    found = Fatrop().prepared(program).run(start_of(transcription, None)[0]).iterate
    slope = ca.DM(program.gradient(found.w, program.values)[1])
    jacobian = ca.DM(program.jacobian(found.w, program.values)[1])
    residual = slope + jacobian.T @ found.lam_g + found.lam_w
    assert np.abs(residual.full()).max() < 1e-7
    one = solve_once(PUSHED, 10, solver=Fatrop())
    assert solve_once(PUSHED, 10, guess=one).iterations < solve_once(PUSHED, 10).iterations / 2


def test_legendre_has_stages_too() -> None:
    one = solve_once(unit_move(), 10, Legendre(2), Fatrop())
    assert one.cost == pytest.approx(1200 / 99, rel=1e-8)


def test_programs_without_stages_are_refused_with_the_reason() -> None:
    with pytest.raises(
        ValueError, match=r"Fatrop: .* stages, got one with a free duration; use Ipopt\(\)"
    ):
        solve_once(unit_move(T=Free(0.5, 2.0)), 5, solver=Fatrop())


def test_unknown_options_are_refused() -> None:
    with pytest.raises(ValueError, match=r"Fatrop: expected options of Fatrop, .*: no_such"):
        solve_once(unit_move(), 3, solver=Fatrop(no_such_option=1))
    with pytest.raises(ValueError, match="Fatrop: option max_iter: expected a finite number"):
        Fatrop(max_iter="many")


def test_it_is_watched_and_stopped_although_it_has_no_callback() -> None:
    seen: list[Progress] = []
    solution = solve_once(PUSHED, 10, solver=Fatrop(), progress=seen.append)
    assert [p.iteration for p in seen] == list(range(solution.iterations + 1))
    assert seen[-1].cost == pytest.approx(solution.cost, rel=1e-6)

    def interrupt(progress: Progress) -> None:
        if progress.iteration == 3:
            os.kill(os.getpid(), signal.SIGINT)

    def fail(progress: Progress) -> None:
        if progress.iteration == 3:
            raise LookupError("no more")

    for callback, said in (
        (interrupt, "Stopped by the user after 3 iterations"),
        (fail, "Stopped by an exception in progress after 3 iterations: LookupError('no more')"),
    ):
        partial = solve_once(PUSHED, 10, solver=Fatrop(), progress=callback)
        assert partial.status is Status.INTERRUPTED
        assert said in partial.message
        assert partial.cost in [p.cost for p in seen[:4]]


def test_limits_are_told() -> None:
    few = solve_once(PUSHED, 10, solver=Fatrop(max_iter=3))
    assert few.status is Status.MAX_ITERATIONS
    assert "iterations: Maximum_Iterations_Exceeded.)" in few.message
    late = solve_once(PUSHED, 10, solver=Fatrop(max_time=1e-6).with_options(max_iter=9))
    assert late.status is Status.TIME_LIMIT
    assert "The time limit of 1e-06 s ended Fatrop after 0 iterations" in late.message
    far = solve_once(unit_move(bounds={"a": (-1.0, 1.0)}), 10, solver=Fatrop())
    assert far.status in (Status.INFEASIBLE, Status.NO_STEP)
    assert "Most violated is" in far.message


def test_a_cost_that_is_not_a_number_is_told() -> None:
    partial = solve_once(
        unit_move(cost=integral(lambda s: ca.log(-1 - s.a**2))), 5, solver=Fatrop(max_iter=5)
    )
    assert partial.status is Status.NOT_FINITE
    assert partial.message.endswith("It is the cost.")
