"""Named Functions of a mechanism fit each other and its model."""

import numpy as np
import pytest
from chains import chain, rod, state

from symfric import BrownMcPhee, LuGre
from symfric.foundation.parameters import Variable
from symfric.multibody import JointFriction, functions
from symfric.scenes import Arm, FourMass


def test_mass_bias_and_inverse_dynamics_fit_each_other() -> None:
    m = chain()
    f, made = functions(m), m.prepare()
    q, qd = state(made)
    a, lam = np.random.default_rng(2).normal(size=made.eq.n), np.zeros(made.eq.m)
    M, bias = f["mass"](q, []).full(), f["bias"](q, qd, [], []).full()
    whole = f["inverse_dynamics"](q, qd, a, lam, [], [], []).full()
    assert whole == pytest.approx(M @ a[:, None] + bias, rel=1e-12, abs=1e-10)


def test_inverse_dynamics_undoes_the_model_with_friction() -> None:
    """Of the arm with bristles: no generalised force is missing for the model's accelerations."""
    scene = Arm(LuGre())
    model, f = scene.model(), functions(scene.mechanism())
    x = model.initial_state()
    x[6:12] = np.linspace(0.5, -0.5, 6)
    u, z = np.linspace(3.0, -1.0, 6), np.full(6, 30.0)
    # the normal forces the accelerations lead to, for which these are right
    for _ in range(60):
        a = model.function("ode")(0, x, z, u, []).full()[6:12]
        z = z + model.function("alg")(0, x, z, u, []).full().ravel() * 0.5
    missing = f["inverse_dynamics"](x[:6], x[6:12], a, [], x[12:], u, []).full()
    assert np.abs(missing).max() < 1e-6


def test_constraints_and_energy_are_those_of_the_model() -> None:
    scene = FourMass(BrownMcPhee())
    model, f = scene.model(), functions(scene.mechanism())
    x = model.initial_state()
    phi, jacobian = (m.full() for m in f["constraints"].call([x[:4], []]))
    assert np.abs(phi).max() < 1e-14
    assert jacobian == pytest.approx(np.array([[4, 3, 0, 0], [0, 3, 40**0.5, 0]]))
    kinetic, potential = (float(e) for e in f["energy"].call([x[:4], x[4:8], []]))
    assert kinetic == pytest.approx(3.0)
    assert kinetic + potential == pytest.approx(387.9365209137809)


def test_poses_say_where_the_bodies_are() -> None:
    pose = functions(rod())["poses"]([np.pi / 2], []).full()
    assert pose[:, 3] == pytest.approx([-0.4, 0.0, 0.0])
    assert pose[:, :3] @ pose[:, :3].T == pytest.approx(np.eye(3))


def test_parameters_enter_by_their_symbols() -> None:
    radius = Variable("radius", "m", start=0.1)
    friction = JointFriction(BrownMcPhee(), radius=radius.symbol)
    f = functions(rod(friction), (radius,))["inverse_dynamics"]
    still, sliding = (
        [float(f([0.0], [w], [0.0], [], [], [], [r])) for r in (0.1, 0.2)] for w in (0.0, 1.0)
    )
    assert still == pytest.approx([0.0, 0.0])
    assert sliding[1] == pytest.approx(2 * sliding[0], rel=1e-3)
