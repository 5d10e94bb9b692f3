"""Magnitudes of laws, and motions of a contact or a block that are scaled by them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, inf, isfinite, sqrt
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from symfric.figures.data import Array, Curve, check_any, phenomena
from symfric.foundation import checks
from symfric.foundation.parameters import Variable, parameters
from symfric.integrator import Hold, Input, Linear, Trajectory, simulate
from symfric.laws import AnyLaw, Law, Population, law_name, steady_force
from symfric.model import Event, Model, Output
from symfric.scenes import Drive, contact

MASS = 0.8
"""Mass of a driven block [kg], the same as in `Rabinowicz`."""

NORMAL_FORCE = MASS * 9.81
"""Default normal force of the figures [N]."""


@final
@dataclass(frozen=True)
class Scales:
    """Magnitudes of a law at one normal force.

    Attributes:
        static: static level [N]: the peak of the force in steady sliding, or mu_s N if larger.
        kinetic: kinetic level [N]: the smallest force beyond the peak, up to 10 `velocity`.
        elastic: largest force without drift according to the law [N]: sigma_0 z_ba for a law with a
            break-away deflection z_ba, otherwise the kinetic level.
        stretch: pre-sliding distance [m], the static level over the stiffness at rest; inf for a
            law without pre-sliding.
        velocity: Stribeck velocity [m/s]. It is the first that exists of: the parameter v_s; the
            velocity at which half of the fall from the peak is complete; the `velocity_scale` of
            the law; 100 `stretch` per second.
    """

    static: float
    kinetic: float
    elastic: float
    stretch: float
    velocity: float

    @property
    def mass(self) -> float:
        """Mass of a pushed block [kg]: 0.8, or larger so that static / mass <= 1.5 m/s^2."""
        return max(MASS, self.static / 1.5)


def scales(law: AnyLaw, N: float = NORMAL_FORCE) -> Scales:
    """Return the magnitudes of `law` at the normal force `N` [N].

    Raises:
        ValueError: `law` is not a law, a parameter is a symbol, or N is not positive.
    """
    check_any("figure", law)
    checks.number("figure: N", N, unit="N", above=0.0)
    known = {p.name: checks.number(f"figure: {p.name}", p.value) for p in parameters(law).values()}
    stiffness = _stiffness(law, N) if "P" in phenomena(law) else 0.0
    velocity = known.get("v_s", float(law.velocity_scale))
    if not isfinite(velocity):
        top = float(steady_force(law, np.array([1e-3]), N)[0])
        velocity = 100 * top / stiffness if stiffness > 0 else 1e-3
    elif "v_s" not in known:
        velocity = _half_fall(law, velocity, N)
    F = steady_force(law, velocity * np.geomspace(1e-3, 10.0, 801), N)
    peak = _peak(F)
    kinetic = float(np.min(F[peak:]))
    static = max(float(F[peak]), known.get("mu_s", 0.0) * N)
    elastic = min(known.get("sigma_0", inf) * known.get("z_ba", inf), kinetic)
    stretch = static / stiffness if stiffness > 0 else inf
    return Scales(static, kinetic, elastic, stretch, velocity)


def _peak(F: Array) -> int:
    """Return the index after which `F` first decreases, or the last index."""
    falls = np.flatnonzero((np.diff(F) <= 0) & (F[:-1] > 0))
    return int(falls[0]) if falls.size else F.size - 1


def _half_fall(law: AnyLaw, scale: float, N: float) -> float:
    """Return the velocity [m/s] at which half of the fall is complete; `scale` without a fall."""
    v = scale * np.geomspace(1e-2, 1e3, 1001)
    F = steady_force(law, v, N)
    beyond = F[_peak(F) :]
    top, low = beyond[0], np.min(beyond)
    if top - low < 0.01 * top:
        return scale
    half = np.argmax(beyond <= (top + low) / 2)
    return float(v[_peak(F) + half])


def _stiffness(law: AnyLaw, N: float) -> float:
    """Return the stiffness dF/dx of the unloaded contact at rest [N/m]."""
    if isinstance(law, Population):
        return law.stiffness
    v, z = ca.SX.sym("v"), ca.SX.sym("z", len(law.states))
    slope = ca.jacobian(law.force(v, N, z), z) @ ca.jacobian(law.rate(v, N, z), v)
    return float(ca.Function("stiffness", [v, z], [slope])(0.0, law.steady_state(0.0, N)))


REST = 1e6
"""Time of rest [s] before a motion, after which all contacts are old."""


def slid(
    law: Population, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX], times: Array, pace: float
) -> dict[str, Array]:
    """Return columns t, x, v, F at `times` [s] for `velocity(t, pace)` after a rest of `REST`."""
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
    """Steps of a pushed block: the times of their ends [s], and the signals at these times."""

    step_times: Array
    columns: dict[str, Array]

    def at(self, t: ArrayLike) -> dict[str, Array]:
        """Return the signals at the times `t` [s], interpolated linearly between the steps."""
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
    """Return the motion of a block of `mass` [kg] on random contacts under `force` [N].

    The steps are explicit, with a length of 0.2 / omega, where omega is the angular frequency of
    the block on its unloaded contacts. The velocity is updated before the position, which conserves
    the energy of elastic contacts. See `pushed` for `until` and `way`.
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
    """Return the values of an input at the times `t` [s], shape (n,)."""
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
"""Units of the columns of a prescribed motion."""


