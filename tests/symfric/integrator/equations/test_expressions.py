"""Expressions rewritten for steps: tanh, numbers as data; pulses of functions of time."""

from collections.abc import Callable
from math import pi, sqrt

import casadi as ca
import numpy as np
import pytest

import symfric as sf
from symfric.foundation.numeric import Array
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled import compiler
from symfric.integrator.equations import expressions
from symfric.integrator.equations.expressions import (
    DEPTH,
    LARGE,
    MIDDLE,
    branchless,
    changes,
    divided_once,
    levels,
    pieces,
    tanh,
)
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.equations.system import system
from symfric.integrator.methods.attempt import build_fixed, build_step
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.laws import Karnopp

Signal = Callable[[ca.SX], ca.SX]
t, X = ca.SX.sym("t"), ca.SX.sym("x")
x, force = sf.Variable("x", "m"), sf.Variable("force", "N")
AT = 5.1234


def of(values: Array) -> Array:
    return ca.Function("tanh", [X], [tanh(X)]).map(values.size)(values[None]).full().ravel()


def test_tanh_is_that_of_long_double_everywhere() -> None:
    rng = np.random.default_rng(0)
    near = MIDDLE + np.linspace(-1e-9, 1e-9, 2001)
    at = np.concatenate([rng.uniform(0, 2, 20000), 10 ** rng.uniform(-310, 3, 20000), near])
    assert np.abs(of(at) / np.tanh(at.astype(np.longdouble)) - 1).max() < 3.5e-16
    assert np.array_equal(of(-at), -of(at))
    assert (np.diff(of(np.sort(near))) >= -2e-16).all()
    tiny = 5e-324
    odd = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e308, -1e308, 400.0, 355.0, tiny, -tiny])
    expected = np.array([0, 0, 1, -1, np.nan, 1, -1, 1, 1, tiny, -tiny])
    np.testing.assert_array_equal(of(odd), expected)
    slope = ca.Function("slope", [X], [ca.jacobian(tanh(X), X)])
    for v in (0.0, 0.3, -0.3, 0.699, 0.701, -0.701, 3.0, 30.0):
        assert float(slope(v)) == pytest.approx(1 - np.tanh(v) ** 2, rel=1e-12, abs=1e-15)


def operations(function: ca.Function) -> list[int]:
    return [function.instruction_id(k) for k in range(function.n_instructions())]


def test_steps_have_no_tanh_and_what_is_differentiated_or_large_keeps_it() -> None:
    model = sf.rabinowicz(sf.BrownMcPhee())
    whole = system(model, input_data(model, None, 0.0, 1.0))
    for method in ("rodas5p", "radau5", "dopri5"):
        assert ca.OP_TANH in operations(build_fixed(whole, METHODS[method]))
        assert ca.OP_TANH not in operations(build_step(whole, METHODS[method]))
    long = X
    for _ in range(LARGE):
        long = ca.sin(long)
    for kept in (ca.Function("f", [X], [ca.exp(X)]), ca.Function("f", [X], [ca.tanh(long)])):
        assert branchless(kept) is kept


def test_divisors_that_are_constant_or_repeated_are_inverted_once() -> None:
    plain = ca.vertcat(t / X, (t + 1) / X, t / 3, t / (X + 1))
    before, after = (ca.Function("f", [t, X], [f]) for f in (plain, divided_once(plain)))
    assert [operations(f).count(ca.OP_DIV) for f in (before, after)] == [4, 2]
    assert after(0.7, 1.3).full() == pytest.approx(before(0.7, 1.3).full(), rel=1e-15)


