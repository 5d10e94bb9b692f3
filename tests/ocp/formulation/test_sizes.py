"""A move is solved alike at every size, whatever its model calls usual."""

import casadi as ca
import pytest

from ocp import TIME, Free, Ipopt, Phase, Problem, integral, solve
from ocp.formulation.problem import cost_size, sized
from symfric import BrownMcPhee, Model, Variable, drive

SIZES = [1e-9, 1e-5, 1.0, 1e6]


def move(size: float, nominal: float = 1.0, **more: object) -> Problem:
    """2 kg over `size` [m] from rest to rest in 1 s."""
    x, v = Variable("x", "m", nominal=nominal), Variable("v", "m/s")
    u = Variable("u", "N")
    model = Model("mass", x=(x, v), u=(u,), ode=ca.vertcat(v.symbol, u.symbol / 2.0))
    end = {"x": size, "v": 0.0}
    return Problem(Phase(model, 1.0, end=end), integral(lambda s: s.u**2), **more)  # type: ignore[arg-type]


def nominals(problem: Problem) -> dict[str, float]:
    model = problem.chain[0].model
    return {v.name: v.nominal for v in (*model.x, *model.u)}


def test_least_effort_has_its_closed_form_at_every_size() -> None:
    found = [solve(move(size), intervals=30) for size in SIZES]
    costs = [one.cost / (48.0 * size**2) for one, size in zip(found, SIZES, strict=True)]
    assert all(one.verified for one in found)
    assert costs == pytest.approx([costs[2]] * len(SIZES), rel=1e-9)
    assert costs[2] == pytest.approx(1.0, rel=1e-4)
    assert len({one.iterations for one in found}) == 1


def test_the_fastest_move_takes_as_long_at_every_size() -> None:
    for size in SIZES:
        problem = move(size)
        phase = Phase(problem.chain[0].model, Free(0.1, 20.0), end={"x": size, "v": 0.0})
        found = solve(Problem(phase, TIME, bounds={"u": (-2.0 * size, 2.0 * size)}), intervals=30)
        assert found.cost == pytest.approx(2.0, rel=1e-6), size


@pytest.mark.parametrize("size", [1e-5, pytest.param(1e3, marks=pytest.mark.slow)])
def test_friction_is_as_at_the_size_that_the_model_calls_usual(size: float) -> None:
    def cost(size: float) -> float:
        law = BrownMcPhee(mu_s=3.0 * size, mu_d=3.0 * size, v_t=1e-5 * size)
        problem = Problem(
            Phase(drive(law, m=2.0, N=1.0), 1.0, end={"x": size, "v": 0.0}),
            integral(lambda s: s.force**2),
        )
        found = solve(problem, starts=1)
        assert [mode.kind for mode in found.modes["guide"]] == ["slip+"]
        return found.cost / size**2

    assert cost(size) == pytest.approx(cost(0.1), rel=1e-6)


def test_sizes_follow_from_ends_and_equations() -> None:
    assert nominals(sized(move(1e-6))) == pytest.approx({"x": 1e-6, "v": 1e-6, "u": 2e-6})
    assert cost_size(sized(move(1e-6))) == pytest.approx(4e-12)


def test_what_is_near_or_given_stays() -> None:
    for problem in (move(1.0), move(0.02), move(50.0), move(1e4, nominal=10.0)):
        assert sized(problem) is problem


def test_bounds_are_sizes_and_options_of_the_user_win() -> None:
    bounded = move(1.0, bounds={"u": (-5e3, 2e3)})
    assert nominals(sized(bounded))["u"] == 5e3
    found = solve(move(1e-6), solver=Ipopt(obj_scaling_factor=1e11), intervals=30)
    assert found.cost == pytest.approx(48e-12, rel=1e-4)
