"""Models as M y' = f: index, singular mass matrices, consistent starts.

Mechanisms stay on their constraints on all levels, and what cannot go on says why.
"""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from closed_forms import assemble

import symfric as sf
import symfric.multibody as mb
from symfric import BrownMcPhee, Model, SolveError, Status, Trajectory, Variable, Viscous, simulate
from symfric.codegen import plant_block
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.equations.system import System, system
from symfric.scenes import FourBar, FourMass, Pendulum, SliderCrank

x, y = Variable("x", "m", start=1.0), Variable("y", "m", start=2.0, nominal=0.1)
z = Variable("z", "1")
X, Y, Z = x.symbol, y.symbol, z.symbol
t, r = ca.SX.sym("t"), ca.SX.sym("rates", 2)
STIFF = ("rodas5p", "rodas4p", "rodas3", "radau5")


def assembled(model: Model, **inputs: Input) -> System:
    return system(model, input_data(model, inputs, 0.0, 2.0))


def value(s: System, unknowns: list[float], data: list[float]) -> list[float]:
    """Right-hand side at a point."""
    return ca.Function("f", [s.y, s.d], [s.f])(unknowns, data).full().ravel().tolist()


def implicit(*residual: ca.SX, unknowns: tuple[Variable, ...] = (x, y), **more: object) -> Model:
    return Model("implicit", x=unknowns, xdot=r, residual=ca.vertcat(*residual), **more)  # type: ignore[arg-type]


def dae(ode: ca.SX, alg: ca.SX) -> Model:
    return Model("dae", x=(x,), z=(z,), ode=ode, alg=alg, t=t)


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (sf.rabinowicz(sf.BrownMcPhee()), "x v"),
        (sf.rabinowicz(sf.LuGre()), "x v z"),
        (Model("autonomous", x=(x,), ode=-X, t=t), "x"),
        (Model("timed", x=(x,), ode=-t * X, t=t), "x t"),
        (dae(-Z, Z - X), "x z"),
        (dae(-Z, Z - t), "x z t"),
        (implicit(r[0] ** 3 + X, r[1] + Y), "x y x_dot y_dot"),
        (implicit(r[0] * Y + X, r[1] + Y), "x y x_dot y_dot"),
        (implicit(r[0] * r[1] + X, r[1] + Y), "x y x_dot y_dot"),
        # real far from the start only: all rates are taken as unknowns
        (implicit(ca.sqrt(X - 50) * r[0] + X, r[1] ** 3 + Y), "x y x_dot y_dot"),
    ],
)
def test_unknowns_are_time_and_rates_only_where_equations_need_them(
    model: Model, names: str
) -> None:
    s = assembled(model)
    assert list(s.names) == names.split()
    assert (s.n, s.timed) == (len(s.names), s.names[-1] == "t")
    assert s.d.numel() == 0


@pytest.mark.parametrize(
    ("signal", "unknowns", "data"),
    [
        (2.0, 2, 1),
        (sf.Hold([0.0, 1.0], [0.0, 1.0]), 2, 1),
        (sf.Linear([0.0, 1.0], [1.0, 1.0]), 2, 1),
        (sf.Linear([0.0, 1.0], [0.0, 1.0]), 3, 3),
        (ca.sin, 3, 0),
    ],
    ids=["number", "hold", "level", "linear", "expression"],
)
def test_inputs_cost_only_the_data_they_need(signal: Input, unknowns: int, data: int) -> None:
    """A linear input has value, slope and start of its interval; only it needs time."""
    s = assembled(sf.drive(sf.BrownMcPhee()), force=signal)
    assert (s.n, s.d.numel()) == (unknowns, data)


