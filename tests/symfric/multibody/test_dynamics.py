"""Newton-Euler against Lagrange, energy against work, both formulations, named Functions."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from chains import TREE, at_start, chain, in_both, rod, solve, state

from symfric import BrownMcPhee, LuGre
from symfric import multibody as mb
from symfric.foundation.parameters import Variable
from symfric.multibody.dynamics import kinetic_energy
from symfric.multibody.equations import equations
from symfric.multibody.forces import Force
from symfric.multibody.prepare import PreparedMechanism
from symfric.scenes import MECHANISMS, Arm, FourMass

both_ways = pytest.mark.parametrize("reverse", [False, True])


@cache
def prepared(reverse: bool) -> PreparedMechanism:
    return chain(reverse).prepare()


def accelerations(
    made: PreparedMechanism, q: np.ndarray, qd: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Random accelerations that keep Euler parameters of length one, and what they may not move."""
    a, free = np.random.default_rng(4).normal(size=made.eq.n), np.eye(made.eq.n)
    for link in made.eq.kin.topology.links:
        if link.joint.quaternion is not None:
            first = link.first + link.joint.quaternion
            rows = slice(first, first + 4)
            a[rows] -= q[rows] * (q[rows] @ a[rows] + qd[rows] @ qd[rows])
            free[rows, rows] -= np.outer(q[rows], q[rows])
    return a, free


@both_ways
def test_newton_euler_gives_lagranges_equations(reverse: bool) -> None:
    made = prepared(reverse)
    eq, kin = made.eq, made.eq.kin
    T, V = kinetic_energy(kin), eq.potential
    p = ca.gradient(T, eq.qd)
    lagrange = ca.jtimes(p, eq.qd, eq.a) + ca.jtimes(p, eq.q, eq.qd) - ca.gradient(T - V, eq.q)
    values = ca.Function("both", [eq.q, eq.qd, eq.a, eq.lam],
                         [eq.balance, lagrange, ca.densify(eq.mass)])  # fmt: skip
    q, qd = state(made)
    a, free = accelerations(made, q, qd)
    ours, expected, M = (m.full() for m in values.call([q, qd, a, np.zeros(eq.m)]))
    # along the Euler parameters themselves there is no motion
    assert free @ ours == pytest.approx(free @ expected, rel=1e-11, abs=1e-10)
    assert pytest.approx(M.T, rel=1e-12, abs=1e-12) == M
    assert np.linalg.eigvalsh(M).min() > 0


@cache
def loaded(formulation: str, bearing: mb.JointFriction | None = None) -> PreparedMechanism:
    """The chain with every kind of force, and friction in all joints that have any."""
    m = chain()
    m.joints = [replace(j, friction=bearing if j.rubs else None) for j in m.joints]
    m.force(mb.SpringDamper("spring", "ground", "b3.out", 30.0, 0.5, 2.0, 1.0))
    m.force(mb.SpringDamper("pull", "b1", "b5.out", stiffness=4.0))
    m.force(mb.JointSpringDamper("torsion", "j0", "turn", 5.0, 0.2, 0.3, 1.5))
    m.force(mb.JointSpringDamper("push", "j2", "slide", 5.0, 0.2, 0.3, 1.5))
    m.force(mb.UserForce("wind", "b6.out", lambda kin: (kin.motion["b1"].v, (0.1, 0.2, 0.3))))
    return m.prepare(formulation=formulation)


@in_both
def test_kinetic_energy_changes_by_the_power_of_all_forces(formulation: str) -> None:
    made = loaded(formulation)
    eq = made.eq
    T_dot = ca.jtimes(eq.kinetic, eq.q, eq.qd) + ca.jtimes(eq.kinetic, eq.qd, eq.a)
    values = ca.Function("power", [eq.q, eq.qd, eq.a], at_start(eq, [T_dot, eq.power]))
    q, qd = (made.q0, made.qd0) if formulation == "absolute" else state(made)
    found = solve(eq, q, qd)
    rate, power = (float(x) for x in values.call([q, qd, found.a]))
    assert rate == pytest.approx(power, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ["pendulum_box", "slider_crank", "four_bar"])
