"""Attempts of a step: acceptance, end time, NaN, controller, form."""

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from closed_forms import ClosedForm, assemble, smooth_dae, smooth_ode, timed_ode
from numpy.typing import NDArray

import symfric.integrator.step.attempt as module
from symfric import BrownMcPhee, LuGre, Model, Variable, rabinowicz
from symfric.bench.mechanisms import chain
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import System, system
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS, RODAS5P
from symfric.integrator.step.attempt import (
    GROW,
    SHRINK,
    Given,
    State,
    build_fixed,
    build_step,
    instructions,
    least,
    written,
)
from symfric.model import Monitor

Array = NDArray[np.float64]
x = Variable("x", "1", start=1.0)
T_AT, H, H_OLD, REJECTED, MEMORY = State.T, State.H, State.H_OLD, State.REJECTED, State.MEMORY


def column(y: Any, t: float = 0.0, h: float = 0.1, rejected: float = 0.0) -> Array:
    """State of an attempt; the previous step was as long and met the tolerance just so."""
    return np.array([t, h, h, 1.0, rejected, *y])


def data(system: System, t_end: float = 10.0, rtol: float = 1e-6) -> Array:
    return Given.of(t_end, rtol, np.inf, np.full(system.nx, 0.1 * rtol), [])


def attempt(
    case: ClosedForm | Model, S: Array, kind: Any = ca.SX, method: str = "rodas5p", **run: float
) -> Array:
    model = case.model if isinstance(case, ClosedForm) else case
    return step_of(model, kind, method)(S, data(assemble(model), **run))[0].full().ravel()


@cache
def step_of(model: Model, kind: Any, method: str) -> ca.Function:
    return build_step(assemble(model), ADAPTIVE[method], kind)


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize(
    "model",
    [rabinowicz(LuGre()), smooth_dae().model, timed_ode().model],
    ids=lambda m: m.name,
)
def test_graph_of_blocks_computes_what_the_flat_expression_does(model: Model, method: str) -> None:
    """The former is compiled, the latter runs in the virtual machine."""
    if model.z and not ADAPTIVE[method].dae:
        pytest.skip("an explicit method")
    system = assemble(model)
    rng = np.random.default_rng(0)
    bristle = [1.0 if n != "z" or system.nx < 3 else 1e-4 for n in system.names]
    y = 0.05 * rng.random(system.n) * bristle
    for h in (1e-7, 1e-3, 0.3):
        given = column(y, h=h), data(system)
        flat, blocks = (step_of(model, kind, method)(*given) for kind in (ca.SX, ca.MX))
        for one, other in zip(flat, blocks, strict=True):
            # where a rejected attempt explodes, so do rounding errors
            assert other.full() == pytest.approx(one.full(), rel=1e-6, abs=1e-12)


def test_graph_of_blocks_is_smaller_for_a_large_system() -> None:
    states = tuple(Variable(f"x_{i}", "1", start=1.0) for i in range(12))
    X = ca.vertcat(*(v.symbol for v in states))
    chain = ca.vertcat(X[1:] - X[:-1], -X[-1]) - X + ca.sin(X) * ca.sum1(X) / 12
    system = assemble(Model("chain", x=states, ode=chain))
    flat, blocks = (build_step(system, RODAS5P, kind) for kind in (ca.SX, ca.MX))
    assert blocks.n_instructions() < flat.n_instructions() / 4


@pytest.mark.parametrize("case", [smooth_ode, smooth_dae, timed_ode])
def test_accepted_attempt_is_the_bare_step(case: Any) -> None:
    problem, h = case(), 0.01
    y = problem.exact(0.0)
    S = attempt(problem, column(y, h=h))
    bare = build_fixed(assemble(problem.model), RODAS5P)(y, h, []).full().ravel()
    assert S[MEMORY:] == pytest.approx(bare, rel=1e-14)
    assert S[[T_AT, H_OLD, REJECTED]].tolist() == [h, h, 0.0]
    assert S[MEMORY:] == pytest.approx(problem.exact(h), rel=1e-9)


