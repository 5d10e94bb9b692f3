"""Attempts of a step: acceptance, end time, NaN, controller, form.

What error control watches: no friction near rest is leapt over, whatever the estimate says.
"""

import json
from functools import cache
from math import copysign
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from closed_forms import ClosedForm, assemble, smooth_dae, smooth_ode, timed_ode
from printed_laws import PRINTED
from scipy.integrate import odeint

import symfric as sf
import symfric.integrator.methods.attempt as module
from symfric import BrownMcPhee, ExactCoulomb, LuGre, Model, Variable, Viscous, rabinowicz
from symfric.bench.multibody import chain
from symfric.foundation.numeric import Array
from symfric.integrator.equations.system import System
from symfric.integrator.methods.attempt import (
    GROW,
    SHRINK,
    RRow,
    SRow,
    build_fixed,
    build_step,
    instructions,
    least,
    obstacles,
    written,
)
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS, RODAS5P
from symfric.model import Monitor
from symfric.scenes import Pendulum

x, y, z = (Variable(name, "1", start=float(name != "z")) for name in "xyz")
X, Y, Z = x.symbol, y.symbol, z.symbol
T_AT, H, H_OLD, REJECTED, MEMORY = SRow.T, SRow.H, SRow.H_OLD, SRow.REJECTED, SRow.MEMORY
each_kind = pytest.mark.parametrize("kind", [ca.SX, ca.MX], ids=["flat", "blocks"])


def column(y: Any, t: float = 0.0, h: float = 0.1, rejected: float = 0.0) -> Array:
    """State of an attempt; the previous step was as long and met the tolerance just so."""
    return np.array([t, h, h, 1.0, rejected, *y])


def data(system: System, t_end: float = 10.0, rtol: float = 1e-6) -> Array:
    return RRow.of(t_end, rtol, np.inf, np.full(system.nx, 0.1 * rtol), [])


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
    "model", [rabinowicz(LuGre()), smooth_dae().model, timed_ode().model], ids=lambda m: m.name
)
def test_graph_of_blocks_computes_what_the_flat_expression_does(model: Model, method: str) -> None:
    """The former is compiled, the latter runs in the virtual machine."""
    if model.z and not ADAPTIVE[method].dae:
        pytest.skip("an explicit method")
    system = assemble(model)
    bristle = [1.0 if n != "z" or system.nx < 3 else 1e-4 for n in system.names]
    y = 0.05 * np.random.default_rng(0).random(system.n) * bristle
    for h in (1e-7, 1e-3, 0.3):
        given = column(y, h=h), data(system)
        flat, blocks = (step_of(model, kind, method)(*given) for kind in (ca.SX, ca.MX))
        for one, other in zip(flat, blocks, strict=True):
            # where a rejected attempt explodes, so do rounding errors
            assert other.full() == pytest.approx(one.full(), rel=1e-6, abs=1e-12)


def test_graph_of_blocks_is_smaller_for_a_large_system() -> None:
    states = tuple(Variable(f"x_{i}", "1", start=1.0) for i in range(12))
    every = ca.vertcat(*(v.symbol for v in states))
    ode = ca.vertcat(every[1:] - every[:-1], -every[-1]) - every
    system = assemble(Model("chain", x=states, ode=ode + ca.sin(every) * ca.sum1(every) / 12))
    flat, blocks = (build_step(system, RODAS5P, kind) for kind in (ca.SX, ca.MX))
    assert blocks.n_instructions() < flat.n_instructions() / 4


@pytest.mark.parametrize("case", [smooth_ode(), smooth_dae(), timed_ode()])
def test_accepted_attempt_is_the_bare_step(case: ClosedForm) -> None:
    h, y = 0.01, case.exact(0.0)
    S = attempt(case, column(y, h=h))
    bare = build_fixed(assemble(case.model), RODAS5P)(y, h, []).full().ravel()
    assert S[MEMORY:] == pytest.approx(bare, rel=1e-14)
    assert S[[T_AT, H_OLD, REJECTED]].tolist() == [h, h, 0.0]
    assert S[MEMORY:] == pytest.approx(case.exact(h), rel=1e-9)


def test_rejected_attempt_changes_nothing_but_the_step_size() -> None:
    before = column((1.0, 1.0), h=3.0)
    S = attempt(smooth_ode(), before, rtol=1e-9)
    assert S[[T_AT, *range(MEMORY, S.size)]].tolist() == [0.0, 1.0, 1.0]
    assert SHRINK * 3.0 <= S[H] < 3.0
    assert (S[H_OLD], S[REJECTED]) == (before[H_OLD], 1.0)