def test_constant_mass_matrices_are_kept_and_algebraic_rows_and_columns_are_found() -> None:
    """Equations without rates and unknowns without rates need not stand at the same place."""
    s = assembled(dae(-Z * t, Z - X))
    assert ca.DM(s.mass).full().tolist() == [[1, 0, 0], [0, 0, 0], [0, 0, 1]]
    assert (s.mass.nnz(), s.algebraic) == (2, ([1], [1]))
    assert value(s, [2.0, 3.0, 0.5], []) == [-1.5, 1.0, 1.0]
    s = assembled(implicit(2 * r[0] + r[1] + X, 3 * r[1] - Y))
    assert ca.DM(s.mass).full().tolist() == [[2, 1], [0, 3]]
    assert (s.names, s.algebraic) == (("x", "y"), ([], []))
    assert value(s, [1.0, 2.0], []) == [-1.0, 2.0]
    s = assembled(implicit(r[0] * Y + X, r[1] + Y))
    assert s.algebraic == ([2, 3], [2, 3])
    assert value(s, [1.0, 2.0, 5.0, 7.0], [])[:2] == [5.0, 7.0]
    model = Model("dae", x=(x,), z=(z,), xdot=r[0], residual=ca.vertcat(Z - 2 * X, r[0] + Z))
    assert assembled(model).algebraic == ([0], [1])
    assert sf.simulate(model, 1.0, rtol=1e-9).final["x"] == pytest.approx(np.exp(-2), rel=1e-7)


def test_permuted_equations_of_an_implicit_model_are_solved() -> None:
    """Row 1 holds the rate of y and row 2 that of x: no pivot stands on the diagonal."""
    final = sf.simulate(implicit(r[1] + Y, r[0] + X), 1.0, rtol=1e-9).final
    assert [final["x"], final["y"]] == pytest.approx([np.exp(-1), 2 * np.exp(-1)], rel=1e-8)


v, w, lam = Variable("v", "m/s"), Variable("w", "m/s"), Variable("lam", "N/m")
V, W, L = v.symbol, w.symbol, lam.symbol
CONSTRAINTS = {3: X**2 + Y**2 - 1, 2: X * V + Y * W, 1: V**2 + W**2 - L * (X**2 + Y**2) - 9.81 * Y}


def pendulum(index: int) -> Model:
    ode = ca.vertcat(V, W, -L * X, -L * Y - 9.81)
    return Model("pendulum", x=(x, y, v, w), z=(lam,), ode=ode, alg=CONSTRAINTS[index])


def test_models_of_higher_index_are_refused_with_the_unknowns_they_leave_open() -> None:
    """This was "factorise: found no pivot for equations [4]"."""
    same = r[0] - r[1] + X
    charge = X * r[0] + Y * r[1] + X, X**2 + Y**2 - 1  # has a rate, and is given at the same time
    for model, message in (
        (pendulum(3), r"^model 'pendulum': .* determine lam .*; differentiate"),
        (pendulum(2), r"^model 'pendulum': .* determine lam .*; differentiate"),
        (implicit(same, 2 * same), "model 'implicit': .* determine x, y at given states"),
        (implicit(*charge), "determine x_dot, y_dot at"),
    ):
        with pytest.raises(ValueError, match=message):
            assembled(model)
    run = sf.simulate(pendulum(1), 1.0, x0={"y": 0.0}, rtol=1e-9, backend="vm")
    assert run.final["x"] ** 2 + run.final["y"] ** 2 == pytest.approx(1.0, abs=1e-6)


a, b = Variable("a", "V", start=2.0), Variable("b", "V", start=0.0)
R = Variable("R", "Ohm", start=1.0)
A, B = a.symbol, b.symbol
CURRENT = 0.5 * (r[0] - r[1])
COUPLED = implicit(
    CURRENT + A / R.symbol, -CURRENT + (B - 2) / R.symbol, unknowns=(a, b), p=(R,)
)  # fmt: skip
"""A capacitor between two nodes: its current leaves one and enters the other.

C (a' - b') = -a / R = (b - 2) / R: a + b = 2, 2 C a' = -a / R. M is C [1 -1; -1 1].
"""


