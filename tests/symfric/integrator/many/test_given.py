"""Inputs and ends that each member of an ensemble has of its own."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from differentiable import oscillator, pendulum, switched

from symfric import Hold, Linear, Model, Variable, simulate, simulate_many
from symfric.integrator.many import chunk as chunk_module
from symfric.model import Event

each_engine = pytest.mark.parametrize("backend", ["vm", "compiled"])

OWN: dict[str, tuple[Callable[[], Model], Callable[[Any], Any]]] = {
    "numbers": (oscillator, lambda rows: rows[:, 0]),
    "held": (oscillator, lambda rows: Hold([0.0, 0.3, 0.7], rows)),
    "linear": (oscillator, lambda rows: Linear([0.0, 0.3, 0.7], rows)),
    "held, algebraic unknowns follow": (switched, lambda rows: Hold([0.0, 0.3, 0.7], rows)),
    "linear, algebraic unknowns follow": (switched, lambda rows: Linear([0.2, 0.3, 0.7], rows)),
    "linear, events": (lambda: kicked(), lambda rows: Linear([0.0, 0.3, 0.7], rows)),
}


def kicked() -> Model:
    """x' = u - x, that starts again from 1 at x = 3/2."""
    x, u = Variable("x", "m", start=1.0), Variable("u", "m/s", start=0.0)
    again = Event("again", x.symbol - 1.5, reset={"x": 1.0})
    return Model("kicked", x=(x,), u=(u,), ode=u.symbol - x.symbol, events=(again,))


@each_engine
@pytest.mark.parametrize("case", OWN)
def test_inputs_and_ends_of_their_own(case: str, backend: str) -> None:
    """Some rows do not rise, some members end at a jump, one after a thousandth of the others."""
    make, of = OWN[case]
    model, ends = make(), np.array([1.0, 0.3, 0.95, 0.001, 0.7])
    rows = np.array([[1, 1, 1], [2, -1, 3], [0, 0, 0], [1, 2, 3], [-1, 4, 0.5]], dtype=float)
    times = np.array([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0])  # the jumps among them
    many = simulate_many(
        model, ends, x0={"x": 1.25}, u={"u": of(rows)}, t_eval=times, backend=backend, chunk=3
    )
    assert not many.failed
    for m, end in enumerate(ends):
        own = of(rows[m : m + 1])
        u = type(own)(own.t, own.values[0]) if isinstance(own, Hold | Linear) else own[0]
        inside = times[times <= end]
        alone = simulate(model, end, x0={"x": 1.25}, u={"u": u}, t_eval=inside, backend=backend)
        for name in model.signals:
            found = many[name][m]
            assert found[: inside.size] == pytest.approx(alone[name], rel=1e-7, abs=1e-7)
            assert np.isnan(found[inside.size :]).all()
        assert many.attempts[m] == alone.statistics.steps + alone.statistics.rejections
        assert many.reached[m] == end


@each_engine
@pytest.mark.parametrize("make", [oscillator, kicked])
def test_every_member_is_looked_at_where_it_ends(make: Any, backend: str) -> None:
    ends = np.array([0.5, 0.001, 1.0])
    many = simulate_many(make(), ends, u={"u": 1.0}, backend=backend)
    assert many.t.tolist() == ends[:, None].tolist()
    assert many["x"].shape == (3, 1)
    for m, end in enumerate(ends):
        alone = simulate(make(), end, u={"u": 1.0}, samples=2, backend=backend)
        assert many["x"][m, 0] == pytest.approx(alone["x"][-1], rel=1e-9)
        assert many.reached[m] == end


@each_engine
def test_a_search_behind_a_jump_does_not_disturb_the_others(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """z^3 + z = u: where u leaps far the damped search has to find z, and the run goes on."""
    x, z = Variable("x", "m", start=0.0), Variable("z", "m/s", start=0.0)
    u = Variable("u", "m/s", start=0.0)
    model = Model(
        "cubic", x=(x,), z=(z,), u=(u,), ode=z.symbol,
        alg=z.symbol**3 + 0.01 * z.symbol - u.symbol,
    )  # fmt: skip
    rows = np.array([[0.01, 0.01, 0.01], [0.01, 8.0, 1.0], [1.0, 1.1, 1.0], [1.0, 8.0, 1e-3]])
    searched: list[int] = []
    real = chunk_module.consistent_many

    def counted(equations: Any, together: Any, where: str, y: Any, d: Any) -> Any:
        searched.append(y.shape[0])
        return real(equations, together, where, y, d)

    monkeypatch.setattr(chunk_module, "consistent_many", counted)
    many = simulate_many(
        model, 0.9, u={"u": Hold([0.0, 0.3, 0.6], rows)}, t_eval=[0.1, 0.3, 0.5, 0.6, 0.9],
        backend=backend, executor="serial",
    )  # fmt: skip
    assert not many.failed
    assert searched[0] == 4
    assert 1 <= sum(searched[1:]) <= 4
    level = rows[:, [0, 1, 1, 2, 2]]
    assert many["z"] ** 3 + 0.01 * many["z"] == pytest.approx(level, rel=1e-6)


def test_signals_of_members_are_for_ensembles() -> None:
    u = Linear([0.0, 1.0], [[0.0, 1.0], [1.0, 2.0]])
    with pytest.raises(
        ValueError, match=r"input 'u': expected samples of one signal, got samples of 2"
    ):
        simulate(oscillator(), 1.0, u={"u": u})


@each_engine
def test_mechanisms_start_together(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """a055f62 put every member together alone, in Python: 0.4 ms each, 20 times its run."""

    def alone(*arguments: Any) -> Any:
        pytest.fail(f"a member was put together alone: {arguments[2]}")

    monkeypatch.setattr(chunk_module, "consistent_many", alone)
    model, x0 = pendulum(), np.array([0.6, 0.7, 0.65])
    many = simulate_many(model, 0.5, x0={"x": x0}, t_eval=[0.0, 0.5], backend=backend)
    assert not many.failed
    for m, x in enumerate(x0):
        run = simulate(model, 0.5, x0={"x": x}, t_eval=[0.0, 0.5], backend=backend)
        for name in model.signals:
            assert many[name][m] == pytest.approx(run[name], rel=1e-7, abs=1e-9), name
        assert many.attempts[m] == run.statistics.steps + run.statistics.rejections