def test_rejected_attempt_changes_nothing_but_the_step_size() -> None:
    before = column((1.0, 1.0), h=3.0)
    S = attempt(smooth_ode(), before, rtol=1e-9)
    assert S[[T_AT, *range(MEMORY, S.size)]].tolist() == [0.0, 1.0, 1.0]
    assert SHRINK * 3.0 <= S[H] < 3.0
    assert S[H_OLD] == before[H_OLD]
    assert S[REJECTED] == 1.0


def test_what_is_rejected_first_is_hardly_above_the_tolerance() -> None:
    """A rejected step shrinks to 0.85 h err^(-1/5), which tells err: none above 1 is accepted."""
    lengths = 0.02 * 1.03 ** np.arange(60)
    ends = [attempt(smooth_ode(), column((1.0, 1.0), h=h))[[H, REJECTED]] for h in lengths]
    errors = [(0.85 * h / less) ** 5 for h, (less, no) in zip(lengths, ends, strict=True) if no]
    assert 0 < len(errors) < lengths.size
    assert 1.0 < errors[0] < 2.0


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_step_size_settles_where_the_error_is_just_allowed(rtol: float) -> None:
    """The error of a step goes with h^5 (estimate of order 4), so h goes with rtol^(1/5)."""
    memory = [column(())] * 2
    for _ in range(8):
        memory = [
            attempt(smooth_ode(), np.array([0.0, *m[1:MEMORY], 1.0, 1.0]), rtol=r)
            for m, r in zip(memory, (rtol, rtol / 32), strict=True)
        ]
    assert memory[0][H] / memory[1][H] == pytest.approx(2.0, rel=0.25)


def test_growth_and_shrinkage_of_a_step_are_bounded() -> None:
    grown = attempt(smooth_ode(), column((1.0, 1.0), h=1e-6))
    shrunk = attempt(smooth_ode(), column((1e3, 1e3), h=1e3), t_end=1e4)
    assert grown[H] == pytest.approx(GROW * 1e-6)
    assert shrunk[H] == pytest.approx(SHRINK * 1e3)


def test_step_that_follows_a_better_one_is_the_more_careful() -> None:
    """Gustafsson: h_next = 0.85 h min(g, (h / h_old) g^2 / g_old), g = err^(-1/5)."""
    steady, rising = column((1.0, 1.0), h=0.03), column((1.0, 1.0), h=0.03)
    growth = attempt(smooth_ode(), steady, rtol=1e-7)[State.GROWTH_OLD]
    assert 1.0 < growth < 2.5
    steady[State.GROWTH_OLD], rising[State.GROWTH_OLD] = growth, 1.5 * growth
    ends = [attempt(smooth_ode(), before, rtol=1e-7)[H] for before in (steady, rising)]
    assert ends == pytest.approx([0.03 * 0.85 * growth, 0.03 * 0.85 * growth / 1.5], rel=1e-12)


@pytest.mark.parametrize("h", [1e-8, 1e-4, 1e-2])
def test_step_never_grows_just_after_a_rejection(h: float) -> None:
    S = attempt(smooth_ode(), column((1.0, 1.0), h=h, rejected=1.0))
    assert S[T_AT] == h
    assert S[H] <= h
    assert S[REJECTED] == 0.0
    assert attempt(smooth_ode(), S)[H] > S[H]


@pytest.mark.parametrize("t_end", [0.1, 1.0 / 3.0, 1e-9, 1e5 / 7.0])
def test_end_time_is_hit_exactly(t_end: float) -> None:
    left = 1e-3 * min(t_end, 1.0)
    S = attempt(smooth_ode(), column((1.0, 1.0), t=t_end - left, h=3 * left), t_end=t_end)
    assert S[T_AT] == t_end


