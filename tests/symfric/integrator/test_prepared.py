"""Prepared simulations: the bits of `simulate`, and few calls."""

import pickle
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import bits, each_backend, needs_compiler

import symfric as sf
from symfric.integrator.running.engine import CompiledEngine
from symfric.scenes import Drive, PendulumBox, SliderCrank

HELD = {"force": sf.Hold([0.0, 0.3, 0.4], [0.0, 15.0, -15.0])}


def push(t: Any) -> Any:
    return 20 * ca.sin(5 * t)


PUSHED = {"force": push}
Case = tuple[Callable[[], sf.Model], dict[str, Any], list[dict[str, Any]]]
FREE = [{"p": {"mu_s": mu, "k": k}, "x0": {"v": v}} for mu, k, v in
        ((0.15, 2.1, 0.1), (1.5, 2.1e-3, -1e-3), (0.02, 2.1e3, 0.0))]  # fmt: skip
CASES: dict[str, Case] = {
    "parameters": (lambda: sf.rabinowicz(sf.LuGre(), free=["mu_s", "k"]), {"t_end": 2.0}, FREE),
    "shifted": (lambda: sf.rabinowicz(sf.BrownMcPhee()), {"t_start": 3.0, "t_end": 4.0}, [{}]),
    "tiny": (lambda: sf.rabinowicz(sf.BrownMcPhee()), {"t_end": 1e-6, "samples": 2}, [{}]),
    "loose": (lambda: sf.rabinowicz(sf.LuGre()), {"t_end": 1.0, "rtol": 1e-5, "atol": 1e-3}, [{}]),
    "events": (lambda: Drive(sf.ExactCoulomb()).model(), {"t_end": 2.0, "u": PUSHED},
               [{}, {"x0": {"v": 1.0}}, {"u": HELD}, {"u": {"force": 11.0}}]),
    "samples": (lambda: Drive(sf.LuGre()).model(), {"t_end": 1.0, "u": HELD, "times": [0.7]},
                [{}, {"u": {"force": sf.Linear([0.0, 1.0], [0.0, 30.0])}}]),
    "loop": (lambda: SliderCrank(sf.BrownMcPhee()).model(), {"t_end": 0.03}, [{}]),
    "reactions": (lambda: PendulumBox(sf.BrownMcPhee()).model(), {"t_end": 0.1, "max_step": 0.01},
                  [{}]),
}  # fmt: skip


@cache
def models(case: str) -> tuple[sf.Model, sf.Model]:
    """Two equal models."""
    return CASES[case][0](), CASES[case][0]()


@pytest.mark.parametrize(
    ("case", "backend"),
    [*((case, "vm") for case in CASES),
     *(pytest.param(case, "compiled", marks=needs_compiler) for case in ("events", "loop"))],
)  # fmt: skip
def test_a_call_gives_the_bits_of_simulate(case: str, backend: str) -> None:
    """So does a pickled object, and a second call, in any order."""
    (_, fixed, calls), (model, other) = CASES[case], models(case)
    fixed = dict[str, Any](samples=51, backend=backend) | fixed
    prepared, expected = sf.prepare(model, **fixed), list[list[bytes]]()
    unpickled = pickle.loads(pickle.dumps(prepared)) if "u" not in fixed else prepared
    for own in calls:
        inputs = fixed.get("u", {}) | own.get("u", {})
        every: dict[str, Any] = fixed | own | ({"u": inputs} if inputs else {})
        expected.append(bits(sf.simulate(other, **every)))
    for k in [*range(len(calls)), *reversed(range(len(calls)))]:
        assert bits(prepared(**calls[k])) == expected[k]
        assert bits(unpickled(**calls[k])) == expected[k]


@each_backend
def test_threads_share_a_prepared_simulation(backend: str) -> None:
    prepared = sf.prepare(sf.rabinowicz(sf.LuGre()), 5.0, samples=101, backend=backend)
    starts = [{"v": 0.1 * k} for k in range(-3, 3)]
    alone = [prepared(x0)["x"].tolist() for x0 in starts]
    with ThreadPoolExecutor(4) as pool:
        assert [run["x"].tolist() for run in pool.map(prepared, starts)] == alone


def test_results_and_settings_share_no_memory() -> None:
    times = np.linspace(0.0, 1.0, 5)
    prepared = sf.prepare(sf.rabinowicz(sf.LuGre()), 1.0, t_eval=times)
    first = prepared()
    first.t[:], times[:] = -1.0, -1.0
    with pytest.raises(ValueError, match="read-only"):
        prepared.t[:] = 0.0
    assert prepared().t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_stops_do_not_follow_the_array_of_the_caller() -> None:
    stops = np.array([0.2, 0.7])
    prepared = sf.prepare(Drive(sf.LuGre()).model(), 1.0, times=stops, backend="vm")
    first = bits(prepared(u={"force": 3.0}))
    stops[:] = 0.1, 0.15
    assert bits(prepared(u={"force": 3.0})) == first
    with pytest.raises(ValueError, match=r"prepare: times: expected increasing times in \[0, 1\]"):
        sf.prepare(prepared.model, 1.0, times=[0.3, 0.2])


def test_bad_values_and_failures_are_those_of_simulate() -> None:
    model = sf.rabinowicz(sf.LuGre(), free=["mu_s"])
    prepared = sf.prepare(model, 20.0, max_steps=50)
    bad: list[tuple[dict[str, Any], str]] = [
        ({"x0": {"w": 1.0}}, "x0.*got w"),
        ({"x0": {"v": np.nan}}, "rabinowicz.v: expected a (finite )?number"),
        ({"x0": {"v": "1"}}, "rabinowicz.v: expected a (finite )?number"),
        ({"p": {"mu_s": -1.0}}, "mu_s"),
        ({"u": {"force": 1.0}}, "no inputs"),
    ]
    for own, message in bad:
        with pytest.raises(ValueError, match=message):
            prepared(**own)
    with pytest.raises(sf.SolveError, match="number of steps") as caught:
        prepared()
    assert caught.value.partial.statistics.steps > 10


@needs_compiler
def test_a_call_on_a_known_model_makes_few_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """One call of compiled code for a run, two for a tiny motion, and few Python functions."""
    marches, march = list[str](), CompiledEngine.march

    def counted(*arguments: Any) -> Any:
        marches.append("")
        return march(*arguments)

    monkeypatch.setattr(CompiledEngine, "march", counted)
    model = sf.rabinowicz(sf.LuGre())
    for t_end, loops, most, most_prepared in ((20.0, 1, 70, 62), (1e-6, 2, 108, 100)):
        fixed: dict[str, Any] = {"samples": 401, "rtol": 1e-5, "backend": "compiled"}
        prepared = sf.prepare(model, t_end, **fixed)
        calls: dict[Callable[[], object], int] = {
            partial(sf.simulate, model, t_end, x0={"v": 0.1}, **fixed): most,
            partial(prepared, {"v": 0.1}): most_prepared,
        }
        for call, bound in calls.items():
            call()
            marches.clear()
            assert 0 < functions(call) <= bound
            assert len(marches) == loops


def functions(call: Callable[[], object]) -> int:
    """Number of Python functions that run during a call."""
    seen = 0

    def watch(_: object, event: str, __: object) -> None:
        nonlocal seen
        seen += event == "call"

    sys.setprofile(watch)
    try:
        call()
    finally:
        sys.setprofile(None)
    return seen
