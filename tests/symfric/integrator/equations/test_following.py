"""Algebraic unknowns behind a jump: the solution of the damped search, in order 3, by two loops."""

import ctypes
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from closed_forms import assemble
from numpy.typing import NDArray

import symfric.integrator.equations.blocks as module
from symfric import BrownMcPhee, Model, Variable, Viscous
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.blocks import Following, following
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.system import System
from symfric.scenes import Pendulum, PendulumBox, SliderCrank

Array = NDArray[np.float64]
LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
x, z = Variable("x", "m", start=1.0), Variable("z", "1")

MACHINES: dict[str, Callable[[], Model]] = {
    "joint": lambda: PendulumBox(LAW).model(),
    "loop": lambda: SliderCrank(LAW).model(),
    "chart": lambda: Pendulum(LAW).mechanism().build(formulation="absolute", index=0),
}


def of(model: Model) -> tuple[System, Following]:
    """The equations of a model, and how their unknowns follow."""
    system = assemble(model)
    follow = following(system)
    assert follow is not None
    return system, follow


def at_start(system: System, model: Model) -> Array:
    """Consistent unknowns at the start of a model."""
    guess = first_guess(system, model, model.initial_state())
    return consistent(system, "here", guess, model.values("p"))


def cubic() -> Model:
    """z + z^3 = x."""
    return Model("cubic", x=(x,), z=(z,), ode=-x.symbol, alg=z.symbol + z.symbol**3 - x.symbol)


def test_a_round_is_of_order_three() -> None:
    """At x = 2 is z = 1; half the error before a round is an eighth of the error behind it."""
    _, follow = of(cubic())
    errors = [float(follow.round([2.0, 1 + e], [])[0][1]) - 1 for e in (0.02, 0.01, 0.005)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.1)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(3.0, abs=0.1)


def test_linear_equations_take_one_round() -> None:
    model = Model("linear", x=(x,), z=(z,), ode=-x.symbol, alg=3 * z.symbol - x.symbol)
    _, follow = of(model)
    after, look = follow.round([6.0, 100.0], [])
    assert after.full().ravel() == pytest.approx([6.0, 2.0], rel=1e-15)
    assert look.full().ravel() == pytest.approx([49.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("machine", "inline"), [("joint", True), ("loop", True), ("chart", True), ("loop", False)]
)
def test_unknowns_are_those_of_the_damped_search(
    machine: str, inline: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "INLINE", 10**6 if inline else 10)
    model = MACHINES[machine]()
    system, follow = of(model)
    y, d, rng = at_start(system, model), model.values("p"), np.random.default_rng(1)
    for _ in range(3):
        guess = y.copy()
        guess[system.algebraic[1]] *= rng.uniform(0.8, 1.2, len(system.algebraic[1]))
        before = guess.copy()
        found = follow(guess, d)
        assert found is not None
        np.testing.assert_array_equal(guess, before)
        kept = [i for i in range(system.n) if i not in system.algebraic[1]]
        np.testing.assert_array_equal(found[kept], y[kept])
        size = np.abs(y).max()
        assert found == pytest.approx(y, rel=1e-9, abs=1e-12 * size)


def test_mass_matrices_that_are_no_identity_follow_too() -> None:
    """A capacitor between two nodes: only the difference of their voltages has a rate."""
    a, b = Variable("a", "V", start=1.0), Variable("b", "V", start=0.2)
    rates = ca.SX.sym("rates", 2)
    current = rates[0] - rates[1]
    residual = ca.vertcat(current + a.symbol, -current + b.symbol**3 + b.symbol)
    system, follow = of(Model("circuit", x=(a, b), xdot=rates, residual=residual))
    guess = np.array([1.0, 0.2])
    found = follow(guess, np.zeros(0))
    assert found is not None
    assert found[0] - found[1] == pytest.approx(0.8, rel=1e-14)
    assert found[0] + found[1] ** 3 + found[1] == pytest.approx(0.0, abs=1e-14)
    assert found == pytest.approx(consistent(system, "here", guess, np.zeros(0)), rel=1e-12)


@pytest.mark.parametrize(
    ("alg", "start"),
    [
        (ca.sin(z.symbol), 1.75),
        (z.symbol**3 - z.symbol, 0.45),
        (z.symbol**2 + 1, 0.5),
        (z.symbol - ca.SX.nan(), 0.0),
    ],
)
def test_what_is_far_or_nowhere_is_left_to_the_search(alg: ca.SX, start: float) -> None:
    """Full steps would leap to 4 pi and to -1, or wander about."""
    _, follow = of(Model("far", x=(x,), z=(z,), ode=-x.symbol, alg=alg + 0 * x.symbol))
    assert follow(np.array([1.0, start]), np.zeros(0)) is None


def test_a_jam_is_left_to_the_search_which_names_it() -> None:
    """A light box slides into the wedge of its pendulum, where 1 - dN/dN = 0.1, and 5e-4."""
    law = BrownMcPhee(mu_s=0.12, mu_d=0.12, v_t=1e-3)
    box = PendulumBox(law, hinge=Viscous(sigma_2=0.0), m_box=0.02)
    model = box.mechanism().build(formulation="joint", index=1)
    system, follow = of(model)
    y, d = at_start(system, model), model.values("p")
    for reserve, free in ((0.1, True), (5e-4, False)):
        # 1 - mu sin cos / (r + sin^2) = reserve with r = 1e-3, an equation in tan(phi)
        steep = np.roots([(1 - reserve) * 1.001, -0.12, (1 - reserve) * 1e-3]).max()
        y[:4] = 0.0, np.arctan(steep), 1.0, 0.0
        found = follow(y, d)
        assert (found is not None) is free
        if not free:
            with pytest.raises(ValueError, match="friction jams"):
                consistent(system, "here", y, d)


def test_a_system_without_algebraic_unknowns_has_nothing_to_follow() -> None:
    assert following(assemble(Model("decay", x=(x,), ode=-x.symbol))) is None


@needs_compiler
def test_the_loop_in_c_gives_the_same_bits() -> None:
    for model in (cubic(), MACHINES["loop"]()):
        system, follow = of(model)
        generator = ca.CodeGenerator("follow.c", {"static_aux": True})
        generator.add(follow.round)
        library = load(generator.dump() + follow.c_source, "symfric_follow")
        library.symfric_follow.argtypes = [ctypes.c_void_p] * 2
        y, d, rng = at_start(system, model), model.values("p"), np.random.default_rng(2)
        ends = list[int]()
        for spread in (1e-12, 0.1, 0.5, 3.0, 30.0):
            guess = y * rng.uniform(1 - spread, 1 + spread, y.size)
            guess[: system.nx] = y[: system.nx]
            there, here = guess.copy(), follow(guess, d)
            ends.append(library.symfric_follow(there.ctypes.data, d.ctypes.data))
            np.testing.assert_array_equal(there, guess if here is None else here)
            assert ends[-1] == (here is None)
        assert set(ends) == ({0, 1} if system.n == 2 else {0})
