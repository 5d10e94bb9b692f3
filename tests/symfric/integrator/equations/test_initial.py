"""Start values and first steps, as a simulation shows them.

Inputs: samples, expressions, numbers; a structure that is what the equations are; rates.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import each_backend
from closed_forms import assemble, smooth_dae

import symfric as sf
from symfric import Hold, Linear, Model, Variable, Viscous, drive, rate_of, simulate
from symfric.foundation.numeric import Array
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.blocks import following
from symfric.integrator.equations.initial import (
    consistent,
    consistent_many,
    first_guess,
    first_step,
    smallest_step,
)
from symfric.integrator.equations.inputs import Input, InputData, input_data
from symfric.scenes import SliderCrank

NONE = np.zeros(0)
x, z, t = Variable("x", "m", start=1.0), Variable("z", "1"), ca.SX.sym("t")
X, Z = x.symbol, z.symbol


def algebraic(equation: ca.SX, start: float = 0.0) -> Model:
    unknown = Variable("z", "1", start=start, symbol=Z)
    return Model("root", x=(x,), z=(unknown,), ode=-X, alg=equation + 0 * X)


def root(start: float, rhs: ca.SX) -> Model:
    """0 = z^2 - rhs, with two solutions or none."""
    return algebraic(Z**2 - rhs, start)


@pytest.mark.parametrize(("guess", "solution"), [(0.5, 2.0), (10.0, 2.0), (-0.1, -2.0)])
def test_start_value_of_an_algebraic_variable_chooses_the_branch(
    guess: float, solution: float
) -> None:
    run = sf.simulate(root(guess, 4 * X), 1.0, rtol=1e-8)
    assert run["z"][0] == pytest.approx(solution, rel=1e-12)
    assert run["z"] == pytest.approx(solution * np.exp(-run.t / 2), rel=1e-6)


def test_starts_that_are_inconsistent_or_undetermined_are_refused_by_name() -> None:
    message = r"model 'root': expected consistent start .* equations for z near"
    with pytest.raises(ValueError, match=message):
        sf.simulate(root(1.0, ca.SX(-1)), 1.0)
    with pytest.raises(ValueError, match="algebraic"):
        sf.simulate(algebraic(X - 1), 1.0)


def solution(equation: ca.SX, guess: float) -> float:
    return float(consistent(assemble(algebraic(equation)), "here", np.array([1.0, guess]), NONE)[1])


def test_solutions_depend_neither_on_units_nor_on_the_guess() -> None:
    for scale in (1e-9, 1.0, 1e9):
        s = Z / scale
        for weight in (1e-12, 1.0, 1e12):
            found = solution(weight * (s**3 + s - 10 * X), 30 * scale)
            assert found == pytest.approx(2 * scale, rel=1e-14)
    for guess in (0.0, 0.5, -3.0):
        assert solution(Z + Z**3, guess) == pytest.approx(0.0, abs=1e-12)
    y = Variable("y", "1", start=1.0)
    equations = ca.vertcat(y.symbol**2 + Z**2 - 4 * X, y.symbol - Z)
    circle = assemble(Model("circle", x=(x,), z=(y, z), ode=-X, alg=equations))
    found = consistent(circle, "here", np.array([1.0, 1.0, 0.5]), NONE)
    assert found == pytest.approx([1.0, np.sqrt(2), np.sqrt(2)], rel=1e-12)
    before = np.array([1.0, 1.0, 0.3])
    found = consistent(assemble(smooth_dae().model), "here", before, NONE)
    assert (before.tolist(), found) == ([1.0, 1.0, 0.3], pytest.approx([1.0, 1.0, 1.0]))


@pytest.mark.parametrize(
    ("equation", "starts", "guesses", "ends"),
    [
        # both branches, guesses that need damping, guesses without a solution
        (Z**2 - 4 * X, [1, 2, -1, 0.5, 1], [0.5, -1e-3, 1, 1e6, 0], [2, -(8**0.5), 0, 2**0.5, 0]),
        # full steps overshoot and end at -1, where damped ones find the near 0
        (Z**3 - Z, [1, 1, 1], [0.45, 0.46, 0.9], [0, 0, 1]),
        # a full step from 1.9 goes uphill, and on from there to 4 pi; damped, to pi
        (ca.sin(Z), [1, 1, 1], [1.9, 3.0, 0.3], [np.pi, np.pi, 0]),
    ],
    ids=["square", "cubic", "waves"],
)
def test_many_start_as_each_one_alone(
    equation: ca.SX, starts: list[float], guesses: list[float], ends: list[float]
) -> None:
    system, n = assemble(algebraic(equation)), len(starts)
    y, none = np.array([starts, guesses], float).T, np.zeros((n, 0))
    before = y.copy()
    found, failed = consistent_many(system, Columns(system.constraints), "here", y, none)
    np.testing.assert_array_equal(y, before)
    assert sorted(failed) == ([2, 4] if n == 5 else [])
    for m in range(n):
        if m in failed:
            with pytest.raises(ValueError, match=r"^here: expected consistent start values") as e:
                consistent(system, "here", y[m], none[m])
            assert failed[m] == str(e.value)
        else:
            assert found[m, 1] == pytest.approx(ends[m], rel=1e-12, abs=1e-12)
            alone = consistent(system, "here", y[m], none[m])
            assert found[m] == pytest.approx(alone, rel=1e-12, abs=1e-12)


def test_transients_and_spans_of_any_length_are_started_and_ended() -> None:
    """Fast parts that last 1 / rate; a start where the last digit of t is 0.1 us; 5 t^4 from 0."""
    for rate in (1e-3, 1.0, 1e3, 1e6, 1e9):
        model = Model("fast", x=(x,), ode=-rate * (X - 0.25))
        run = sf.simulate(model, 1.0, rtol=1e-8, t_eval=np.append(0.0, np.logspace(-12, 0, 60)))
        assert run["x"] == pytest.approx(0.25 + 0.75 * np.exp(-rate * run.t), abs=2e-8)
    for span, begin in ((1e-9, 0.0), (1.0, 0.0), (1e9, 0.0), (1.0, 1e9)):
        model = Model("slow", x=(x,), ode=-X / span)
        run = sf.simulate(model, begin + span, t_start=begin, rtol=1e-8)
        rounding = 2 * np.spacing(begin) / span  # of the time, which no method avoids
        assert run.final["x"] == pytest.approx(np.exp(-1), rel=1e-7 + rounding)
        assert run.statistics.steps < 60
    late = Model("late", x=(Variable("x", "m"),), ode=5 * t**4, t=t)
    run = sf.simulate(late, 2.0, rtol=1e-8)
    assert run["x"] == pytest.approx(run.t**5, abs=1e-6)


@pytest.mark.parametrize("law", [sf.BrownMcPhee(), sf.LuGre()])
def test_a_run_of_ages_does_not_begin_with_a_leap(law: sf.Law) -> None:
    """Over 1e20 s the first step took 1e12 s, to steady sliding that is unstable, with SUCCESS."""
    run = sf.simulate(sf.rabinowicz(law), 1e20, max_steps=1000, backend="vm", throw=False)
    assert run.status is sf.Status.MAX_STEPS
    begun = sf.simulate(sf.rabinowicz(law), 20.0, max_steps=1000, backend="vm")
    at = np.linspace(0.0, min(20.0, run.step_times[-1]), 50)
    assert run.at(at)["x"] == pytest.approx(begun.at(at)["x"], abs=1e-5)


@each_backend
def test_smallest_step_follows_time_instead_of_its_end(backend: str) -> None:
    """Robertson's reactions over 1e11 s: the floor stood at 1e-15 t_end = 1e-4 s.

    Published at the end: a = 2.083340149701255e-8 (Test Set for IVP Solvers).
    """
    a, b = Variable("a", "1", start=1.0, nominal=1e-8), Variable("b", "1", nominal=1e-13)
    c = Variable("c", "1")
    slow = -0.04 * a.symbol + 1e4 * b.symbol * c.symbol
    fast = 3e7 * b.symbol**2
    model = Model("long", x=(a, b, c), ode=ca.vertcat(slow, -slow - fast, fast))
    run = sf.simulate(model, 1e11, rtol=1e-8, backend=backend, samples=2)
    many = sf.simulate_many(
        model, 1e11, x0={"a": [1.0, 1.0]}, rtol=1e-8, backend=backend, executor="serial"
    )
    assert run.statistics.smallest_step < 1e-4
    assert run.final["a"] == pytest.approx(2.083340149701255e-8, rel=1e-6)
    assert many["a"][:, 0] == pytest.approx(2 * [run.final["a"]], rel=1e-12)


def test_a_quick_way_is_taken_where_it_leads_there() -> None:
    """The guess is put onto the constraints before; where it gives up, the search goes on."""
    model = SliderCrank(sf.BrownMcPhee()).model()
    system = assemble(model)
    follow = following(system)
    guess = first_guess(system, model, model.initial_state())
    searched, tried = consistent(system, "here", guess, NONE), list[bool]()

    def quick(y: Array, d: Array) -> Array | None:
        assert follow is not None
        defect = system.manifold.defect(y, d).full()  # type: ignore[union-attr]
        tried.append(bool(np.abs(defect).max() < 1e-9))
        return follow(y, d) if len(tried) < 2 else None

    for _ in range(2):
        found = consistent(system, "here", guess, NONE, quick)
        assert found == pytest.approx(searched, rel=1e-9, abs=1e-9 * np.abs(searched).max())
    assert tried == [True, True]


def test_first_steps_of_many_spans_have_the_bits_of_each() -> None:
    spans = np.array([1e-9, 0.1, 20.0, 999.0, 1000.1, 1e7])
    assert smallest_step(spans).tolist() == [smallest_step(span) for span in spans.tolist()]
    for t_start in (0.0, 3.0, -1e6):
        alone = [first_step(span, t_start) for span in spans.tolist()]
        assert first_step(spans, t_start).tolist() == alone


path = Variable("x", "m", start=0.0)
force, torque = Variable("force", "N", start=2.0), Variable("torque", "N m", start=-1.0)
TWO = Model("two", x=(path,), u=(force, torque), ode=force.symbol + torque.symbol)


def made(**given: Input) -> InputData:
    return input_data(TWO, given, 0.0, 4.0)


def values(of: InputData, *times: float) -> list[list[float]]:
    """The values of each input at these times."""
    function = ca.Function("u", [TWO.t, of.data], [of.expression])
    every = [function(t, of.values[:, of.interval(np.array([t]))[0]]).full()[:, 0] for t in times]
    return np.array(every).T.tolist()


def test_what_is_not_given_keeps_its_start_value_and_numbers_are_data() -> None:
    plain, other, flat = made(), made(force=5.0), made(force=Linear([0.0, 1.0], [3.0, 3.0]))
    assert values(plain, 1.0) == [[2.0], [-1.0]]
    assert values(other, 1.0) == [[5.0], [-1.0]]
    assert plain.key == other.key == flat.key
    assert not ca.depends_on(flat.expression, TWO.t)
    assert plain.breaks.tolist() == [0.0, 4.0]
    assert (
        input_data(Model("none", x=(path,), ode=path.symbol), None, 0.0, 1.0).expression.numel()
        == 0
    )


def test_samples_are_held_or_joined_and_hold_beyond() -> None:
    held = made(force=Hold([1.0, 2.5], [10.0, 20.0]))
    assert held.breaks.tolist() == [0.0, 1.0, 2.5, 4.0]
    assert values(held, 0.0, 0.9, 1.0, 2.4, 2.5, 4.0)[0] == [10.0] * 4 + [20.0] * 2
    bent = made(torque=Linear([1.0, 2.0, 3.0], [0.0, 4.0, 3.0]))
    found = values(bent, 0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)[1]
    assert found == pytest.approx([0.0, 0.0, 2.0, 4.0, 3.5, 3.0, 3.0], abs=1e-14)
    both = made(force=Hold([-1.0, 1.0, 9.0], [1.0, 2.0, 3.0]), torque=Linear([0.5, 1.0], [0, 1]))
    assert both.breaks.tolist() == [0.0, 0.5, 1.0, 4.0]
    assert np.array(values(both, 0.75, 1.0)) == pytest.approx(np.array([[1.0, 2.0], [0.5, 1.0]]))


def test_expressions_may_be_constant_numpy_and_feedback() -> None:
    assert values(made(force=lambda t: 7), 1.0)[0] == [7.0]
    assert values(made(force=lambda t: ca.if_else(t < 1, t, 5)), 0.25)[0] == [0.25]
    fed_back = simulate(TWO, 30.0, u={"force": lambda t: 1 - path.symbol}, rtol=1e-8)
    assert fed_back.final["x"] == pytest.approx(0.0, abs=1e-7)


def test_samples_are_copied_and_cannot_be_written() -> None:
    t, y = np.array([0.0, 1.0]), np.array([1.0, 2.0])
    kept = Linear(t, y)
    t[1], y[1] = np.nan, np.nan
    assert np.array([kept.t, kept.values]).tolist() == [[0.0, 1.0], [1.0, 2.0]]
    with pytest.raises(ValueError, match="read-only"):
        kept.values[0] = 5.0  # type: ignore[index]


@dataclass
class Wave:
    """Cannot be hashed."""

    a: float

    def __call__(self, t: ca.SX) -> ca.SX:
        return self.a * ca.sin(t)


class Source:
    K = 1.0

    def force(self, t: ca.SX) -> ca.SX:
        return self.K * ca.sin(t)


def test_structure_is_the_expression_and_changed_data_of_a_function_change_the_motion() -> None:
    """4f644ad took the function object for the structure, and returned the motion of old data."""
    one, same, other = (made(force=f).key for f in (
        lambda t: ca.sin(2 * t), lambda t: ca.sin(3 * t), lambda t: ca.cos(2 * t)
    ))  # fmt: skip
    assert one == same != other
    assert len({one, made().key, made(torque=lambda t: ca.sin(2 * t)).key}) == 3
    model, scale, wave, source = drive(Viscous()), [1.0], Wave(1.0), Source()

    def closure(t: ca.SX) -> ca.SX:
        return scale[0] * ca.sin(t)

    def ends() -> list[float]:
        signals: list[Callable[[ca.SX], Any]] = [closure, wave, source.force]
        runs = (simulate(model, 1.0, u={"force": f}, samples=2, backend="vm") for f in signals)
        return [run.final["x"] for run in runs]

    small = ends()
    assert small == [small[0]] * 3
    scale[0], wave.a, source.K = 100.0, 100.0, 100.0
    assert ends() == pytest.approx([100.0 * small[0]] * 3, rel=1e-4)
    assert len(model.memory["integrators"]) == 2


def test_rates_are_slopes_of_samples_and_derivatives_of_functions() -> None:
    """Their integral goes through the samples."""
    t, at = np.array([0.1, 0.15, 0.4, 0.41, 0.9]), np.array([1.0, -2.0, 0.5, 0.5, 3.0])
    v = Variable("v", "m/s")
    model, given = Model("integral", x=(path,), u=(v,), ode=v.symbol), {"v": rate_of(Linear(t, at))}
    run = simulate(model, 1.2, x0={"x": 1.0}, u=given, t_eval=[0.0, *t, 1.2], rtol=1e-9)
    assert run["x"] == pytest.approx([1.0, *at, 3.0], abs=1e-12)
    rate = rate_of(Linear([0.0, 1.0, 3.0], [[0.0, 1.0, 5.0], [1.0, 1.0, -1.0]]))
    assert isinstance(rate, Hold)
    assert np.asarray(rate.values).tolist() == [[0.0, 1.0, 2.0, 0.0], [0.0, 0.0, -1.0, 0.0]]
    assert [rate_of(4.0), rate_of(Linear([1.0], [2.0]))] == [0.0, 0.0]
    made, T = rate_of(lambda t: 3 * t**2), ca.SX.sym("t")
    assert float(ca.Function("rate", [T], [made(T)])(2.0)) == 12.0  # type: ignore[operator]
