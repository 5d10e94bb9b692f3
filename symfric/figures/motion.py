"""Contact that is slid with a given velocity, and one that is pushed with a given force."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, sqrt
from typing import Protocol, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.figures.data import Array, Curve
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.integrator import Hold, Linear, simulate
from symfric.integrator.equations.inputs import Input
from symfric.laws import AnyLaw, Law, Population, law_name
from symfric.model import Event, Model, Output
from symfric.scenes.base import contact
from symfric.scenes.blocks import Drive

REST = 1e6
"""Time of rest before a motion [s], so that all contacts are old."""


def slid(
    law: Population, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX], times: Array, pace: float
) -> dict[str, Array]:
    """Columns t, x, v, F at `times` [s] of rested contacts slid with `velocity(t, pace)`."""
    t, p = ca.SX.sym("t"), ca.SX.sym("pace")
    function = ca.Function("v", [t, p], [velocity(t, p)])
    end = float(times[-1])
    coarse = np.linspace(0.0, end, 2001)
    fastest = np.abs(function(coarse, pace).full()).max()
    grid = np.linspace(0.0, end, max(2001, ceil(2 * fastest * end / law.step)))
    middle = (grid[1:] + grid[:-1]) / 2
    way = function(middle, pace).full().ravel() * np.diff(grid)
    x = np.concatenate([[0.0], np.cumsum(way)])
    return {
        "t": times,
        "x": np.interp(times, grid, x),
        "v": function(times, pace).full().ravel(),
        "F": np.interp(times, grid, law.force([-REST, *grid], [0.0, *x], N)[1:]),
    }


@final
@dataclass(frozen=True, eq=False)
class Steps:
    """Steps of a pushed block: their ends [s], and at each the signals."""

    step_times: Array
    columns: dict[str, Array]

    def at(self, t: ArrayLike) -> dict[str, Array]:
        """Return the signals at the times `t` [s], linear between the steps."""
        times = np.atleast_1d(np.asarray(t, float))
        return {n: np.interp(times, self.step_times, column) for n, column in self.columns.items()}


def shoved(
    law: Population,
    N: float,
    mass: float,
    force: Input,
    t_end: float,
    until: float | None,
    way: float = 0.0,
) -> Steps:
    """Return a block of `mass` [kg] on random contacts pushed with `force` [N], by explicit steps.

    A step is a fifth of the inverse frequency of the block on its unloaded contacts: velocity
    first, then position, which holds the energy of an elastic contact.
    """
    h = 0.2 * sqrt(mass / law.stiffness)
    t = np.arange(0.0, t_end + h, h)
    load = sampled(force, t)
    contacts, held = law.advance(law.begin(), 0.0, REST, N)
    x = v = 0.0
    rows = np.zeros((t.size, 3))
    for i in range(t.size):
        rows[i] = x, v, held
        if until is not None and v > until and x >= way:
            t, rows, load = t[: i + 1], rows[: i + 1], load[: i + 1]
            break
        v += h / mass * (load[i] - held)
        x += h * v
        contacts, held = law.advance(contacts, h * v, h, N)
    columns = {"x": rows[:, 0], "v": rows[:, 1], "friction": rows[:, 2], "force": load}
    return Steps(t, columns)


def sampled(value: Input, t: Array) -> Array:
    """Return an input at the times `t` [s], shape (n,)."""
    if isinstance(value, Hold):
        known = np.searchsorted(np.asarray(value.t), t, "right") - 1
        return np.asarray(value.values, float)[np.clip(known, 0, None)]
    if isinstance(value, Linear):
        return np.interp(t, np.asarray(value.t), np.asarray(value.values))
    if callable(value):
        symbol = ca.SX.sym("t")
        return ca.Function("u", [symbol], [ca.SX(value(symbol))])(t[None, :]).full().ravel()
    return np.full(t.shape, checks.number("figure: force", value))


UNITS = {"t": "s", "x": "m", "v": "m/s", "F": "N"}
"""Columns of a prescribed motion."""


def prescribed(law: Law, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX]) -> Model:
    """Return `law` slid with `velocity(t, pace)` [m/s] from steady sliding at its first value.

    `pace` is a parameter of the model, so that one model serves several speeds. The law may need
    the sliding acceleration dv.
    """
    travel = Variable("travel", "m", nominal=1e-5)
    pace, t = Variable("pace", "1", start=1.0), ca.SX.sym("t")
    v = velocity(t, pace.symbol)
    slip = contact("slide", law, v, N, rest={}, dv=ca.jacobian(v, t))
    begin = float(ca.DM(ca.substitute(ca.SX(v), ca.vertcat(t, pace.symbol), ca.DM([0.0, 1.0]))))
    first = law.steady_state(begin, N)
    states = tuple(replace(s, start=float(first[i])) for i, s in enumerate(slip.states))
    return Model(
        "prescribed_motion",
        x=(travel, *states),
        p=(pace,),
        ode=ca.vertcat(v, slip.rate),
        events=slip.events(),
        outputs={"slip_velocity": Output(v, "m/s"), "friction": Output(slip.friction, "N")},
        t=t,
    )


class Run(Protocol):
    """Run of a pushed block."""

    @property
    def step_times(self) -> Array:
        """Ends of its steps [s]."""
        ...

    def at(self, t: ArrayLike, /) -> Mapping[str, Array]:
        """Its signals at the times `t` [s]."""
        ...


class Slide(Protocol):
    """Function that makes the curve of a motion; the velocity jumps at the times `jumps` [s]."""

    def __call__(
        self, case: str, times: Array, pace: float, /, jumps: Sequence[float] = ()
    ) -> Curve:
        """Return the curve of `case` at `times` [s]."""
        ...


def slides(law: AnyLaw, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX]) -> Slide:
    """Return the motion `velocity(t, pace)` [m/s] as a function (case, times [s], pace) -> curve.

    A law starts from steady sliding at the first velocity, a population from unloaded contacts.
    """
    if isinstance(law, Population):

        def of_population(
            case: str, times: Array, pace: float, /, jumps: Sequence[float] = ()
        ) -> Curve:
            return Curve(law_name(law), case, slid(law, N, velocity, times, pace))

        return of_population
    model = prescribed(law, N, velocity)

    def moved(case: str, times: Array, pace: float, /, jumps: Sequence[float] = ()) -> Curve:
        return slide(model, law, case, times, pace, jumps)

    return moved


def slide(
    model: Model, law: Law, case: str, times: Array, pace: float, jumps: Sequence[float] = ()
) -> Curve:
    """One run of a `prescribed` motion, seen at `times` [s]."""
    end = float(times[-1])
    run = simulate(model, end, p={"pace": pace}, t_eval=times, times=[t for t in jumps if t < end])
    columns = {"t": run.t, "x": run["travel"], "v": run["slip_velocity"], "F": run["friction"]}
    return Curve(law_name(law), case, columns)


def through(points: Sequence[float], leg: float) -> Callable[[ca.SX, ca.SX], ca.SX]:
    """Velocity of a motion through `points` [m], at rest in each, `leg` / pace [s] between them."""

    def velocity(t: ca.SX, pace: ca.SX) -> ca.SX:
        phase = pace * t / leg
        v = ca.SX(0)
        for i, (a, b) in enumerate(pairwise(points)):
            swing = (b - a) * pace * ca.pi / (2 * leg) * ca.sin(ca.pi * (phase - i))
            v = ca.if_else(ca.logic_and(phase >= i, phase < i + 1), swing, v)
        return v

    return velocity


def pushed(
    law: AnyLaw,
    N: float,
    mass: float,
    force: Input,
    t_end: float,
    until: float | None = None,
    way: float = 0.0,
) -> Run:
    """Return a block of `mass` [kg] under `law`, at rest at first, pushed with `force` [N] to
    `t_end` [s].

    With `until` the run ends where the velocity is beyond it [m/s], and the position beyond `way`.
    """
    if isinstance(law, Population):
        return shoved(law, N, mass, force, t_end, until, way)
    model = Drive(law, m=mass, N=N).model()
    if until is not None:
        x, v = (model.expression(name) for name in ("x", "v"))
        beyond = v - until if way == 0.0 else ca.fmin(v / until, x / way) - 1
        over = Event("broken_away", beyond, direction=1, terminal=True)
        model = replace(model, events=(*model.events, over))
    return simulate(model, t_end, u={"force": force})


def fine(run: Run, parts: int = 4) -> Array:
    """Return the ends of the steps of `run` with `parts` intervals in each [s]."""
    inner = np.linspace(0.0, 1.0, parts, endpoint=False)
    starts, lengths = run.step_times[:-1], np.diff(run.step_times)
    return np.append((starts[:, None] + lengths[:, None] * inner).ravel(), run.step_times[-1])
