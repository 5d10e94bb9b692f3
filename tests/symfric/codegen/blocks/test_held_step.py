"""A step of states with held inputs: exact where affine, ended at rest, in the order of needs."""

from math import exp

import casadi as ca
import numpy as np
import pytest

from symfric.codegen.blocks.held_step import force_of_rate, held_step

z = ca.SX.sym("z", 2)


def stepped(rate: ca.SX, start: list[float], h: float, rest: list[float]) -> list[np.ndarray]:
    step = held_step(rate, z, h, ca.SX(rest), "here")
    function = ca.Function("step", [z], [step.end, step.mean, step.mean_rate, step.end_rate])
    return [column.full().ravel() for column in function(start)]


def test_affine_states_are_exact_in_end_mean_and_rate() -> None:
    rate = ca.vertcat(3 - 2 * z[0], -5 * z[1])
    end, mean, mean_rate, end_rate = stepped(rate, [0.0, 1.0], 0.7, [1.5, 0.0])
    assert end == pytest.approx([1.5 * (1 - exp(-1.4)), exp(-3.5)], rel=1e-13)
    assert mean == pytest.approx([1.5 - end[0] / 1.4, (1 - end[1]) / 3.5], rel=1e-13)
    assert mean_rate * 0.7 == pytest.approx(end - np.array([0.0, 1.0]), rel=1e-13)
    assert end_rate == pytest.approx([3 - 2 * end[0], -5 * end[1]], rel=1e-13)


def test_the_way_ends_where_the_state_rests() -> None:
    """Even growth up to the limit 1, which the linearised rate does not see."""
    rate = ca.vertcat(4 * (1 - z[0] ** 30), 0 * z[1])
    end, mean, mean_rate, end_rate = stepped(rate, [0.0, 0.0], 1.0, [1.0, 0.0])
    assert end[0] == 1.0
    assert mean[0] == pytest.approx(1 - 0.25 / 2)
    assert (mean_rate[0], end_rate[0]) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("rate", "kinds"),
    [
        (ca.vertcat(-z[0], 1 - z[1]), ("exact",)),
        (ca.vertcat(-(z[0] ** 2), 1 - z[1]), ("second order", "exact")),
        (ca.vertcat(z[1], -z[1]), ("exact", "second order")),
    ],
)
def test_it_says_how_the_step_is_made(rate: ca.SX, kinds: tuple[str, ...]) -> None:
    assert set(held_step(rate, z, 0.1, ca.SX([0.0, 0.0]), "here").kinds) == set(kinds)


def test_growth_that_is_no_number_ends_at_rest() -> None:
    """Logistic growth: exp(J h) is infinite, the solution comes to rest at 1."""
    rate = ca.vertcat(1e4 * z[0] * (1 - z[0]), 0 * z[1])
    end, mean, mean_rate, end_rate = stepped(rate, [1e-3, 0.0], 1.0, [1.0, 0.0])
    assert (end[0], end_rate[0]) == (1.0, 0.0)
    assert np.isfinite([mean[0], mean_rate[0]]).all()


def test_a_state_rests_where_the_mean_of_another_one_says() -> None:
    """z_0 yields at z_1, which grows evenly: z_0 ends at the mean of z_1."""
    rate = ca.vertcat(5 * (1 - (z[0] / z[1]) ** 30), 0 * z[0] + 2)
    step = held_step(rate, z, 1.0, ca.vertcat(z[1], z[1]), "here", each=True)
    end = ca.Function("end", [z], [step.end])([0.0, 1.0]).full().ravel()
    assert end == pytest.approx([2.0, 3.0], rel=1e-12)


def test_a_state_that_moves_away_from_its_rest_is_not_held() -> None:
    end, *_ = stepped(ca.vertcat(-(z[0] ** 2), z[1]), [1.0, 0.0], 0.1, [2.0, 0.0])
    assert end[0] < 1.0


def test_a_state_follows_the_mean_of_the_one_it_needs() -> None:
    """z_0' = z_1, z_1' = -z_1: first state to the mean of the second, here exactly."""
    end, *_ = stepped(ca.vertcat(z[1], -z[1]), [0.0, 1.0], 2.0, [0.0, 0.0])
    assert end == pytest.approx([1 - exp(-2.0), exp(-2.0)], rel=1e-12)


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (ca.vertcat(z[1], -z[0]), "here: .* have circular dependencies"),
        (ca.vertcat(z[1] - z[0] ** 3, -z[1]), "here: .* states that depend on others"),
    ],
)
def test_what_has_no_step_is_refused(rate: ca.SX, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        held_step(rate, z, 0.1, ca.SX([0.0, 0.0]), "here")


def test_rates_inside_a_force_become_symbols() -> None:
    rate = ca.vertcat(1 - z[0], z[1] ** 2)
    force, r = force_of_rate(3 * z[0] + 7 * (1 - z[0]), rate, z)
    of = ca.Function("F", [z, r], [force])
    assert float(of([2.0, 0.0], [5.0, 0.0])) == 6.0 + 35.0