@cache
def varactor(scale: float = 1.0) -> Model:
    """The same with C = 1 + (a - b)^2, and b = -a."""
    current = scale * (1 + (A - B) ** 2) * (r[0] - r[1])
    return implicit(current + scale * A, -current + scale * B, unknowns=(a, b))


@pytest.mark.parametrize("method", STIFF)
def test_singular_mass_matrices_are_taken_unchanged(method: str) -> None:
    """These ended with STEP_TOO_SMALL and "a discontinuity is near".

    Of the varactor (1 + 4 a^2) 2 a' = -a: ln a + 2 a^2 + t / 2 stays.
    """
    run = sf.simulate(COUPLED, 3.0, rtol=1e-8, method=method, backend="vm")
    assert run.step_times.size < 3000
    np.testing.assert_allclose(run["a"], 2 * np.exp(-run.t), atol=1e-6)
    np.testing.assert_allclose(run["a"] + run["b"], 2.0, atol=1e-9)
    for scale in (1.0, 1e-6):
        model = varactor(scale)
        assert assembled(model).names == ("a", "b", "a_dot")
        run = sf.simulate(model, 3.0, rtol=1e-8, method=method, backend="vm", x0={"b": -2.0})
        kept = np.log(run["a"]) + 2 * run["a"] ** 2 + run.t / 2
        np.testing.assert_allclose(kept, kept[0], atol=2e-6)
        np.testing.assert_allclose(run["b"], -run["a"], atol=1e-8)


def test_dependent_rows_lose_their_rates_and_charges_stay() -> None:
    """A start with a - b = 2, the charge over C, keeps it; a + b = 2 is met."""
    s = assembled(COUPLED)
    assert s.names == ("a", "b")
    assert ca.DM(s.mass).full().tolist() == [[0.5, -0.5], [0, 0]]
    assert (s.algebraic, s.free.tolist()) == (([1], []), [[1], [1]])
    assert s.has_pivots
    assert not assembled(sf.rabinowicz(sf.LuGre())).has_pivots
    assert value(s, [2.0, 5.0], [1.0]) == pytest.approx([-2.0, -5.0])
    found = consistent(s, "here", np.array([3.0, 1.0]), np.array([1.0]))
    assert found == pytest.approx([2.0, 0.0], abs=1e-12)
    run = sf.simulate(COUPLED, 1.0, x0={"a": 3.0, "b": 1.0}, rtol=1e-8, backend="vm")
    assert run.final["a"] == pytest.approx(2 * np.exp(-1.0), rel=1e-6)
    made = plant_block(COUPLED, h=0.01, method="rodas3")
    assert [one.start for one in made.states] == pytest.approx([2.0, 0.0])


def test_unknown_without_a_rate_may_stand_among_the_states() -> None:
    """(1 + a^2) a' = -b, 0 = b - a (1 + a^2): a' = -a. Its rate would make it index 2."""
    model = implicit((1 + A**2) * r[0] + B, B - A * (1 + A**2), unknowns=(a, b))
    assert assembled(model).names == ("a", "b", "a_dot")
    run = sf.simulate(model, 1.0, rtol=1e-8, backend="vm")
    np.testing.assert_allclose(run["a"], 2 * np.exp(-run.t), rtol=1e-6)


def test_ensembles_derivatives_and_flows_keep_the_charge_too() -> None:
    """a = (1 + (a0 - b0) / 2) exp(-t / R) for every a0 + b0."""
    starts = np.array([2.0, 3.0, 4.0])
    many = sf.simulate_many(
        COUPLED, 1.0, x0={"a": starts, "b": starts - 2}, backend="vm", executor="serial"
    )
    np.testing.assert_allclose(many["a"][:, 0], 2 * np.exp(-1.0), rtol=1e-5)
    run = sf.simulate(COUPLED, 1.0, rtol=1e-9, backend="vm", sensitivities=["R", "x0.a"])
    slopes = run.sensitivities
    np.testing.assert_allclose(slopes["R"]["a"], 2 * run.t * np.exp(-run.t), atol=1e-5)
    np.testing.assert_allclose(slopes["x0.a"]["a"], np.exp(-run.t) / 2, atol=1e-6)
    xf = sf.flow(COUPLED, steps=40)([3.0, 1.0], [], [1.0], 1.0)
    assert xf.full().ravel() == pytest.approx([2 * np.exp(-1), 2 - 2 * np.exp(-1)], abs=1e-6)