def prescribed(law: Law, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX]) -> Model:
    """Return the model of a contact with the sliding velocity `velocity(t, pace)` [m/s].

    It starts in steady sliding at the initial velocity. `pace` is a parameter of the model, for
    motions at several speeds. The law may need the sliding acceleration dv.
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


Run = Steps | Trajectory
"""Run of a pushed block, with the attribute `step_times` and the method `at`."""
Slide = Callable[..., Curve]
"""Function (case, times [s], pace, jumps=()) -> curve; the velocity jumps at `jumps` [s]."""


def slides(law: AnyLaw, N: float, velocity: Callable[[ca.SX, ca.SX], ca.SX]) -> Slide:
    """Return a function that computes the curve of the motion `velocity(t, pace)` [m/s].

    A law starts in steady sliding at the initial velocity, a population with unloaded contacts.
    """
    if isinstance(law, Population):

        def of_contacts(case: str, times: Array, pace: float, jumps: Sequence[float] = ()) -> Curve:
            del jumps  # all steps are small
            return Curve(law_name(law), case, slid(law, N, velocity, times, pace))

        return of_contacts
    model = prescribed(law, N, velocity)

    def curve(case: str, times: Array, pace: float, jumps: Sequence[float] = ()) -> Curve:
        end = float(times[-1])
        at = [t for t in jumps if t < end]
        run = simulate(model, end, p={"pace": pace}, t_eval=times, times=at)
        columns = {"t": run.t, "x": run["travel"], "v": run["slip_velocity"], "F": run["friction"]}
        return Curve(law_name(law), case, columns)

    return curve


def through(points: Sequence[float], leg: float) -> Callable[[ca.SX, ca.SX], ca.SX]:
    """Return the velocity of a motion between `points` [m], each leg of which takes `leg`/pace [s].

    The velocity is zero at the points.
    """

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
    """Return the run of a block of `mass` [kg] from rest under `force` [N], up to `t_end` [s].

    With `until` the run ends when the velocity exceeds `until` [m/s] and the position exceeds `way`
    [m].
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
    """Return times [s] that divide each step of `run` into `parts` intervals."""
    inner = np.linspace(0.0, 1.0, parts, endpoint=False)
    starts, lengths = run.step_times[:-1], np.diff(run.step_times)
    return np.append((starts[:, None] + lengths[:, None] * inner).ravel(), run.step_times[-1])
