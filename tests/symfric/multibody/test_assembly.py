"""Models of mechanisms: counts, open models, and chains at a cost that grows with the links."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from chains import X, Z, attach, in_both

from symfric import BrownMcPhee, LuGre, Model, Variable, Viscous, simulate
from symfric.bench.multibody import chain
from symfric.integrator.equations.blocks import blocks, corrected, signs, slopes
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.tableaux import METHODS
from symfric.laws import Law
from symfric.multibody import JointFriction, Mechanism, Prismatic, Spherical, UserForce, prepare
from symfric.multibody.equations import Equations
from symfric.multibody.kinematics import Cuts
from symfric.scenes import FourBar, FourMass, Pendulum, PendulumBox, SliderCrank

LAW = BrownMcPhee(v_t=0.01)


def four_mass(joints: str = "", friction: JointFriction | None = None) -> Mechanism:
    """The four-mass system with friction in the joints named, that of the scene by default."""
    m = FourMass(LAW).mechanism()
    m.joints = [
        replace(j, friction=None if j.name not in joints.split() else friction or j.friction)
        for j in m.joints
    ]
    return m


def test_unknowns_guesses_and_monitors_are_those_that_are_needed() -> None:
    """Two multipliers of the rods; x4 carries its weight only, whatever friction does."""
    constant = JointFriction(LAW, normal=50.0)
    bare, one = four_mass().build(), four_mass("x1").build()
    assert [m.nominal for m in one.monitors] == [0.01]
    assert bare.monitors == ()
    sizes = [(len(m.x), len(m.z)) for m in (bare, four_mass("x1 y2 z3 x4", constant).build(), one)]
    assert sizes == [(8, 2), (8, 2), (8, 3)]
    starts, force = {v.name: v.start for v in one.z}, one.z[-1]
    assert starts["rod_12_lambda"] == pytest.approx(bare.z[0].start)
    assert (force.name, force.start > 0) == ("x1_N", True)
    assert force.doc.endswith("'x1' with BrownMcPhee")
    # a law that does not need the load gets none: reactions are no symbols of the model
    (viscous,) = four_mass("x1", JointFriction(Viscous())).build().contacts
    assert np.isnan(float(ca.DM(viscous.N)))


@in_both
def test_explicit_accelerations_satisfy_the_implicit_equations(formulation: str) -> None:
    """Closed-form inverse and factors of the mass matrix, against the balance of forces."""
    model = four_mass("x1 y2 z3 x4").build(formulation=formulation)
    mechanics = model.holonomic
    assert len(model.z) == (5 if formulation == "joint" else 30)
    assert mechanics is not None
    assert model.ode is not None
    n, x, z = mechanics.n, model.vector("x"), model.vector("z")
    left = ca.substitute(mechanics.implicit[:n], mechanics.a, model.ode[n : 2 * n])
    start = model.initial_state()
    values = ca.Function("left", [x, z], [left])(
        start, np.random.default_rng(0).normal(size=z.numel())
    )
    assert np.abs(values.full()).max() < 1e-11


def test_a_mechanism_has_one_source_of_its_equations() -> None:
    # `simulate` read `holonomic` and `ocp` read `ode`: zeros put there moved one and not the other
    model = FourBar(BrownMcPhee()).model()
    for part in ("ode", "alg"):
        with pytest.raises(ValueError, match=rf"{part}: expected none with `holonomic`"):
            replace(model, **{part: ca.SX.zeros(getattr(model, part).shape)})
    more = replace(model, outputs={})
    assert ca.is_equal(more.ode, model.ode)
    assert ca.is_equal(more.alg, model.alg)
    heavier = replace(model.holonomic, implicit=2.0 * model.holonomic.implicit)
    with pytest.raises(ValueError, match="ode: expected none"):
        replace(model, holonomic=heavier)
    n, nz = model.holonomic.n, len(model.z)
    again = replace(model, holonomic=heavier, ode=None, alg=ca.SX(0, 1))
    assert (again.ode.numel(), again.alg.numel()) == (2 * n, nz)


LEVELS = BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=1e-2)


def test_user_forces_move_the_mechanism_as_its_law_would() -> None:
    """The whole run, with normal forces from reactions and a closed loop."""
    model = SliderCrank(LEVELS).model()
    again = model.with_forces({c.name: c.friction for c in model.contacts})
    one, other = (simulate(m, 0.3, rtol=1e-9) for m in (model, again))
    for name, signal in one.signals.items():
        np.testing.assert_allclose(other[name][-1], signal[-1], rtol=1e-5, atol=1e-6)


def test_a_build_writes_each_load_and_each_mass_matrix_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Checks and start values take the loads and the mass matrix of the equations."""
    made, of_mass = list[str](), Equations.mass.func
    monkeypatch.setattr(Equations.mass, "func", lambda eq: made.append("mass") or of_mass(eq))
    m = Pendulum(LAW).mechanism()
    m.force(UserForce("push", "rod", lambda kin: made.append("push") or (X, X)))
    m.build()
    assert sorted(made) == ["mass", "push"]