def test_both_formulations_agree(name: str) -> None:
    scene = MECHANISMS[name](BrownMcPhee(v_t=0.5))
    tree, whole = (scene.mechanism().prepare(formulation=f) for f in ("joint", "absolute"))
    ours, expected = (solve(made.eq, made.q0, made.qd0) for made in (tree, whole))
    scale = max(1.0, float(np.abs(ours.N).max()))
    assert pytest.approx(expected.N, rel=1e-12, abs=1e-12 * scale) == ours.N
    loops = [i for i, label in enumerate(tree.labels) if not label.endswith("_norm")]
    others = [whole.labels.index(tree.labels[i]) for i in loops]
    assert ours.lam[loops] == pytest.approx(expected.lam[others], rel=1e-12, abs=1e-11 * scale)
    for body, motion in ours.bodies.items():
        largest = np.abs(motion).max()
        assert motion == pytest.approx(expected.bodies[body], abs=1e-12 * max(1.0, largest))
    for joint, wrench in ours.reactions.items():
        assert wrench == pytest.approx(expected.reactions[joint], abs=1e-11 * scale), joint


def test_both_formulations_agree_on_every_joint_and_its_friction() -> None:
    law = BrownMcPhee(mu_s=0.03, mu_d=0.02, v_t=0.5)
    bearing = mb.JointFriction(law, radius=0.05, length=0.5, width=0.5)
    made = [loaded(formulation, bearing) for formulation in ("joint", "absolute")]
    ours, expected = (solve(one.eq, one.q0, one.qd0) for one in made)
    names = [c.name for c in made[0].eq.contacts]
    assert names == ["j0", "j1", "j2_slide", "j2_turn", "j3_x", "j3_y", "j5"]
    assert len(ours.reactions) == len(TREE)
    assert pytest.approx(expected.N, rel=1e-10) == ours.N
    for body, motion in ours.bodies.items():
        assert motion == pytest.approx(expected.bodies[body], rel=1e-9, abs=1e-9), body
    for joint, wrench in ours.reactions.items():
        assert wrench == pytest.approx(expected.reactions[joint], rel=1e-9, abs=1e-8), joint


def test_swinging_rod_carries_the_centrifugal_force() -> None:
    """At the lowest point m g + m L w^2."""
    made = rod(mb.JointFriction(BrownMcPhee(mu_s=0.0, mu_d=0.0), radius=0.1)).prepare()
    found = solve(made.eq, np.array([0.0]), np.array([3.0]))
    assert pytest.approx([2.0 * 9.81 + 2.0 * 0.4 * 9.0], abs=2e-4) == found.N


CONSERVATIVE: dict[str, Force] = {
    "gravity": mb.Gravity("g", (0.1, 0.2, -9.0)),
    "spring": mb.SpringDamper("s", "ground.out", "b4.out", 30.0, 0.5),
    "spring without length": mb.SpringDamper("s", "b1.out", "b4", stiffness=30.0),
    "torsion": mb.JointSpringDamper("t", "j0", "turn", 5.0, 0.3),
    "sliding spring": mb.JointSpringDamper("t", "j2", "slide", 5.0, 0.3),
    "torsion, of the only direction": mb.JointSpringDamper("t", "j0", stiffness=5.0, rest=0.3),
    "spring in a turn of a cylinder": mb.JointSpringDamper("t", "j2", "turn", 5.0, 0.3),
}


@cache
def made_in(formulation: str, reverse: bool) -> PreparedMechanism:
    return chain(reverse).prepare(formulation=formulation)


def power_of(
    force: Force, formulation: str = "joint", reverse: bool = False, start: bool = False
) -> tuple[float, float]:
    """Power of a force and rate of its energy, at the start or in a random state."""
    made = made_in(formulation, reverse)
    q, qd = (made.q0, made.qd0) if start else state(made)
    kin = made.eq.kin
    total = sum((load.power(kin) for load in force.loads(kin)), ca.SX(0))
    energy = force.energy(kin)
    turns = kin.turns.values() if kin.turns else ()
    rate = ca.jtimes(energy, kin.q, kin.qd)
    rate += sum(ca.jtimes(energy, turn.angle.symbol, turn.rate) for turn in turns)
    both = ca.substitute(
        [total, rate], [t.angle.symbol for t in turns], [t.angle.start for t in turns]
    )
    values = ca.Function("power", [kin.q, kin.qd], both)
    return tuple(float(x) for x in values.call([q, qd]))  # type: ignore[return-value]


