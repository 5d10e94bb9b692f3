"""Inputs: samples, expressions, numbers; a structure that is what the equations are; rates."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest

from symfric import Hold, Linear, Model, Variable, Viscous, drive, rate_of, simulate
from symfric.integrator.equations.inputs import Input, InputData, input_data

x = Variable("x", "m", start=0.0)
force, torque = Variable("force", "N", start=2.0), Variable("torque", "N m", start=-1.0)
TWO = Model("two", x=(x,), u=(force, torque), ode=force.symbol + torque.symbol)


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
    assert input_data(Model("none", x=(x,), ode=x.symbol), None, 0.0, 1.0).expression.numel() == 0


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
    fed_back = simulate(TWO, 30.0, u={"force": lambda t: 1 - x.symbol}, rtol=1e-8)
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
    model, given = Model("integral", x=(x,), u=(v,), ode=v.symbol), {"v": rate_of(Linear(t, at))}
    run = simulate(model, 1.2, x0={"x": 1.0}, u=given, t_eval=[0.0, *t, 1.2], rtol=1e-9)
    assert run["x"] == pytest.approx([1.0, *at, 3.0], abs=1e-12)
    rate = rate_of(Linear([0.0, 1.0, 3.0], [[0.0, 1.0, 5.0], [1.0, 1.0, -1.0]]))
    assert isinstance(rate, Hold)
    assert np.asarray(rate.values).tolist() == [[0.0, 1.0, 2.0, 0.0], [0.0, 0.0, -1.0, 0.0]]
    assert [rate_of(4.0), rate_of(Linear([1.0], [2.0]))] == [0.0, 0.0]
    made, T = rate_of(lambda t: 3 * t**2), ca.SX.sym("t")
    assert float(ca.Function("rate", [T], [made(T)])(2.0)) == 12.0  # type: ignore[operator]