def test_amplitudes_are_one_integrator_and_one_call_of_the_compiler(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    builds, compilations = list[str](), list[str]()
    build, begin = Integrator.__post_init__, compiler.Cache.begin
    monkeypatch.setenv("SYMFRIC_CACHE", str(tmp_path))
    monkeypatch.setattr(
        Integrator, "__post_init__", lambda self: builds.append(self.model.name) or build(self)
    )
    monkeypatch.setattr(
        compiler.Cache, "begin", lambda self, key: compilations.append(key) or begin(self, key)
    )
    backend, model, ends = (
        "vm" if find_compiler() is None else "compiled",
        sf.drive(sf.Viscous()),
        set(),
    )
    for k in range(6):
        late, w = 0.02 * (5.0 + k), 5.0 + k
        given = {"force": lambda t, w=w, late=late: ca.if_else(t > late, w * ca.sin(w * t), 0)}
        ends.add(sf.simulate(model, 0.5, u=given, samples=2, backend=backend).final["x"])
        assert 0.8 * late < input_data(model, given, 0.0, 0.5).breaks[1] <= late  # for each anew
    assert (len(ends), len(builds), len(compilations)) == (6, 1, int(backend == "compiled"))
    model = sf.drive(sf.LuGre())
    for a, w in ((5, 7), (12, 3)):
        signal = {"force": lambda t, a=a, w=w: a * ca.sin(w * t)}
        again = sf.simulate(model, 1.0, u=signal, backend="vm")
    fresh = sf.simulate(
        sf.drive(sf.LuGre()), 1.0, u={"force": lambda t: 12 * ca.sin(3 * t)}, backend="vm"
    )
    np.testing.assert_array_equal(again["x"], fresh["x"])
    assert again["force"] == pytest.approx(12 * np.sin(3 * again.t), abs=1e-12)


def pulse(width: float) -> Signal:
    """A pulse of impulse one at `AT`."""
    return lambda t: ca.exp(-(((t - AT) / width) ** 2)) / (width * sqrt(pi))


def found(function: Signal) -> expressions.Pieces:
    return pieces(ca.SX.serialize(ca.SX(function(t))), 0.0, 10.0)


def test_functions_of_one_pace_need_no_step_to_end() -> None:
    steady: list[Signal] = [
        lambda t: ca.SX(3.0), lambda t: 2 - 3 * t, lambda t: 2 * ca.sin(pi * t),
        lambda t: ca.sin(300 * t), lambda t: ca.sin(2 * t) + 0.02 * ca.sin(200 * t),
        lambda t: t**3, lambda t: t / 0.0,
    ]  # fmt: skip
    assert [found(function).onsets for function in steady] == [()] * len(steady)
    for period in (0.1, 1.0, 7.0):
        pace = found(lambda t, T=period: 3 * ca.sin(2 * pi * t / T)).pace
        assert period / 110 < pace < period / 40
    assert found(lambda t: ca.SX(2.0)).pace == found(lambda t: 2 * t - 1).pace == np.inf
    jump = found(lambda t: ca.if_else(t > 3.3, 1.0, 0.0))
    assert jump.pace > 0.05  # a jump is an onset, hardly a pace
    gap = np.diff(jump.onsets)[np.searchsorted(jump.onsets, 3.3) - 1]
    assert gap <= 16 * 10.0 / 2**DEPTH


def test_pieces_are_halved_and_changes_counted_from_the_last_one() -> None:
    assert levels(np.array([0.0, 1.0, 2.0, 3.0, 4.0])).tolist() == [0] * 4
    assert levels(np.array([0.0, 0.0, 0.0, 1.0, 0.0])).tolist() == [1, 1, 2, 2]
    assert changes(np.array([1, 2, 3, 4, 5, 7, 7, 4, 1])).tolist() == [3, 5, 7, 8]


def test_no_pulse_is_leapt_over() -> None:
    """A block on a table got none of the impulse and stayed where it was, with SUCCESS."""
    model = sf.drive(sf.BrownMcPhee(mu_s=0.0, mu_d=0.0), m=1.0)
    for width in (1.0, 0.1, 0.01, 0.001):
        times = np.array(found(pulse(width)).onsets)
        nearest = AT - times[times < AT].max(), times[times > AT].min() - AT
        assert max(nearest) < 50 * width + 20 * 10.0 / 2**DEPTH
        assert times.size < 12
        run = sf.simulate(model, 10.0, u={"force": pulse(width)}, backend="vm")
        assert run.final["v"] == pytest.approx(1.0, rel=1e-5)
    many = sf.simulate_many(model, 10.0, u={"force": pulse(width)}, backend="vm", executor="serial")
    assert many["v"][0, -1] == run.final["v"]


def test_pulses_next_to_feedback_are_seen_and_shorter_ones_where_they_are_named() -> None:
    model = sf.Model("integrator", x=(x,), u=(force,), ode=force.symbol)
    feedback = {"force": lambda t: pulse(0.01)(t) - 1e-3 * x.symbol}
    run = sf.simulate(model, 10.0, u=feedback, backend="vm")
    assert run.final["x"] == pytest.approx(np.exp(-1e-3 * (10 - AT)), rel=1e-5)
    how = {"u": {"force": pulse(1e-6)}, "backend": "vm"}
    missed, hit = sf.simulate(model, 10.0, **how), sf.simulate(model, 10.0, times=[AT], **how)
    assert missed.final["x"] == 0.0
    assert hit.final["x"] == pytest.approx(1.0, rel=1e-5)
    assert AT in hit.step_times
    at, width = sf.Variable("at", "s", start=2.0), sf.Variable("width", "s", start=0.01)
    own = ca.exp(-(((t - at.symbol) / width.symbol) ** 2)) / (width.symbol * sqrt(pi))
    model = sf.Model("pulsed", x=(x,), p=(at, width), ode=own, t=t)
    assert sf.simulate(model, 10.0, backend="vm").final["x"] == pytest.approx(1.0, rel=1e-5)


def test_load_that_is_too_strong_for_a_moment_in_every_period_ends_rest() -> None:
    """By 4 %, for a tenth of the time: at rest steps grew over it, at the tighter tolerance."""
    law, A, w = Karnopp(form="event", mu_d=0.025), 0.0831, 0.74
    model = sf.drive(law, m=8.8, N=0.5327)
    for rtol in (1e-6, 1e-11):
        run = sf.simulate(model, 27.0, u={"force": lambda t: A * ca.sin(w * t)}, rtol=rtol)
        slips = np.array([t for t, name in run.happened if name == "slip"])
        first = np.arcsin(0.15 * 0.5327 / A) / w
        assert slips == pytest.approx(first + pi / w * np.arange(6), abs=1e-6)


@pytest.mark.filterwarnings("ignore:simulate. rtol")
@pytest.mark.parametrize("method", ["auto", "radau5", "rodas5p", "dopri5"])
def test_a_ramp_of_any_width_in_the_equations_is_solved_or_refused(method: str) -> None:
    """The rate of a ramp of a nanosecond was leapt over, with SUCCESS.

    Radau's stages lay on both sides of a ramp under a car at rest: it never moved.
    """
    y, solved = sf.Variable("y", "m"), list[float]()
    for width in (0.226, *np.logspace(-14, -1, 27)[::4]):
        ramp = ca.fmin(ca.fmax((t - 0.5) / width, 0.0), 1.0)
        rate = ramp + ca.jtimes(ramp, t, ca.SX(1)) - y.symbol / 10
        model = sf.Model("bump", x=(y,), ode=rate, t=t)
        # y during the ramp: 10 (1/w - 1) e(w) + 10 s / w, with e(s) = 1 - exp(-s/10)
        peak = (10 / width - 100 / width) * -np.expm1(-width / 10) + 10
        after = np.exp(-(3.0 - width) / 10)
        expected = pytest.approx(peak * after + 10 * (1 - after), abs=1e-2)
        try:
            run = sf.simulate(model, 3.5, method=method, rtol=1e-4, backend="vm")
        except sf.SolveError as error:
            assert error.status is sf.Status.STEP_TOO_SMALL
            continue
        assert run.final["y"] == expected, width
        solved.append(width)
        if width == 0.226:
            start = {"y": [0.0, 0.0]}
            many = sf.simulate_many(model, 3.5, p={}, x0=start, rtol=1e-5, backend="vm")
            assert many["y"][0, -1] == many["y"][1, -1] == expected
    assert len(solved) >= 5
    assert 0.226 in solved


def test_pulses_within_jumps_are_found_and_jumps_are_not() -> None:
    def ramp(t: ca.SX) -> ca.SX:
        return ca.fmin(ca.fmax((t - AT) / 1e-9, 0.0), 1.0)

    both = found(lambda t: ramp(t) + ca.jtimes(ramp(t), t, ca.SX(1)))
    assert np.abs(np.array(both.onsets) - AT - 5e-10).min() < 1e-12
    assert np.abs(np.array(found(ramp).onsets) - AT).min() > 1e-6
