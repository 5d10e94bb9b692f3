"""Symbolic factors, pivot orders and rank, against NumPy.

Solutions with the iteration matrix; algebraic unknowns after a jump, by two loops.
"""

import ctypes
from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from closed_forms import assemble

import symfric.integrator.equations.blocks as module
from symfric import BrownMcPhee, Model, Variable, Viscous
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.compiler import load
from symfric.integrator.equations.blocks import (
    Following,
    following,
)
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.matrices import (
    SymbolicLU,
    backward_error,
    best_order,
    echelon,
    factorise,
    null_space,
    regular,
)
from symfric.integrator.equations.system import System
from symfric.scenes import Pendulum, PendulumBox, SliderCrank

DIAGONAL = ((0, 0), (1, 1))


def random_sparse(n: int, density: float, seed: int) -> Array:
    """Structurally nonsingular: a hidden permutation of large entries, the rest at random."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    values[np.arange(n), rng.permutation(n)] += 3.0 * rng.choice([-1, 1], n)
    return values


def factors(values: Array, safe: tuple[int, ...] = ()) -> tuple[SymbolicLU, ca.Function]:
    """The factors of this pattern, and b -> (x, sign of the determinant, all pivots)."""
    rows, columns = np.nonzero(values)
    pattern = ca.Sparsity.triplet(*values.shape, rows.tolist(), columns.tolist())
    A, b, numbers = ca.SX.sym("a", pattern), ca.SX.sym("b", len(values)), values.T[values.T != 0]
    lu = factorise(A, [safe])
    every = ca.Function("every", [lu.symbols, b], [lu.solve(b), lu.sign(), lu.pivots(range(99))])
    packed = ca.Function("packed", [A], [lu.packed])(ca.DM(pattern, numbers))
    return lu, ca.Function("at", [b], every.call([packed, b]))


@pytest.mark.parametrize(
    ("n", "density"), [(1, 0.0), (2, 0.5), (5, 0.3), (12, 0.15), (25, 0.08), (6, 1.0)]
)
def test_solution_sign_and_pivots_are_those_of_dense_elimination(n: int, density: float) -> None:
    for seed in range(4):
        values = random_sparse(n, density, seed)
        b = np.random.default_rng(seed).normal(size=n)
        lu, every = factors(values)
        x, sign, pivots = (result.full().ravel() for result in every(b))
        # pivots are chosen for their place, not their size, hence the condition in the tolerance
        bound = 1e-9 * np.linalg.cond(values)
        assert x == pytest.approx(np.linalg.solve(values, b), rel=bound, abs=bound)
        assert sign.item() == np.sign(np.linalg.det(values))
        assert abs(np.prod(pivots)) == pytest.approx(abs(np.linalg.det(values)))
        assert np.count_nonzero(values) <= lu.packed.numel() <= n * n
        for k in (0, 1):
            assert sorted(place[k] for place in lu.order) == list(range(n))
        assert lu.pivots([lu.order[-1][0]]).numel() == 1


def test_empty_and_singular_matrices() -> None:
    """The step rejects what is not finite."""
    assert factorise(ca.SX(0, 0)).solve(ca.SX(0, 1)).shape == (0, 1)
    x = factors(np.array([[1.0, 2.0], [2.0, 4.0]]))[1]([1.0, 1.0])[0]
    assert not np.isfinite(x.full()).any()
    for entries, rows in (
        ([[1, 1], [0, 0]], r"\[1\]"), ([[1, 0, 0], [1, 1, 0], [0, 1, 0]], r"\[2\]"),
        ([[0, 1, 1], [1, 0, 0], [1, 0, 0]], r"\[\d\]"),
    ):  # fmt: skip
        A = np.array(entries, dtype=float)
        with pytest.raises(ValueError, match=f"nonsingular matrix, .* equations {rows}; an alg"):
            factors(A)
    with pytest.raises(ValueError, match=r"found no pivot for equations \[1\]"):
        best_order(np.array([[1.0, 1.0], [0.0, 0.0]]) != 0, np.array([[[1.0, 1.0], [0.0, 0.0]]]))


def test_regular_and_singular_matrices_are_distinguished_in_any_units() -> None:
    """A stiff oscillator at a long step: the second pivot grows 1e10-fold and is right."""
    assert backward_error(np.array([[1e-5, -1.0], [1.0, 1e-5]]), DIAGONAL) < 1e-10
    for A in (np.ones((2, 2)), np.diag([1.0, 0.0]), np.diag([1e9, 1e-300, 0.0])):
        assert not regular(A)
    for size in (1e-200, 1e200):
        assert regular(np.diag([size, 1.0, 3.0]) @ (np.eye(3) + 0.2))
    empty = np.zeros((0, 0))
    assert (regular(empty), backward_error(empty, ())) == (True, 0.0)
    assert best_order(empty != 0, empty[None]) == ()


def test_order_found_is_sound_in_all_samples_at_once() -> None:
    """Diagonals vanish in one sample each; a hidden permutation is safe in all."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        n, place = 12, rng.permutation(12)
        samples = np.where(rng.random((4, n, n)) < 0.2, rng.normal(size=(4, n, n)), 0.0)
        for k, A in enumerate(samples):
            np.fill_diagonal(A, 0.0 if k % 2 else 1e-13)
            A[np.arange(n), place] = 5.0
            A *= 10.0 ** rng.integers(-6, 6, (n, 1))
        order = best_order((samples != 0).any(axis=0) | np.eye(n, dtype=bool), samples)
        assert sorted(r for r, _ in order) == sorted(c for _, c in order) == list(range(n))
        assert backward_error(samples, order) < 1e-12
        assert max(backward_error(A, tuple((i, i) for i in range(n))) for A in samples) > 1e-9


@pytest.mark.parametrize("rank", [0, 1, 3, 5])
def test_columns_span_the_matrix_and_null_space_is_mapped_to_zero(rank: int) -> None:
    rng = np.random.default_rng(rank)
    plain = rng.normal(size=(7, rank)) @ rng.normal(size=(rank, 5))
    units = 10.0 ** rng.integers(-8, 8, (7, 1)) * plain * 10.0 ** rng.integers(-8, 8, 5)
    for A in (plain, units):
        columns, B = echelon(A)
        assert (len(columns), columns) == (rank, sorted(columns))
        size = np.abs(A).max(axis=1, keepdims=True, initial=0.0) + 1e-300
        np.testing.assert_allclose(A[:, columns] @ B / size, A / size, atol=1e-10)
        K = null_space(A)
        assert (K.shape, np.linalg.matrix_rank(K)) == ((5, 5 - rank), 5 - rank)
        assert (np.abs(A @ K) <= 1e-10 * (np.abs(A) @ np.abs(K)) + 1e-300).all()


def test_circuits_and_unknowns_without_rates_are_exact() -> None:
    capacitors = np.array([[-1e-6, 1e-6, 0], [1e-6, -1e-6, 0], [0, 0, -2e-6]])
    columns, B = echelon(capacitors)
    assert (columns, B.tolist()) == ([0, 2], [[1, -1, 0], [0, 0, 1]])
    assert null_space(capacitors).tolist() == [[1], [1], [0]]
    assert null_space(np.diag([2.0, 0.0, 1.0, 0.0])).T.tolist() == [[0, 1, 0, 0], [0, 0, 0, 1]]
    assert null_space(np.array([[0.0, 3.0], [0.0, 0.0]])).tolist() == [[1], [0]]
    assert null_space(np.eye(3)).shape == (3, 0)
    assert null_space(np.zeros((0, 0))).shape == (0, 0)


NONE = np.zeros(0)
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
