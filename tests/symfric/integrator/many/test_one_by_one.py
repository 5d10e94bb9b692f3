"""Members with events, one by one; see also test_ensemble.py."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from ensembles import EXECUTORS, assert_same

from symfric import ExactCoulomb, Karnopp, Law, Linear, Model, Variable, drive, simulate_many
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.many import chunk
from symfric.integrator.many.chunk import solve_one_by_one
from symfric.integrator.methods.tableaux import RODAS5P
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.run import Tolerances
from symfric.model import Event


def switch() -> Model:
    """x' = z with z^2 = x, that ends at x = 4: x = (1 + t/2)^2."""
    x, z = Variable("x", "m", start=1.0), Variable("z", "m/s", start=1.0)
    end = Event("end", x.symbol - 4.0, terminal=True)
    return Model("switch", x=(x,), z=(z,), ode=z.symbol, alg=z.symbol**2 - x.symbol, events=(end,))


def solve(starts: list[list[float]]) -> Any:
    model = switch()
    inputs = input_data(model, None, 0.0, 3.0)
    tolerances = Tolerances(1e-8, np.array([1e-9]), 1e-10, 10_000)
    integrator, times = Integrator(model, inputs, RODAS5P), np.array([1.0, 3.0])
    rows = (
        np.array(starts), np.zeros((len(starts), 0)), inputs.values[None], np.full(len(starts), 3.0)
    )  # fmt: skip
    return solve_one_by_one(integrator, inputs, tolerances, "vm", times, rows)


def test_signals_end_with_the_terminal_event() -> None:
    result = solve([[1.0, 1.0], [0.01, 1.0]])
    assert result.reached == pytest.approx([2.0, 3.0], rel=1e-8)
    assert result.signals[0, 0] == pytest.approx([2.25, 1.5], rel=1e-6)
    assert np.isnan(result.signals[0, 1]).all()
    assert result.signals[1, 1] == pytest.approx([1.6**2, 1.6], rel=1e-6)
    assert result.failed == {}


def test_member_without_a_consistent_start_is_passed_over() -> None:
    result = solve([[-1.0, 1.0], [1.0, 1.0]])
    assert list(result.failed) == [0]
    assert "found no solution of the algebraic equations for z" in result.failed[0]
    assert result.reached == pytest.approx([0.0, 2.0])
    assert result.attempts[0] == 0 < result.attempts[1]


def test_interrupt_goes_on_to_the_ensemble(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run keeps an interrupt for itself, and says so by its status."""
    real: Callable[..., Any] = chunk.integrate

    def pressed(*arguments: Any) -> Any:
        def interrupt(_: float) -> None:
            raise KeyboardInterrupt

        return real(*arguments[:-2], interrupt, arguments[-1])

    monkeypatch.setattr(chunk, "integrate", pressed)
    with pytest.raises(KeyboardInterrupt):
        solve([[0.01, 1.0]])


@pytest.mark.parametrize("backend", ["vm", "compiled"])
@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("law", [ExactCoulomb(), Karnopp()])
def test_every_executor_gives_the_same(law: Law, kind: str, backend: str) -> None:
    model, load = drive(law), Linear([0.0, 1.0, 2.0], np.outer([1.0, 2.0, 3.0], [0.0, 9.0, -9.0]))
    common: dict[str, Any] = {"u": {"force": load}, "t_eval": [1.0, 2.0], "backend": backend}
    serial = simulate_many(model, 2.0, executor="serial", chunk=2, **common)
    other = simulate_many(model, 2.0, executor=EXECUTORS[kind](), chunk=2, workers=2, **common)
    assert np.ptp(serial["v"]) > 0
    assert_same(serial, other)