def test_what_is_rejected_first_is_hardly_above_the_tolerance() -> None:
    """A rejected step shrinks to 0.85 h err^(-1/5), which gives err: none above 1 is accepted."""
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


def test_growth_and_shrinkage_of_a_step_are_bounded_and_forbidden_after_a_rejection() -> None:
    grown = attempt(smooth_ode(), column((1.0, 1.0), h=1e-6))
    shrunk = attempt(smooth_ode(), column((1e3, 1e3), h=1e3), t_end=1e4)
    assert (grown[H], shrunk[H]) == pytest.approx((GROW * 1e-6, SHRINK * 1e3))
    for h in (1e-8, 1e-4, 1e-2):
        S = attempt(smooth_ode(), column((1.0, 1.0), h=h, rejected=1.0))
        assert (S[T_AT], S[REJECTED]) == (h, 0.0)
        assert S[H] <= h
        assert attempt(smooth_ode(), S)[H] > S[H]


def test_step_that_follows_a_better_one_is_the_more_careful() -> None:
    """Gustafsson: h_next = 0.85 h min(g, (h / h_old) g^2 / g_old), g = err^(-1/5)."""
    steady, rising = column((1.0, 1.0), h=0.03), column((1.0, 1.0), h=0.03)
    growth = attempt(smooth_ode(), steady, rtol=1e-7)[SRow.GROWTH_OLD]
    assert 1.0 < growth < 2.5
    steady[SRow.GROWTH_OLD], rising[SRow.GROWTH_OLD] = growth, 1.5 * growth
    ends = [attempt(smooth_ode(), before, rtol=1e-7)[H] for before in (steady, rising)]
    assert ends == pytest.approx([0.03 * 0.85 * growth, 0.03 * 0.85 * growth / 1.5], rel=1e-12)


def test_end_time_is_hit_exactly_and_the_size_of_the_step_kept() -> None:
    """Also where the sum of time and step would miss it; at the end nothing happens."""
    for t_end in (0.1, 1.0 / 3.0, 1e-9, 1e5 / 7.0):
        left = 1e-3 * min(t_end, 1.0)
        S = attempt(smooth_ode(), column((1.0, 1.0), t=t_end - left, h=3 * left), t_end=t_end)
        assert S[T_AT] == t_end
    ends, starts = np.random.default_rng(1).random((2, 4000)) * [[10.0], [1.0]]
    late = (starts + (ends - starts) != ends) & (ends > starts + 0.1)
    assert late.sum() > 10
    still = Model("still", x=(x,), ode=0 * X)
    for t, t_end in zip(starts[late][:10], ends[late][:10], strict=True):
        assert attempt(still, column((1.0,), t=t, h=100.0), t_end=t_end)[T_AT] == t_end
    S = attempt(smooth_ode(), column((1.0, 1.0), h=0.01), t_end=1e-6)
    assert S[T_AT] == 1e-6
    assert S[H] >= 0.01
    before = column((1.0, 2.0), t=5.0, h=0.01)
    assert attempt(smooth_ode(), before, t_end=5.0) == pytest.approx(before, abs=0.0)


OUTSIDE = 1.05 - X
"""x' = 1 leaves the domain of a function of it within the step."""


@each_kind
@pytest.mark.parametrize(
    ("model", "start"),
    [
        *(
            (Model("edge", x=(x, y), ode=ca.vertcat(1, 0.1 * rate)), (1.0, 0.0))
            for rate in (ca.sqrt(OUTSIDE), ca.log(OUTSIDE), 1 / ca.fmax(OUTSIDE, 0))
        ),
        # no state depends on the algebraic unknown, so that no error is estimated of it
        (Model("loose", x=(x,), z=(z,), ode=1 + 0 * X, alg=Z - ca.log(OUTSIDE)), (1.0, -2.99573)),
        (Model("singular", x=(x,), z=(z,), ode=-Z, alg=Z**2), (1.0, 0.0)),
    ],
    ids=["root", "logarithm", "division", "algebraic", "singular"],
)
def test_attempt_that_is_not_finite_is_rejected(
    model: Model, start: tuple[float, ...], kind: Any
) -> None:
    S = attempt(model, column(start, h=0.1), kind)
    assert S[REJECTED] == 1.0
    assert S[MEMORY:].tolist() == [*start]
    assert S[H] == pytest.approx(SHRINK * 0.1)


