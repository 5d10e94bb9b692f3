"""The open model of a mechanism: friction forces as inputs, widths of loads as parameters."""

import casadi as ca
import numpy as np
import pytest
from chains import X, Z, attach

from symfric import BrownMcPhee, LuGre, Variable, simulate
from symfric.multibody import JointFriction, Mechanism, Prismatic, Spherical
from symfric.scenes import FourMass, PendulumBox, SliderCrank

LEVELS = BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=1e-2)


def test_forces_of_ones_own_move_the_mechanism_as_its_law_would() -> None:
    """The whole run, with normal forces from reactions and a closed loop."""
    for scene in (PendulumBox, SliderCrank):
        model = scene(LEVELS).model()
        again = model.with_forces({c.name: c.friction for c in model.contacts})
        one, other = (simulate(m, 0.3, rtol=1e-9) for m in (model, again))
        for name, signal in one.signals.items():
            np.testing.assert_allclose(other[name][-1], signal[-1], rtol=1e-5, atol=1e-6)


def test_width_of_the_normal_force_is_a_parameter_when_asked_for() -> None:
    model = PendulumBox(LEVELS).model()
    eps = [c.widths["eps"] for c in model.contacts]
    forces = {c.name: c.friction for c in model.contacts}
    free = model.with_forces(forces, p=tuple(eps))
    assert [v.name for v in free.p] == ["x_eps", "phi_eps"]
    assert free.values("p").tolist() == [1e-4, 1e-4]
    x, z = model.initial_state(), np.array([250.0, 180.0])
    rows = free.function("alg")
    fixed = model.function("alg")(0.0, x, z, [], []).full()
    np.testing.assert_allclose(rows(0.0, x, z, [], [1e-4, 1e-4]).full(), fixed, rtol=1e-14)
    assert not np.allclose(rows(0.0, x, z, [], [5.0, 5.0]).full(), fixed)
    assert model.with_forces(forces).p == ()


def test_a_slider_that_is_held_stands_on_the_force_that_its_drive_needs() -> None:
    """Stick as an unknown reaction in a loop: the motion of the rest goes on, the slider stands."""
    model = FourMass(LEVELS).model()
    contact = next(c for c in model.contacts if c.name == "x4")
    reaction = Variable("held", "N")
    forces = {c.name: c.friction for c in model.contacts} | {"x4": reaction.symbol}
    n, a = model.holonomic.n, model.holonomic.a  # type: ignore[union-attr]
    x = model.vector("x")
    acceleration = ca.jtimes(contact.slip, x[n : 2 * n], a)
    held = model.with_forces(forces, z=(reaction,), alg=acceleration)
    run = simulate(held, 0.3, x0={"x4_rate": 0.0})
    assert np.ptp(run["x4"]) < 1e-12
    assert np.ptp(run["x1"]) > 1e-3
    stretch = run["x4"] + 10.0 - run["x1"] - 11.0
    np.testing.assert_allclose(run["held"], -10.0 * stretch, atol=1e-9)


def test_a_ball_keeps_its_law_in_the_open_model() -> None:
    """Its slip is a vector: there are no two sides of rest."""
    m = Mechanism("ball")
    attach(m, Spherical, "ball", "bob", J=0.01, to=(0.0, 0.0, 0.5),
           friction=JointFriction(LuGre(), radius=0.01))  # fmt: skip
    model = m.build()
    assert model.contacts == ()
    assert [v.name for v in model.open.x] == [v.name for v in model.x]
    other = FourMass(LuGre()).model()
    assert [v.name for v in other.x[8:]] == ["x1_z", "y2_z", "z3_z", "x4_z"]
    assert [v.name for v in other.open.x] == [v.name for v in other.x[:8]]
    assert [str(c.N) for c in other.contacts[:3]] == ["x1_N", "y2_N", "z3_N"]


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_open_in_both_formulations(formulation: str) -> None:
    m = Mechanism("slide")
    attach(m, Prismatic, "x", "box", mass=2.0, z=X, x=Z, rate=1.0, friction=JointFriction(LEVELS))
    model = m.build(formulation=formulation)
    run = simulate(model.open, 0.5, u={"x_F": 1.0})
    assert run["x_slip"][-1] == pytest.approx(0.75, rel=1e-6)
    assert run["x_N"][-1] == pytest.approx(2.0 * 9.81, rel=1e-4)
