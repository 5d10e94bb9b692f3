"""Models as M y' = f: index, singular mass matrices, consistent starts."""

import casadi as ca
import numpy as np
import pytest

import symfric as sf
from symfric import Model, Variable
from symfric.codegen import plant_block
from symfric.integrator.equations.initial import consistent
from symfric.integrator.equations.inputs import Input, input_data
from symfric.integrator.equations.system import System, system

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
