"""Moves that only friction stops, which wide layers cannot, against the closed form."""

from math import sqrt

import numpy as np
import pytest
from tables import sampled

from ocp import Free, Phase, Problem, integral, solve
from symfric import BrownMcPhee, ExactCoulomb, Law, drive
from symfric.multibody import DiscClutch, Mechanism, Revolute

MU, INERTIA, RADIUS = 0.35, 0.1, 0.15


@pytest.mark.parametrize(
    ("law", "speed", "most", "k"),
    sampled(
        [
            (ExactCoulomb(mu_s=0.5, mu_d=MU), 20.0, 500.0, 1e-5),
            (ExactCoulomb(mu_s=MU, mu_d=MU), 20.0, 200.0, 1e-5),
            (ExactCoulomb(mu_s=MU, mu_d=MU), 20.0, 500.0, 1e-5),
            (ExactCoulomb(mu_s=MU, mu_d=MU), 200.0, 500.0, 1e-5),
            (ExactCoulomb(mu_s=MU, mu_d=MU), 2.0, 50.0, 1e-3),
            (BrownMcPhee(mu_s=MU, mu_d=MU, v_t=1e-3), 20.0, 500.0, 1e-5),
        ],
        of=6,
    ),
)
def test_a_brake_stops_a_wheel_at_least_cost(law: Law, speed: float, most: float, k: float) -> None:
    m = Mechanism("wheel")
    m.body("wheel", mass=5.0, inertia=(INERTIA, INERTIA, INERTIA))
    m.joint(Revolute("shaft", "ground", "wheel"))
    pedal = m.input("pedal", "N", nominal=100.0)
    m.force(DiscClutch("brake", "shaft", law, pedal, RADIUS, RADIUS))
    phase = Phase(
        m.build(), Free(0.01, 50.0), start={"shaft": 0.0, "shaft_rate": speed},
        end={"shaft_rate": 0.0}, bounds={"pedal": (0.0, most)},
    )  # fmt: skip
    found = solve(Problem(phase, integral(lambda s: 1 + k * s.pedal**2)))
    # the cost per angular momentum, (1 + k P^2) / (mu r P), is least at P = 1 / sqrt(k)
    force = min(most, 1 / sqrt(k))
    T = speed * INERTIA / (MU * RADIUS * force)
    assert found.verified and found.cost == pytest.approx(T * (1 + k * force**2), rel=1e-6)
    assert pytest.approx(T, rel=1e-5) == found.T
    if isinstance(law, ExactCoulomb):
        assert np.all(found["brake_mode"] == 1.0)


def test_a_block_that_coasts_to_rest_arrives_when_friction_stops_it() -> None:
    phase = Phase(
        drive(ExactCoulomb(mu_s=0.15, mu_d=0.1)), Free(0.1, 20.0), start={"x": 0.0, "v": 1.0},
        end={"v": 0.0}, bounds={"force": (0.0, 0.0)},
    )  # fmt: skip
    found = solve(Problem(phase, integral(lambda s: 1.0)))
    arrival = 1 / (0.1 * 9.81)
    assert found.verified and found.cost == pytest.approx(arrival, rel=1e-7)
    assert [mode.kind for mode in found.modes["guide"]] == ["slip+"]
