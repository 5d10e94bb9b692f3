"""Bad problems, guesses, options and arguments: `refusals.toml` lists calls and messages."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from motions import double_integrator, stage
from phases import on, slider_crank, solve_once, there_and_back, unit_move
from receding import controller, positioning, rubbing
from refusing import not_refused

import ocp
import symfric
from ocp import FREE, TIME, Free, Phase, Problem, at_end, integral, rest_to_rest, solve
from ocp.solving.starts import initial_points, start_of
from ocp.transcription.schemes import make_meshes
from symfric import Event, ExactCoulomb, LuGre, Model, Variable, drive

MODEL = double_integrator()
EFFORT = integral(lambda s: s.a**2)
FREED = stage(free=["m", "mu_d"])


def implicit() -> Model:
    x, rate = Variable("x", "m"), ca.SX.sym("rate")
    return Model("implicit", x=(x,), xdot=rate, residual=rate + x.symbol)


def moved(**changes: Any) -> Problem:
    """Unit move in 1 s; changes of the phase or of the problem."""
    own = {name for name in changes if name in Phase.__dataclass_fields__}
    own -= {"bounds", "rates", "path", "cost", "p"}
    known: dict[str, Any] = {"model": MODEL, "T": 1.0, "end": {"x": 1.0, "v": 0.0}}
    phase = Phase(**(known | {name: changes[name] for name in own}))
    rest = {name: value for name, value in changes.items() if name not in own}
    return Problem(phase, **({"cost": EFFORT} | rest))


def chosen(box: Any, **scenarios: Any) -> Problem:
    return Problem(Phase(FREED, 1.0), at_end(lambda s: s.x), choose={"m": box}, scenarios=scenarios)


def scenarios(**values: dict[str, float]) -> Problem:
    return Problem(Phase(FREED, 1.0), at_end(lambda s: s.x), scenarios=values)


def two(
    second: Phase | None = None, first: Phase | None = None, cost: Any = EFFORT, **more: Any
) -> Problem:
    """Two phases, the first to x = 1."""
    return Problem(
        (first or Phase(MODEL, 1.0, end={"x": 1.0})) >> (second or Phase(MODEL, 1.0, **more)), cost
    )


def clash() -> Problem:
    x, x_rate, u = Variable("x", "m"), Variable("u_rate", "m/s"), Variable("u", "N")
    model = Model("clash", x=(x, x_rate), u=(u,), ode=ca.vertcat(x_rate.symbol, u.symbol))
    return Problem(Phase(model, 1.0), integral(lambda s: s.u**2), rates={"u": (-1, 1)})


def with_stop(stuck: bool) -> Problem:
    model = drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0) if stuck else MODEL
    stop = Event("stop", model.x[0].symbol - 1.0, terminal=True)
    more: dict[str, Any] = {"events": (*model.events, stop)}
    if stuck:
        opened = replace(model.open, events=(*model.open.events, stop))
        more["opening"] = lambda: opened
    return Problem(Phase(replace(model, **more), 1.0), TIME)


def by_modes(**options: Any) -> object:
    move = rest_to_rest(drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0), 1.0, 1.0, limit=20.0)
    return solve(move, **options)


OPEN, BACK = Phase(MODEL, Free(0.1, 3.0)), Phase(MODEL, 1.0, name="back")
BAD_END, STARTED = Phase(MODEL, 1.0, end={"y": 1.0}), Phase(drive(LuGre()), 1.0, start={"v": FREE})
OPENED = Phase(slider_crank(), 0.5, start={"crank": 1.0, "slider": 0.9})
DRY = drive(ExactCoulomb(mu_s=0.3, mu_d=0.2))


def short(**changes: Any) -> Phase:
    return Phase(**({"model": rubbing(), "T": 0.2} | changes))


def guessed(guess: Any) -> object:
    return start_of(on(unit_move(), 6), guess)


def estimated(data: Any, **more: Any) -> ocp.Estimate:
    given = {"step": 0.1, "horizon": 3, "noise": {"x": 1.0}} | more
    return ocp.estimate(MODEL, data, **given)


def run_of(t: list[float], **signals: list[float]) -> Any:
    return SimpleNamespace(t=t, signals=signals)


def test_bad_input_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    functions = (
        *(by_modes, chosen, clash, controller, estimated, guessed, implicit, initial_points),
        *(make_meshes, moved, on, positioning, replace, run_of, scenarios, short, solve_once),
        *(stage, there_and_back, two, unit_move, with_stop),
    )
    row, force = np.zeros(5), integral(lambda s: s.force**2)
    names = {function.__name__: function for function in functions} | {
        "BACK": BACK, "BAD_END": BAD_END, "DRY": DRY, "EFFORT": EFFORT, "FORCE": force,
        "MODEL": MODEL, "OPEN": OPEN, "OPENED": OPENED, "ROW": row, "SEEN": {"x": row, "a": row},
        "STARTED": STARTED, "math": math,
    }  # fmt: skip
    table = Path(__file__).with_name("refusals.toml")
    assert not_refused(table, symfric, ocp, **names) == []
    capfd.readouterr()  # texts of solvers


def test_all_problems_are_reported_at_once() -> None:
    with pytest.raises(ValueError) as error:
        moved(T=-1.0, cost=integral(lambda s: s.b), end={"y": 1.0}, bounds={"a": (1.0, 0.0)},
              path=[lambda s: 0 <= s.x <= 1])  # fmt: skip
    parts = ("problem 'double integrator': ", "T > 0", "got b", "got y", "bounds: expected a")
    for part in (*parts, "path condition 1"):
        assert str(error.value).count(part) == 1
    with pytest.raises(TypeError, match="unsupported operand"):
        _ = TIME + 1