@pytest.mark.parametrize("reverse", [False, True])
def test_power_is_minus_the_rate_of_the_energy(reverse: bool) -> None:
    for name, force in CONSERVATIVE.items():
        power, rate = power_of(force, reverse=reverse)
        assert power == pytest.approx(-rate, rel=1e-11), name
        assert abs(power) > 1e-3, name


def test_both_formulations_see_the_same_power() -> None:
    for name in ("torsion", "sliding spring", "spring"):
        ours, same = (power_of(CONSERVATIVE[name], f, start=True) for f in ("joint", "absolute"))
        assert ours[0] == pytest.approx(same[0], rel=1e-10)


def test_dampers_take_energy() -> None:
    for force in (mb.SpringDamper("d", "ground.out", "b3.out", damping=2.0),
                  mb.JointSpringDamper("d", "j1", damping=2.0)):  # fmt: skip
        power, rate = power_of(force)
        assert power < 0
        assert rate == 0.0


def test_absent_terms_cost_nothing() -> None:
    """A spring without damping has no velocity in it, one without length no root."""
    made = made_in("joint", False)
    topology, t, counts = made.eq.kin.topology, made.eq.kin.t, list[int]()
    for more in ((), (1.0,), (1.0, 2.0)):
        eq = equations(topology, [mb.SpringDamper("s", "ground", "b1", 3.0, *more)], [],
                       made.eq.q, made.eq.qd, t)  # fmt: skip
        b = ca.Function("b", [eq.q, eq.qd, eq.a, eq.lam], [eq.balance])
        counts.append(b.n_instructions())
    assert counts == sorted(set(counts))


def test_mass_bias_and_inverse_dynamics_fit_each_other() -> None:
    m = chain()
    f, made = mb.functions(m), m.prepare()
    q, qd = state(made)
    a, lam = np.random.default_rng(2).normal(size=made.eq.n), np.zeros(made.eq.m)
    M, bias = f["mass"](q, []).full(), f["bias"](q, qd, [], []).full()
    whole = f["inverse_dynamics"](q, qd, a, lam, [], [], []).full()
    assert whole == pytest.approx(M @ a[:, None] + bias, rel=1e-12, abs=1e-10)


def test_inverse_dynamics_undoes_the_model_with_friction() -> None:
    """Of the arm with bristles: no generalised force is missing for the model's accelerations."""
    scene = Arm(LuGre())
    model, f = scene.model(), mb.functions(scene.mechanism())
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
    model, f = scene.model(), mb.functions(scene.mechanism())
    x = model.initial_state()
    phi, jacobian = (m.full() for m in f["constraints"].call([x[:4], []]))
    assert np.abs(phi).max() < 1e-14
    assert jacobian == pytest.approx(np.array([[4, 3, 0, 0], [0, 3, 40**0.5, 0]]))
    kinetic, potential = (float(e) for e in f["energy"].call([x[:4], x[4:8], []]))
    assert kinetic == pytest.approx(3.0)
    assert kinetic + potential == pytest.approx(387.9365209137809)


def test_poses_give_the_positions_of_the_bodies() -> None:
    pose = mb.functions(rod())["poses"]([np.pi / 2], []).full()
    assert pose[:, 3] == pytest.approx([-0.4, 0.0, 0.0])
    assert pose[:, :3] @ pose[:, :3].T == pytest.approx(np.eye(3))


def test_parameters_enter_by_their_symbols() -> None:
    radius = Variable("radius", "m", start=0.1)
    friction = mb.JointFriction(BrownMcPhee(), radius=radius.symbol)
    f = mb.functions(rod(friction), (radius,))["inverse_dynamics"]
    still, sliding = (
        [float(f([0.0], [w], [0.0], [], [], [], [r])) for r in (0.1, 0.2)] for w in (0.0, 1.0)
    )
    assert still == pytest.approx([0.0, 0.0])
    assert sliding[1] == pytest.approx(2 * sliding[0], rel=1e-3)