SMOOTH = Viscous(sigma_2=0.0)
LOOPS = {
    "four_mass": FourMass(SMOOTH).model(),
    "slider_crank": SliderCrank(SMOOTH, omega=20.0).model(),
    "four_bar": FourBar(SMOOTH).model(),
}
each_loop = pytest.mark.parametrize("name", LOOPS)


def largest(run: Trajectory) -> list[float]:
    """Largest violation of the constraints in position, velocity and acceleration."""
    levels = ("position", "velocity", "acceleration")
    return [float(run[f"constraint_{level}"].max()) for level in levels]


@each_loop
@pytest.mark.parametrize("method", ["rodas5p", "rodas4p", "radau5"])
def test_constraints_hold_on_three_levels_whatever_the_method(name: str, method: str) -> None:
    """Between steps, too, where the dense output is projected."""
    run = simulate(LOOPS[name], 0.4, rtol=1e-6, method=method, samples=77)
    assert (np.array(largest(run)) < [1e-12, 1e-12, 1e-10]).all()


@each_loop
@pytest.mark.slow
def test_energy_and_constraints_last_for_100_s(name: str) -> None:
    run = simulate(LOOPS[name], 100.0, rtol=1e-10, samples=5001)
    assert np.ptp(run["energy"]) / np.abs(run["energy"]).max() < 1e-6
    assert max(largest(run)[:2]) < 1e-11


def test_accelerations_are_unknowns_and_projection_is_the_nearest_point() -> None:
    """x1 and y2 of the four-mass system lie on a circle of 5 m; no mass matrix is inverted."""
    s = assemble(LOOPS["four_mass"])
    assert s.names[8:12] == ("x1_rate_dot", "y2_rate_dot", "z3_rate_dot", "x4_rate_dot")
    assert (s.n, s.nx, s.has_pivots) == (8 + 4 + 2, 8, False)
    assert s.pivots == (tuple(range(12)), (12, 13), ())
    assert s.manifold is not None
    y = np.zeros(s.n)
    y[:4] = 4.001, 3.001, 40**0.5, 5.0
    x1, y2, z3, x4 = s.manifold.project(y, []).full()[:4, 0]
    assert (x1**2 + y2**2, y2**2 + z3**2) == pytest.approx((25.0, 49.0), abs=1e-11)
    assert x4 == 5.0
    assert np.abs([x1 - 4.001, y2 - 3.001]).max() < 2e-3


def test_a_start_off_the_constraints_is_assembled_or_refused() -> None:
    run = simulate(LOOPS["four_mass"], 0.1, x0={"x1": 3.9, "x4_rate": -2.0})
    assert run["constraint_position"].max() < 1e-12
    assert run["x4_rate"][0] == -2.0
    length = Variable("length", "m", start=2.5)
    m = mb.Mechanism("bead")
    m.body("bead", 1.0, (0.1, 0.1, 0.1))
    m.frame("ground.peg", at=(2.0, 0.0, 0.0))
    m.joint(mb.Prismatic("z", "ground", "bead", start=1.5))
    m.joint(mb.Distance("rod", "ground.peg", "bead", length=length.symbol))
    model = m.build((length,))
    assert simulate(model, 0.01, p={"length": 2.1})["z"][0] == pytest.approx(0.41**0.5)
    with pytest.raises(ValueError, match="from which all loops can be closed"):
        simulate(model, 0.1, p={"length": 1.9})


