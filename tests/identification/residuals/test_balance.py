"""Forward dynamics is the oracle: accelerations that it gives for a force need that force."""

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.residuals.balance import balance, coordinates
from symfric import Stribeck, rabinowicz
from symfric.laws import LuGre
from symfric.model import Model
from symfric.scenes import Arm
from symfric.scenes.blocks import Drive

Array = NDArray[np.float64]

LAW = Stribeck(mu_s=0.15, mu_d=0.1, v_s=0.05, sigma_2=2.0)
COUNT = 8


def forward(model: Model, x: Array, u: Array, p: Array) -> Array:
    """Rates of the states at one point, algebraic unknowns found by Newton's method."""
    alg, ode = model.function("alg"), model.function("ode")
    slope = alg.jacobian()
    z = np.array([float(v.start) if isinstance(v.start, float) else 10.0 for v in model.z])
    for _ in range(50):
        if not z.size:
            break
        g = alg(0, x, z, u, p).full().ravel()
        J = slope(0, x, z, u, p, g)[2].full()
        z = z - np.linalg.solve(J, g)
    return ode(0, x, z, u, p).full().ravel()


def points(model: Model) -> tuple[Array, Array, list[Array], Array]:
    """States, inputs and rates at random points, and the parameters."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, (COUNT, len(model.x)))
    u = rng.uniform(-10, 10, (COUNT, len(model.u)))
    p = model.values("p")
    return x, u, [forward(model, a, b, p) for a, b in zip(x, u, strict=True)], p


@pytest.mark.parametrize(
    ("model", "signals"),
    [
        (Drive(LAW).model(["m", "mu_d", "sigma_2"]), ["force"]),
        (Arm(LAW).model(["load", "mu_d", "sigma_2"]), [f"tau{i}" for i in range(1, 7)]),
        (rabinowicz(LAW, free=["m", "mu_d"]), ["balance of v"]),
    ],
    ids=["drive", "arm", "block"],
)
def test_forward_dynamics_leaves_nothing(model: Model, signals: list[str]) -> None:
    found = coordinates(model, "test")
    names = [v.name for v in model.p]
    x, u, rates, p = points(model)
    places = {v.name: k for k, v in enumerate(model.x)}
    columns: list[Array] = []
    for state, force, rate in zip(x, u, rates, strict=True):
        q = [0.0 if c.position is None else state[places[c.position.name]] for c in found]
        v = [state[places[c.rate.name]] for c in found]
        a = [rate[places[c.rate.name]] for c in found]
        columns.append(np.array([*q, *v, *a, *force, 0.0]))
    w = np.column_stack(columns)
    made = balance(model, names, found, w, "test")
    assert [row.signal for row in made.rows] == signals
    path = made.equations.along(w, 1.0, p)
    np.testing.assert_allclose(path.rows, 0.0, atol=1e-8)
    other = made.equations.along(w, 1.0, 1.2 * p)
    assert (np.abs(other.rows) > 1e-3).any()


def test_only_friction_of_a_row_switches_it_off() -> None:
    model = Arm(LAW).model(["mu_d"])
    made = balance(model, ["mu_d"], coordinates(model, "test"), np.ones((3 * 6 + 6 + 1, 1)), "test")
    assert [row.slips for row in made.rows] == [(i,) for i in range(6)]


def test_states_of_laws_are_no_coordinates() -> None:
    (one,) = coordinates(Drive(LuGre()).model(), "test")
    assert (one.position.name, one.rate.name) == ("x", "v")