def test_end_time_is_hit_where_the_sum_of_time_and_step_would_miss_it() -> None:
    ends, starts = np.random.default_rng(1).random((2, 4000)) * [[10.0], [1.0]]
    missed = starts + (ends - starts) != ends
    late = missed & (ends > starts + 0.1)
    assert late.sum() > 10
    still = Model("still", x=(x,), ode=0 * x.symbol)
    for t, t_end in zip(starts[late][:10], ends[late][:10], strict=True):
        assert attempt(still, column((1.0,), t=t, h=100.0), t_end=t_end)[T_AT] == t_end


def test_step_cut_by_the_end_does_not_forget_its_size() -> None:
    S = attempt(smooth_ode(), column((1.0, 1.0), h=0.01), t_end=1e-6)
    assert S[T_AT] == 1e-6
    assert S[H] >= 0.01


def test_attempt_at_the_end_does_nothing() -> None:
    before = column((1.0, 2.0), t=5.0, h=0.01)
    assert attempt(smooth_ode(), before, t_end=5.0) == pytest.approx(before, abs=0.0)


@pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])
@pytest.mark.parametrize(
    "expression",
    [ca.sqrt(1.05 - x.symbol), ca.log(1.05 - x.symbol), 1 / ca.fmax(1.05 - x.symbol, 0)],
    ids=["root", "logarithm", "division"],
)
def test_right_hand_side_that_is_not_finite_is_rejected(kind: Any, expression: ca.SX) -> None:
    """x' = 1 leaves the domain of the second equation within the step."""
    other = Variable("y", "1")
    model = Model("edge", x=(x, other), ode=ca.vertcat(1, 0.1 * expression))
    S = attempt(model, column((1.0, 0.0), h=0.1), kind)
    assert S[REJECTED] == 1.0
    assert S[MEMORY:].tolist() == [1.0, 0.0]
    assert S[H] == pytest.approx(SHRINK * 0.1)


@pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])
def test_algebraic_unknown_that_is_not_finite_is_rejected(kind: Any) -> None:
    """Though no state depends on it, so that no error is estimated of it."""
    z = Variable("z", "1")
    model = Model(
        "loose", x=(x,), z=(z,), ode=1 + 0 * x.symbol, alg=z.symbol - ca.log(1.05 - x.symbol)
    )
    S = attempt(model, column((1.0, np.log(0.05)), h=0.1), kind)
    assert S[REJECTED] == 1.0
    assert np.isfinite(S).all()


def test_singular_iteration_matrix_is_rejected() -> None:
    z = Variable("z", "1")
    model = Model("flat", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol**2)
    S = attempt(model, column((1.0, 0.0), h=0.1))
    assert S[REJECTED] == 1.0
    assert np.isfinite(S).all()


def rest(rate: float, kind: str) -> tuple[Model, tuple[float, ...]]:
    """x' = rate x in several forms, at rest in x = 0: no method sees an error there."""
    X = Variable("x", "1")
    y, z, p, q = (Variable(name, "1") for name in "yzpq")
    r = ca.SX.sym("r", 2)
    models = {
        "ode": Model("rest", x=(X,), ode=rate * X.symbol),
        "two": Model("rest", x=(X, y), ode=ca.vertcat(rate * y.symbol, rate * X.symbol)),
        "dae": Model("rest", x=(X,), z=(z,), ode=-z.symbol, alg=z.symbol + rate * X.symbol),
        "dae, row negated": Model(
            "rest", x=(X,), z=(z,), ode=-z.symbol, alg=-z.symbol - rate * X.symbol
        ),
        "algebraic variables swapped": Model(
            "rest", x=(X,), z=(p, q), ode=p.symbol,
            alg=ca.vertcat(q.symbol - X.symbol, p.symbol - rate * q.symbol),
        ),
        "permuted": Model(
            "rest", x=(X, y), xdot=r, residual=ca.vertcat(y.symbol + r[1], rate * X.symbol - r[0])
        ),
        "algebraic row first": Model(
            "rest", x=(X,), z=(z,), xdot=r[0],
            residual=ca.vertcat(z.symbol - rate * X.symbol, r[0] - z.symbol),
        ),
        "negative mass": Model("rest", x=(X,), xdot=r[0], residual=-2 * r[0] + 2 * rate * X.symbol),
    }  # fmt: skip
    model = models[kind]
    return model, (0.0,) * (len(model.x) + len(model.z))


