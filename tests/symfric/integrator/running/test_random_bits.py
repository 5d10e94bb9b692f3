"""Random runs: both engines, whatever limits they come back at, give the same bits."""

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from numpy.typing import NDArray

import symfric.integrator.running.engine as loop
import symfric.integrator.running.run as running
from symfric import (
    BrownMcPhee,
    Event,
    ExactCoulomb,
    Hold,
    Linear,
    LuGre,
    Model,
    Trajectory,
    Variable,
    drive,
    simulate,
)

Array = NDArray[np.float64]
CASES = 150


def cubic(*events: Event) -> Model:
    """z + z^3 = x + u."""
    alg = Z.symbol + Z.symbol**3 - X.symbol - U.symbol
    ode = ca.sin(3 * X.symbol) - Z.symbol + 0.5 * U.symbol
    return Model("cubic", x=(X,), z=(Z,), u=(U,), ode=ode, alg=alg, events=events)


X, Z, U = Variable("v", "1", start=0.3), Variable("z", "1"), Variable("force", "1")
HIT = Event("hit", X.symbol - 0.5, 1, reset={"v": -X.symbol})
MODELS = [
    *(drive(law) for law in (BrownMcPhee(), LuGre(), ExactCoulomb())),
    cubic(),
    cubic(HIT, Event("low", X.symbol + 1, -1)),
]


def numbers(run: Trajectory) -> Iterator[bytes]:
    """Every bit of a run."""
    counts = run.statistics.steps, run.statistics.rejections, run.statistics.smallest_step
    yield f"{run.message} {run.happened} {counts}".encode()
    between = run.at(np.linspace(*run.span, 23))
    for values in (run.t, run.step_times, *(run[n] for n in run.units), *between.values()):
        yield values.tobytes()


def drawn(rng: np.random.Generator) -> tuple[float, dict[str, Any]]:
    """End time [s] and arguments of a run."""
    t_end, count = rng.uniform(0.2, 3.0), int(rng.integers(2, 40))
    at, values = np.sort(rng.uniform(-0.1, 1.1 * t_end, count)), rng.uniform(-25.0, 25.0, count)
    size = rng.uniform(5.0, 20.0)
    inputs = [Hold(at, values), Linear(at, values), size, lambda t: size * ca.sin(7 * t)]
    inner = at[(at >= 0) & (at <= t_end)]
    further: dict[str, Any] = {
        "max_steps": int(rng.integers(1, 200)),
        "times": np.sort(rng.uniform(0.0, t_end, 3)),
        "max_step": rng.uniform(1e-3, 0.1),
        "method": "radau5",
    }
    return t_end, {
        "u": {"force": inputs[rng.integers(4)]},
        "t_eval": np.unique([*rng.uniform(0.0, t_end, 9), *inner[:2], *[t_end][: rng.integers(2)]]),
        "rtol": 10.0 ** rng.uniform(-8, -5),
        "x0": {"v": rng.choice([0.0, 0.3, -0.2])},
        **{name: value for name, value in further.items() if rng.random() < 0.3},
    }


@pytest.mark.slow
@needs_compiler
def test_random_runs_have_the_same_bits_by_both_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """However many attempts, rows and bytes they may take before somebody looks."""
    rng = np.random.default_rng(10)
    for case in range(CASES):
        model, (t_end, arguments) = MODELS[case % len(MODELS)], drawn(rng)
        found: list[list[bytes]] = []
        for backend, most in (("vm", 2**26), ("compiled", int(rng.choice([500, 2**26])))):
            attempts = dict.fromkeys(("vm", "compiled"), int(rng.choice([5, 100, 50_000])))
            monkeypatch.setattr(running, "ATTEMPTS", attempts)
            monkeypatch.setattr(running, "MOST_BYTES", most)
            monkeypatch.setattr(loop, "MOST_ROWS", int(rng.choice([64, 2048])))
            run = simulate(model, t_end, backend=backend, throw=False, **arguments)
            found.append(list(numbers(run)))
        assert found[0] == found[1], (case, arguments)
