"""What tests of ensembles share: an executor that counts, an impatient user, a model that fails."""

import weakref
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import symfric.integrator.many.members as members
from symfric import Ensemble, Model, Variable
from symfric.integrator.many.vectors import lanes_header


class Inline(Executor):
    """Runs a task when it is submitted; counts tasks, and the results that are alive at once."""

    def __init__(self) -> None:
        self.tasks, self.alive, self.most = 0, 0, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.tasks += 1
        result = fn(*args, **kwargs)
        self.alive += 1
        self.most = max(self.most, self.alive)
        weakref.finalize(result, self._gone)
        future: Future[Any] = Future()
        future.set_result(result)
        return future

    def _gone(self) -> None:
        self.alive -= 1


def with_functions_of_libm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lanes whose functions are those of libm: a member has the bits of a run of its own then."""
    ones = ("exp", "expm1", "log", "tanh", "sin", "cos", "tan", "atan", "asin", "acos")
    text = "".join(
        f"static V of_libm_{f}(V x) {{ for (int l = 0; l < LANES; ++l) x[l] = {f}(x[l]);"
        f" return x; }}\n#define v_{f} of_libm_{f}\n"
        for f in ones
    ) + "".join(
        f"static V of_libm_{f}(V x, V y) {{ for (int l = 0; l < LANES; ++l)"
        f" x[l] = {f}(x[l], y[l]); return x; }}\n#define v_{f} of_libm_{f}\n"
        for f in ("pow", "atan2")
    )
    text += (
        "static V of_libm_sincos(V x, V *c) { *c = of_libm_cos(x); return of_libm_sin(x); }\n"
        "#define v_sincos of_libm_sincos\n"
    )
    monkeypatch.setattr(members, "lanes_header", lambda lanes=0: lanes_header(lanes) + text)


def assert_same(one: Ensemble, other: Ensemble) -> None:
    assert list(one.signals) == list(other.signals)
    for name in one.signals:
        np.testing.assert_array_equal(one[name], other[name])
    np.testing.assert_array_equal(one.attempts, other.attempts)
    np.testing.assert_array_equal(one.reached, other.reached)
    for name, extremes in one.extremes.items():
        np.testing.assert_array_equal(extremes, other.extremes[name])
    assert one.failed == other.failed


def explosive() -> Model:
    """x' = p x^2: x = 1/(1 - p t) from x = 1, infinite at t = 1/p."""
    x, p = Variable("x", "m", start=1.0), Variable("p", "1/(m s)", start=0.0)
    return Model("explosive", x=(x,), p=(p,), ode=p.symbol * x.symbol**2)


def after(chunks: int) -> Callable[[float], None]:
    """A user who presses Ctrl-C after some chunks."""
    reported: list[float] = []

    def progress(fraction: float) -> None:
        reported.append(fraction)
        if len(reported) == chunks:
            raise KeyboardInterrupt

    return progress


EXECUTORS: dict[str, Callable[[], Any]] = {
    "threads": lambda: "threads",
    "processes": lambda: "processes",
    "handed in": lambda: ThreadPoolExecutor(2),
    "of one's own": Inline,
}