def test_width_of_the_normal_force_is_a_parameter_on_request() -> None:
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


def test_a_held_slider_is_in_equilibrium_with_its_drive_force() -> None:
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


@in_both
def test_open_in_both_formulations(formulation: str) -> None:
    m = Mechanism("slide")
    attach(m, Prismatic, "x", "box", mass=2.0, z=X, x=Z, rate=1.0, friction=JointFriction(LEVELS))
    model = m.build(formulation=formulation)
    run = simulate(model.open, 0.5, u={"x_F": 1.0})
    assert run["x_slip"][-1] == pytest.approx(0.75, rel=1e-6)
    assert run["x_N"][-1] == pytest.approx(2.0 * 9.81, rel=1e-4)


pytestmark = pytest.mark.heavy

GAMMA = float(METHODS["rodas5p"].diagonal or 0.0)
LAWS = {"none": None, "brown_mcphee": BrownMcPhee(v_t=0.01), "lugre": LuGre(sigma_0=1e3)}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


def unknowns(model: Model) -> System:
    return system(model, input_data(model, None, 0.0, 1.0))


def both(links: int, law: Law | None, monkeypatch: pytest.MonkeyPatch) -> tuple[System, System]:
    """The same chain with cuts and without."""
    found: list[System] = []
    for first in (2, 1000):
        monkeypatch.setattr(prepare, "LONG", first)
        monkeypatch.setattr(prepare, "LONG_WITH_FRICTION", first)
        found.append(unknowns(chain(links, law)))
    return found[0], found[1]


def some(n: int, seed: int = 0) -> np.ndarray:
    """Unknowns of about 0.3, normal forces among them positive."""
    return np.abs(np.random.default_rng(seed).normal(0.3, 0.1, n))


def test_cut_keeps_numbers_and_symbols_and_knows_what_is_used() -> None:
    cuts, x = Cuts(), ca.SX.sym("x", 2)
    kept = cuts(3, ca.vertcat(1.5, x[0], ca.sin(x[1]), ca.SX(1, 1)))
    assert (cuts.links, str(cuts.values)) == ([3], "sin(x_1)")
    assert (kept.nnz(), ca.depends_on(kept, x[1])) == (3, False)
    unused, last = cuts(0, ca.cos(x[0])), cuts(1, kept[2] * x[0])
    assert cuts.needed(last + 1) == [0, 2]
    assert cuts.needed(unused * 2) == [1]


@each_law
def test_steps_signs_and_refined_unknowns_of_cut_chains_are_those_of_whole_ones(
    law: Law | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """W k = right for both, although one never sees W."""
    cut, whole = both(3, law, monkeypatch)
    assert cut.inner is not None
    assert whole.inner is None
    order = [i for group in slopes(cut).pivots for i in group]
    assert sorted(order) == [*range(cut.n + cut.inner.l.numel())]  # each is eliminated once
    y, right, memory = (some(cut.n, seed) for seed in range(3))
    steps, every, refined = [], [], []
    for made in (cut, whole):
        block = blocks(made, GAMMA)
        steps.append(block.solve(block.factor(y, 0.01, []), right, memory).full().ravel())
        every.append([float(sign) for sign in signs(made, GAMMA)(y, 0.01, [])[:2]])
        refined.append(corrected(made)(y, []).full().ravel())
    assert steps[0] == pytest.approx(steps[1], abs=1e-10 * np.abs(steps[1]).max())
    assert every[0] == every[1]
    assert refined[0] == pytest.approx(refined[1], rel=1e-9, abs=1e-9)


def instructions(links: int, law: Law | None) -> int:
    made = unknowns(chain(links, law))
    block = blocks(made, GAMMA)
    stage = block.f.n_instructions() + block.solve.n_instructions()
    return block.slopes.n_instructions() + block.pack.n_instructions() + 8 * stage


@pytest.mark.slow
@each_law
def test_cuts_are_made_where_they_pay(law: Law | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the length from which they are made; beyond it the cost grows with the links alone."""
    name = "LONG" if law is None else "LONG_WITH_FRICTION"
    longest, found = getattr(prepare, name), list[int]()
    for first, links in ((2, longest), (2, 2 * longest), (1000, longest)):
        monkeypatch.setattr(prepare, name, first)
        found.append(instructions(links, law))
    assert found[0] < 1.05 * found[2]
    assert np.log2(found[1] / found[0]) < 1.15