FORMS = ["ode", "two", "dae", "dae, row negated", "algebraic variables swapped", "permuted",
         "algebraic row first", "negative mass"]  # fmt: skip


@pytest.mark.parametrize("kind", FORMS)
def test_step_too_long_for_an_unstable_mode_is_rejected_even_at_rest(kind: str) -> None:
    """An L-stable method would damp the mode away: the contact would never break away."""
    model, y = rest(100.0, kind)
    limit = 1 / (RODAS5P.gamma * 100.0)
    assert attempt(model, column(y, h=1.01 * limit))[REJECTED] == 1.0
    assert attempt(model, column(y, h=0.99 * limit))[REJECTED] == 0.0


@pytest.mark.parametrize("kind", [form for form in FORMS if form != "two"])
@pytest.mark.parametrize("h", [1e-3, 1.0, 5.0])
def test_stable_modes_of_any_speed_allow_any_step(kind: str, h: float) -> None:
    model, y = rest(-1e4, kind)
    assert attempt(model, column(y, h=h))[REJECTED] == 0.0


def test_absolute_tolerance_counts_where_a_state_is_small() -> None:
    problem = smooth_ode()
    system = assemble(problem.model)
    step = build_step(system, RODAS5P)
    S = column((1e-9, 1e-9), h=1.0)
    strict, lax = (
        step(S, Given.of(10.0, 1e-8, np.inf, [a, a], []))[0].full().ravel() for a in (1e-17, 1e-10)
    )
    assert (strict[REJECTED], lax[REJECTED]) == (1.0, 0.0)


def test_monitored_difference_is_resolved_on_its_own_scale() -> None:
    """x - 1 passes through zero while x itself is of order 1."""
    y = Variable("y", "1", start=1.0)
    rates = ca.vertcat(-3 * x.symbol + y.symbol**2, x.symbol - y.symbol - y.symbol**2)
    monitor = Monitor(x.symbol - 1, 1e-3)
    plain, watched = (Model("m", x=(x, y), ode=rates, monitors=m) for m in ((), (monitor,)))
    before = column((1.0, 1.0), h=0.03)
    assert attempt(plain, before)[REJECTED] == 0.0
    assert attempt(watched, before)[REJECTED] == 1.0


METHOD = METHODS["rodas5p"]


def of(model: Model) -> System:
    return system(model, input_data(model, None, 0.0, 1.0))


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The kinds in which attempts are built."""
    kinds: list[object] = []

    def counted(whole: System, method: Any, kind: Any = ca.SX) -> ca.Function:
        kinds.append(kind)
        return build_step(whole, method, kind)

    monkeypatch.setattr(module, "build_step", counted)
    return kinds


def test_a_small_one_is_written_out_and_a_large_one_never(built: list[object]) -> None:
    belt, links = of(rabinowicz(BrownMcPhee())), of(chain(4, BrownMcPhee()))
    step, count = written(belt, METHOD, 7000)
    assert (step.class_name(), count) == ("SXFunction", step.n_instructions())
    step, count = written(links, METHOD, 2000)
    assert step.class_name() == "MXFunction"
    assert built == [ca.SX, ca.MX]
    assert least(links, METHOD) < count == instructions(step)
    assert least(belt, METHODS["dopri5"]) == 0


def test_one_in_between_is_counted(built: list[object]) -> None:
    belt = of(rabinowicz(BrownMcPhee()))
    least_count, count = least(belt, METHOD), build_step(belt, METHOD).n_instructions()
    assert least_count < count - 1
    assert written(belt, METHOD, count - 1)[0].class_name() == "MXFunction"
    assert written(belt, METHOD, count)[0].class_name() == "SXFunction"
    assert built == [ca.SX, ca.MX, ca.SX]