def rest(rate: float) -> dict[str, Model]:
    """x' = rate x in several forms, at rest in x = 0: no method sees an error there."""
    p, q, r = Variable("p", "1"), Variable("q", "1"), ca.SX.sym("r", 2)
    P, Q = p.symbol, q.symbol
    swapped = ca.vertcat(Q - X, P - rate * Q)
    permuted = ca.vertcat(Y + r[1], rate * X - r[0])
    algebraic_first = ca.vertcat(Z - rate * X, r[0] - Z)
    return {
        "ode": Model("rest", x=(x,), ode=rate * X),
        "dae": Model("rest", x=(x,), z=(z,), ode=-Z, alg=Z + rate * X),
        "dae, row negated": Model("rest", x=(x,), z=(z,), ode=-Z, alg=-Z - rate * X),
        "algebraic variables swapped": Model("rest", x=(x,), z=(p, q), ode=P, alg=swapped),
        "permuted": Model("rest", x=(x, y), xdot=r, residual=permuted),
        "algebraic row first": Model("rest", x=(x,), z=(z,), xdot=r[0], residual=algebraic_first),
        "negative mass": Model("rest", x=(x,), xdot=r[0], residual=-2 * r[0] + 2 * rate * X),
        "two": Model("rest", x=(x, y), ode=rate * ca.vertcat(Y, X)),
    }


@pytest.mark.parametrize("form", rest(1.0))
def test_step_is_too_long_only_for_unstable_modes_even_at_rest(form: str) -> None:
    """An L-stable method would damp the mode away: the contact would never break away."""
    unstable, stable = rest(100.0)[form], rest(-1e4)[form]
    still, limit = (0.0,) * (len(stable.x) + len(stable.z)), 1 / (RODAS5P.gamma * 100.0)
    for share, rejected in ((1.01, 1.0), (0.99, 0.0)):
        assert attempt(unstable, column(still, h=share * limit))[REJECTED] == rejected
    for h in (1e-3, 1.0, 5.0) if form != "two" else ():  # the modes of the pair are +-rate
        assert attempt(stable, column(still, h=h))[REJECTED] == 0.0


def test_absolute_tolerance_counts_where_a_state_is_small() -> None:
    step, S = step_of(smooth_ode().model, ca.SX, "rodas5p"), column((1e-9, 1e-9), h=1.0)
    strict, lax = (
        step(S, RRow.of(10.0, 1e-8, np.inf, [a, a], []))[0].full().ravel() for a in (1e-17, 1e-10)
    )
    assert (strict[REJECTED], lax[REJECTED]) == (1.0, 0.0)


def test_monitored_difference_is_resolved_on_its_own_scale() -> None:
    """x - 1 passes through zero while x itself is of order 1."""
    rates = ca.vertcat(-3 * X + Y**2, X - Y - Y**2)
    for monitors, rejected in (((), 0.0), ((Monitor(X - 1, 1e-3),), 1.0)):
        model = Model("m", x=(x, y), ode=rates, monitors=monitors)
        assert attempt(model, column((1.0, 1.0), h=0.03))[REJECTED] == rejected


def test_small_steps_are_written_out_large_ones_never_and_others_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kinds: list[object] = []

    def counted(whole: System, method: Any, kind: Any = ca.SX) -> ca.Function:
        kinds.append(kind)
        return build_step(whole, method, kind)

    monkeypatch.setattr(module, "build_step", counted)
    belt, links = assemble(rabinowicz(BrownMcPhee())), assemble(chain(4, BrownMcPhee()))
    step, count = written(belt, RODAS5P, 7000)
    assert (step.class_name(), count) == ("SXFunction", step.n_instructions())
    large, size = written(links, RODAS5P, 2000)
    assert large.class_name() == "MXFunction"
    assert least(links, RODAS5P) < size == instructions(large)
    assert least(belt, METHODS["dopri5"]) == 0
    assert least(belt, RODAS5P) < count - 1
    assert written(belt, RODAS5P, count - 1)[0].class_name() == "MXFunction"
    assert written(belt, RODAS5P, count)[0].class_name() == "SXFunction"
    assert kinds == [ca.SX, ca.MX, ca.SX, ca.MX, ca.SX]


def test_only_mechanisms_with_dry_friction_are_tested_for_missed_breakaway() -> None:
    for law, tested in ((BrownMcPhee(), True), (ExactCoulomb(), True), (Viscous(), False)):
        made = obstacles(assemble(Pendulum(law).model()), RODAS5P)
        assert (made is not None) is tested, law


CAPTURED = json.loads((Path(__file__).parents[3] / "golden" / "captured.json").read_text())
STARTS = np.array(CAPTURED["v"])
NAMES = ("stribeck", "tustin", "benson", "andersson", "simscape_breakaway", "bengisu_akay")
LAWS: dict[str, sf.Law] = {name: sf.ALL_LAWS[name](mu_s=0.3, mu_d=0.0) for name in NAMES}
LAWS["brown_mcphee"] = sf.BrownMcPhee(mu_s=0.3, mu_d=0.0, v_t=1e-4)


