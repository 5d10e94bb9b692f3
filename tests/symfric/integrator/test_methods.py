"""Adaptive methods through `simulate`, `simulate_many` and derivatives."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from symfric import (
    BrownMcPhee,
    Law,
    LuGre,
    Model,
    Trajectory,
    Variable,
    rabinowicz,
    simulate,
    simulate_many,
)
from symfric.integrator.methods.families import Explicit, Rosenbrock
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS
from symfric.model import Event

each_method = pytest.mark.parametrize("method", ADAPTIVE)
TIMES = np.linspace(0.0, 12.0, 61)


def decay() -> Model:
    """x' = -k x^3 from 2: x = 2 / sqrt(1 + 8 k t)."""
    x, k = Variable("x", "m", start=2.0), Variable("k", "1/s", start=0.7)
    return Model("decay", x=(x,), p=(k,), ode=-k.symbol * x.symbol**3)


@cache
def exact(law: Law) -> tuple[Model, Trajectory]:
    model = rabinowicz(law)
    return model, simulate(model, 12.0, rtol=1e-11, t_eval=TIMES, method="rodas5p")


@each_method
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
def test_methods_agree_on_stick_slip_and_count_their_work(method: str, law: Law) -> None:
    model, reference = exact(law)
    run, tableau = simulate(model, 12.0, rtol=1e-7, t_eval=TIMES, method=method), METHODS[method]
    assert run["x"] == pytest.approx(reference["x"], abs=2e-6)
    s = run.statistics
    attempts, work = s.steps + s.rejections, (7, 1, 2)  # Radau: two Newton iterations
    if isinstance(tableau, Explicit | Rosenbrock):
        work = tableau.A.shape[0], *[int(isinstance(tableau, Rosenbrock))] * 2
    assert s.method == tableau.name
    assert (s.evaluations, s.jacobians, s.factorisations) == tuple(n * attempts for n in work)


@each_method
def test_tolerance_is_met_between_the_steps_too(method: str) -> None:
    t = np.linspace(0.0, 5.0, 400)
    for rtol in (1e-5, 1e-7, 1e-9):
        run = simulate(decay(), 5.0, rtol=rtol, t_eval=t, method=method)
        assert run["x"] == pytest.approx(2 / np.sqrt(1 + 5.6 * t), rel=10 * rtol)


@each_method
def test_derivatives_are_those_of_the_closed_form(method: str) -> None:
    """dx/dk = -x^3 t, dx/dx0 = x^3 / 8."""
    run = simulate(
        decay(), 5.0, rtol=1e-10, method=method, sensitivities=["k", "x0.x"],
        t_eval=np.linspace(0.0, 5.0, 31),
    )  # fmt: skip
    x, t = run["x"], run.t
    found = run.sensitivities
    assert found["k"]["x"] == pytest.approx(-(x**3) * t, abs=1e-7)
    assert found["x0.x"]["x"] == pytest.approx(x**3 / 8, abs=1e-7)


@each_method
def test_ensemble_members_are_single_runs(method: str) -> None:
    k, t = np.array([0.5, 0.7, 1.1]), np.linspace(0.0, 3.0, 7)
    found = simulate_many(decay(), 3.0, p={"k": k}, t_eval=t, method=method)
    alone = [simulate(decay(), 3.0, p={"k": v}, t_eval=t, method=method)["x"] for v in k]
    assert found["x"] == pytest.approx(np.vstack(alone), rel=1e-9)
    assert not found.failed


@each_method
def test_event_is_found_where_it_is(method: str) -> None:
    """4 / (1 + 5.6 t) = 1 at t = 3 / 5.6."""
    model = decay()
    model = replace(model, events=(Event("one", model.x[0].symbol - 1.0, terminal=True),))
    run = simulate(model, 5.0, rtol=1e-9, method=method)
    assert run.happened[-1][0] == pytest.approx(3 / 5.6, rel=1e-7)
    assert run.t[-1] <= run.happened[-1][0]


@each_method
def test_algebraic_unknowns_are_solved_or_refused(method: str) -> None:
    x, z = Variable("x", "1", start=1.0), Variable("z", "1")
    model = Model("dae", x=(x,), z=(z,), ode=-z.symbol, alg=z.symbol - 2 * x.symbol)
    if not METHODS[method].dae:
        with pytest.raises(ValueError, match="got the algebraic unknowns z; use an implicit"):
            simulate(model, 1.0, method=method)
        return
    run = simulate(model, 1.0, rtol=1e-9, method=method)
    assert run.final["z"] == pytest.approx(2 * np.exp(-2), rel=1e-7)