@cache
def drawer(mu_s: float, rate: float = 1.0, names: tuple[str, ...] = ("slide",)) -> Model:
    """A drawer with its centre of mass off its guide, pulled back: N = 2 m c |a| / length.

    While it slides forward, a (1 - 2 mu c / length) = -F / m: with c = length it jams where the
    coefficient of friction reaches 1/2. More `names` make more of them, all alike.
    """
    m = mb.Mechanism("drawer", gravity=(0.0, 0.0, 0.0))
    friction = mb.JointFriction(BrownMcPhee(mu_s=mu_s, mu_d=0.1, v_t=0.01), length=0.1)
    for name in names:
        m.body(f"{name}r", 2.0, (0.01, 0.01, 0.01), com=(0.1, 0.0, 0.0))
        m.joint(mb.Prismatic(name, "ground", f"{name}r", rate=rate, friction=friction))
        m.force(mb.JointSpringDamper(f"pull_{name}", name, "slide", actuator=-5.0))
    return m.build()


def test_below_the_limit_the_drawer_moves_as_it_must() -> None:
    """mu = 0.1 while it slides fast: a = -2.5 / 0.8 m/s^2."""
    run = simulate(drawer(0.4), 0.2, rtol=1e-8)
    assert run["slide_rate"][-1] == pytest.approx(1 - 0.2 * 2.5 / 0.8, abs=1e-4)
    assert run["slide_N"][100] == pytest.approx(2 * 2.0 * 2.5 / 0.8, rel=1e-3)


@pytest.mark.parametrize("method", ["rodas5p", "radau5"])
def test_jamming_ends_with_joint_law_and_time(method: str) -> None:
    """It jams where x = v / v_t gives mu = 1/2: 0.1 + 0.5 x / (x^2/4 + 3/4)^2 at x = 2.05."""
    with pytest.raises(SolveError, match=r"stopped at t = 0\.309") as caught:
        simulate(drawer(0.6), 1.0, rtol=1e-8, method=method)
    assert caught.value.status is Status.JAMMED
    assert "joint 'slide' with BrownMcPhee" in str(caught.value)
    run = caught.value.partial
    assert run["slide_rate"][-1] == pytest.approx(0.0205, abs=2e-4)
    assert (run["slide_N"] >= 0).all()


def test_two_that_jam_at_once_and_starts_beyond_jamming_are_seen() -> None:
    """The determinant stays positive."""
    with pytest.raises(SolveError, match=r"stopped at t = 0\.309.*joint '(left|right)' with"):
        simulate(drawer(0.6, names=("left", "right")), 1.0, rtol=1e-8)
    with pytest.raises(ValueError, match="model 'drawer': "):
        simulate(drawer(0.6, rate=0.01), 1.0)


@pytest.mark.parametrize("mu", [0.3, 1.5])
@pytest.mark.parametrize("v_t", [1e-2, 1e-6])
def test_sticking_friction_runs_at_every_width(mu: float, v_t: float) -> None:
    law = BrownMcPhee(mu_s=mu, mu_d=0.8 * mu, v_t=v_t)
    run = simulate(Pendulum(law, R=0.1).model(), 20.0, rtol=1e-7)
    assert np.isfinite(run["energy"]).all()
    assert abs(run["phi_rate"][-1]) < 2 * v_t / 0.1


def test_mass_ratios_of_a_million_do_not_matter() -> None:
    m = mb.Mechanism("m")
    for name, mass in (("heavy", 1e3), ("light", 1e-3)):
        m.body(name, mass, (mass / 10,) * 3)
        m.frame(f"{name}.top", at=(0.0, 0.0, 0.5), z=(0.0, 1.0, 0.0))
        m.frame(f"{name}.end", at=(0.0, 0.0, -0.5), z=(0.0, 1.0, 0.0))
    m.frame("ground.top", z=(0.0, 1.0, 0.0))
    m.joint(mb.Revolute("a", "ground.top", "heavy.top", start=0.5))
    m.joint(mb.Revolute("b", "heavy.end", "light.top"))
    run = simulate(m.build(), 5.0, rtol=1e-9)
    assert np.ptp(run["energy"]) < 1e-5 * np.ptp(run["kinetic"])
