"""Solutions with the iteration matrix; algebraic unknowns after a jump, by two loops."""

import ctypes
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from closed_forms import assemble, smooth_dae

import symfric.integrator.equations.blocks as module
from symfric import BrownMcPhee, LuGre, Model, Variable, Viscous, rabinowicz
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.blocks import (
    Following,
    at_rest,
    blocks,
    corrected,
    following,
    signs,
    slopes,
)
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.system import System
from symfric.scenes import FourBar, Pendulum, PendulumBox, SliderCrank

NONE = np.zeros(0)
LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
x, z = Variable("x", "m", start=1.0), Variable("z", "1")
MACHINES: dict[str, Callable[[], Model]] = {
    "joint": lambda: PendulumBox(LAW).model(),
    "loop": lambda: SliderCrank(LAW).model(),
    "chart": lambda: Pendulum(LAW).mechanism().build(formulation="absolute", index=0),
}


@pytest.mark.parametrize("model", [rabinowicz(LuGre()), smooth_dae().model], ids=lambda m: m.name)
def test_solution_satisfies_its_equation(model: Model) -> None:
    system, rng = assemble(model), np.random.default_rng(0)
    y, right, memory = (rng.random(system.n) for _ in range(3))
    if system.nx == 3:
        y[2] *= 1e-5
    J = ca.Function("J", [system.y, system.d], [ca.jacobian(system.f, system.y)])(y, []).full()
    for gamma, h in ((1.0, 0.1), (0.25, 1e-6), (0.5, 10.0)):
        block = blocks(system, gamma)
        k = block.solve(block.factor(y, h, []), right, memory).full().ravel()
        W = system.M / (gamma * h) - J
        expected = np.linalg.solve(W, right + system.M @ memory)
        assert k == pytest.approx(expected, rel=1e-10 * np.linalg.cond(W) ** 0.25)


def test_factors_that_are_kept_longer_than_their_slopes_still_fit() -> None:
    """Caches of few systems forget at different times; what one keeps has symbols of its own."""
    first = assemble(FourBar(BrownMcPhee()).model())
    at_rest(first)
    for other in (rabinowicz(LuGre()), smooth_dae().model, rabinowicz(BrownMcPhee())):
        slopes(assemble(other))
    assert corrected(first).n_instructions() > 0
    y = np.zeros(first.n)
    assert len(signs(first, 0.25)(y, 0.1, np.zeros(first.d.numel()))) == 3


def of(model: Model) -> tuple[System, Following]:
    """The equations of a model, and how their unknowns follow."""
    system = assemble(model)
    follow = following(system)
    assert follow is not None
    return system, follow


def with_z(alg: ca.SX) -> Model:
    return Model("alg", x=(x,), z=(z,), ode=-x.symbol, alg=alg + 0 * x.symbol)


CUBIC = with_z(z.symbol + z.symbol**3 - x.symbol)


def at_start(system: System, model: Model) -> Array:
    guess = first_guess(system, model, model.initial_state())
    return consistent(system, "here", guess, model.values("p"))


def test_a_round_is_of_order_three_and_exact_for_linear_equations() -> None:
    """At x = 2 is z = 1; half the error before a round is an eighth of the error behind it."""
    _, follow = of(CUBIC)
    errors = [float(follow.round([2.0, 1 + e], [])[0][1]) - 1 for e in (0.02, 0.01, 0.005)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([3.0, 3.0], abs=0.1)
    _, follow = of(with_z(3 * z.symbol - x.symbol))
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
    moved = system.algebraic[1]
    for _ in range(2):
        guess = y.copy()
        guess[moved] *= rng.uniform(0.8, 1.2, len(moved))
        before, found = guess.copy(), follow(guess, d)
        assert found is not None
        np.testing.assert_array_equal(guess, before)
        np.testing.assert_array_equal(np.delete(found, moved), np.delete(y, moved))
        assert found == pytest.approx(y, rel=1e-9, abs=1e-12 * np.abs(y).max())


def test_mass_matrices_that_are_no_identity_follow_too() -> None:
    """A capacitor between two nodes: only the difference of their voltages has a rate."""
    a, b = Variable("a", "V", start=1.0), Variable("b", "V", start=0.2)
    rates = ca.SX.sym("rates", 2)
    current = rates[0] - rates[1]
    residual = ca.vertcat(current + a.symbol, -current + b.symbol**3 + b.symbol)
    system, follow = of(Model("circuit", x=(a, b), xdot=rates, residual=residual))
    found = follow(np.array([1.0, 0.2]), NONE)
    assert found is not None
    assert found[0] - found[1] == pytest.approx(0.8, rel=1e-14)
    assert found[0] + found[1] ** 3 + found[1] == pytest.approx(0.0, abs=1e-14)
    assert found == pytest.approx(consistent(system, "here", np.array([1.0, 0.2]), NONE), rel=1e-12)


def test_what_is_far_or_nowhere_is_left_to_the_search() -> None:
    """Full steps would leap to 4 pi and to -1, or wander about."""
    s = z.symbol
    cases = ((ca.sin(s), 1.75), (s**3 - s, 0.45), (s**2 + 1, 0.5), (s - ca.SX.nan(), 0.0))
    for alg, start in cases:
        assert of(with_z(alg))[1](np.array([1.0, start]), NONE) is None
    assert following(assemble(Model("decay", x=(x,), ode=-x.symbol))) is None


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
        assert (follow(y, d) is not None) is free
    with pytest.raises(ValueError, match="friction jams"):
        consistent(system, "here", y, d)


@needs_compiler
def test_the_loop_in_c_gives_the_same_bits() -> None:
    for model in (CUBIC, MACHINES["loop"]()):
        system, follow = of(model)
        generator = ca.CodeGenerator("follow.c", {"static_aux": True})
        generator.add(follow.round)
        library = load(generator.dump() + follow.c_source, "symfric_follow")
        library.symfric_follow.argtypes = [ctypes.c_void_p] * 2
        y, d, rng = at_start(system, model), model.values("p"), np.random.default_rng(2)
        ends = set[int]()
        for spread in (1e-12, 0.1, 0.5, 3.0, 30.0):
            guess = y * rng.uniform(1 - spread, 1 + spread, y.size)
            guess[: system.nx] = y[: system.nx]
            there, here = guess.copy(), follow(guess, d)
            end = library.symfric_follow(there.ctypes.data, d.ctypes.data)
            np.testing.assert_array_equal(there, guess if here is None else here)
            assert end == (here is None)
            ends.add(end)
        assert ends == ({0, 1} if system.n == 2 else {0})