def law(case: str) -> sf.Law:
    name, *more = case.split()
    return sf.Sum((LAWS[name], sf.Viscous(sigma_2=0.02))) if more else LAWS[name]


def test_friction_peaks_without_a_coulomb_level_catch_the_block() -> None:
    """18 of 20 starts were off by more than 1 %, x = -1.04 for -0.78 m, with SUCCESS.

    Swinging without dissipation the block comes back to just where Simscape's smooth peak lets go:
    an error of 1e-7 m decides there, so that this case alone needs a tighter tolerance.
    """
    for case, x in CAPTURED["x"].items():
        rtol = 1e-7 if case == "simscape_breakaway" else 1e-6
        many = sf.simulate_many(
            sf.rabinowicz(law(case)), 20.0, x0={"v": STARTS[::4]}, rtol=rtol, backend="vm",
            executor="serial",
        )  # fmt: skip
        assert np.abs(many["x"][:, -1] - x[::4]).max() < 1e-4, case


def test_both_engines_catch_it() -> None:
    """x = -1.0404 m was found, at rtol 1e-9 -0.797; SciPy's LSODA with max_step 2e-4: -0.7783."""
    model = sf.rabinowicz(LAWS["stribeck"])
    runs = [sf.simulate(model, 20.0, x0={"v": -0.5}, backend=b) for b in ("vm", "compiled")]
    assert runs[0].final == runs[1].final
    assert runs[0].statistics.steps == runs[1].statistics.steps
    assert [r.final["x"] for r in runs] == pytest.approx([-0.77828] * 2, abs=1e-4)


def test_a_block_that_just_touches_the_velocity_of_the_belt_is_caught() -> None:
    """Its velocity turns 3 micrometres a second short of it, on a scale of one, within a step.

    Both ends of that step look harmless; x(6) was off by 0.39 m.
    """
    model = sf.rabinowicz(sf.Stribeck(mu_s=0.3, mu_d=0.0, v_s=1e-6, v_eps=1e-7))
    run = sf.simulate(model, 6.0, x0={"v": 3e-6 - 0.1}, backend="vm")
    fine = sf.simulate(model, 6.0, x0={"v": 3e-6 - 0.1}, rtol=1e-8, method="radau5", backend="vm")
    assert run.final["x"] == pytest.approx(fine.final["x"], abs=1e-7)


def test_a_scale_set_as_a_parameter_is_resolved_as_one_set_in_the_law() -> None:
    """The scale stayed where the model was built: an error of 8.9e-3 instead of 1.7e-7."""
    free = sf.rabinowicz(sf.Stribeck(v_s=1e-1, v_eps=1e-2), free=["v_s", "v_eps"])
    run = sf.simulate(free, 20.0, p={"v_s": 1e-3, "v_eps": 1e-4}, backend="vm")
    held = sf.simulate(sf.rabinowicz(sf.Stribeck(v_s=1e-3, v_eps=1e-4)), 20.0, backend="vm")
    assert run.statistics.steps == pytest.approx(held.statistics.steps, rel=0.02)
    assert run.final["x"] == pytest.approx(held.final["x"], abs=1e-6)


def test_a_scale_too_fine_for_the_clock_ends_no_run() -> None:
    """Rest is crossed in steps that the clock still tells apart."""
    law = sf.Coulomb(mu_d=0.0, v_eps=1e-300)
    for v in (0.5, 0.51, 0.3):
        assert sf.simulate(sf.rabinowicz(law), 20.0, x0={"v": v}, backend="vm").status.ok


@pytest.mark.slow
def test_references_are_those_of_scipy() -> None:
    """LSODA finds the peak because it is not allowed to take longer steps."""
    for case, expected in CAPTURED["x"].items():
        name, *viscous = case.split()
        sigma = 0.02 if viscous else 0.0

        def rates(y: Array, t: float, name=name, sigma=sigma) -> tuple[float, float]:
            slip = y[1] - 0.1
            friction = copysign(PRINTED[name](LAWS[name], abs(slip), 0.8 * 9.81), slip)
            return y[1], (-2.1 * y[0] - friction - sigma * slip) / 0.8

        for v, x in list(zip(STARTS, expected, strict=True))[::4]:
            found = odeint(
                rates, [0.0, v], [0.0, 20.0], rtol=1e-9, atol=1e-11, hmax=2e-4, mxstep=10**7
            )
            assert found[-1, 0] == pytest.approx(x, abs=1e-5), (case, v)
