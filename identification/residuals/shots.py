"""Simulations of windows of records, and their difference from the data.

Dead time of inputs: a model is driven by the input recorded a time tau earlier,

    u(t) = recorded(t - tau),     du/dtau = -recorded'(t - tau)

Between samples an input is linear, so its rate is constant there and jumps at the samples. With an
additional parameter theta = 0, the model is driven by u - theta u_rate: the derivative by theta
equals the derivative of the motion by tau, for any model.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.residuals.evaluation import Channel, Evaluation
from identification.residuals.open_loop import means, refined, stepped
from identification.residuals.stepper import Motion
from identification.unknowns.spec import Unknown
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.integrator import Hold, Input, Linear, Trajectory, simulate
from symfric.model import Model, Output

Array = NDArray[np.float64]
DEAD_TIME = "dead_time"
"""Name of the unknown and of the parameter of a delayed model."""
RATE = "_rate"
"""Suffix of an input's name for its rate."""


def delayed(model: Model, inputs: Sequence[str]) -> Model:
    """Return the model with a parameter `dead_time` (0) and the rates of `inputs` as inputs."""
    theta = Variable(DEAD_TIME, "s", nominal=1e-3, doc="0; derivatives by it are by the dead time")
    driven = [v for v in model.u if v.name in inputs]
    rates = [Variable(v.name + RATE, f"{v.unit}/s", nominal=v.nominal) for v in driven]
    old = stacked(v.symbol for v in driven)
    new = old - theta.symbol * stacked(v.symbol for v in rates)

    def put(expression: Any) -> ca.SX:
        return ca.substitute(ca.SX(expression), old, new)

    changes: dict[str, Any] = {
        "u": (*model.u, *rates),
        "p": (*model.p, theta),
        "outputs": {n: replace(o, expression=put(o.expression)) for n, o in model.outputs.items()},
        "monitors": tuple(replace(m, expression=put(m.expression)) for m in model.monitors),
        "events": tuple(
            replace(e, expression=put(e.expression), reset={n: put(v) for n, v in e.reset.items()})
            for e in model.events
        ),
    }
    if model.holonomic is not None:
        mechanics = model.holonomic
        parts = {n: put(getattr(mechanics, n)) for n in ("implicit", "rates", "pressing")}
        changes |= {"holonomic": replace(mechanics, **parts), "ode": None, "alg": ca.SX(0, 1)}
    elif model.ode is None:
        changes["residual"] = put(model.residual)
    else:
        changes |= {"ode": put(model.ode), "alg": put(model.alg)}
    return replace(model, **changes)


def rate(t: Array, values: Array) -> Hold:
    """Return the rate of linear samples, 0 before the first and after the last one."""
    begin = np.concatenate([[t[0] - (t[1] - t[0])], t])
    return Hold(begin, np.concatenate([[0.0], np.diff(values) / np.diff(t), [0.0]]))


def plain(model: Model, signals: Iterable[str] | None = None) -> Model:
    """Return the equations of `model` with the outputs in `signals` only; None keeps them all."""
    wanted = model.signals if signals is None else set(signals)
    outputs = {name: output for name, output in model.outputs.items() if name in wanted}
    return replace(
        model, outputs=outputs, contacts=(), opening=None, details=dict[str, Output], sketch=None
    )


METHOD = "radau5"
"""Method of `simulate` for derivatives; without them it would choose another one."""
LEAST_STEPS, STEPS = 20_000, 50
"""Largest number of simulation steps, in total and for each sample: with distant values a motion
may need a million.
"""
LISTED = 6
"""Largest number of values in a failure message."""


@final
@dataclass(frozen=True, eq=False)
class Drives:
    """Inputs of one record.

    Attributes:
        t: sample times from the origin of the shots [s], shape (n,).
        sampled: input -> samples, shape (n,).
        others: input -> input for `simulate`.
        held: samples are held until the next one; else linear between them.
    """

    t: Array
    sampled: Mapping[str, Array]
    others: Mapping[str, Input]
    held: bool

    def over(self, begin: float, end: float, tau: float, rates: bool) -> dict[str, Input]:
        """Return the inputs from `begin` to `end` [s], delayed by `tau` [s], and their `rates`."""
        first = max(0, int(np.searchsorted(self.t, begin - tau, "right")) - 2)
        last = min(self.t.size, int(np.searchsorted(self.t, end - tau)) + 2)
        if last - first < 2:  # a window before the first or after the last sample
            first, last = (0, 2) if last < 2 else (self.t.size - 2, self.t.size)
        late = self.t[first:last] + tau
        found = dict(self.others)
        for name, samples in self.sampled.items():
            part = samples[first:last]
            found[name] = Hold(late, part) if self.held else Linear(late, part)
            if rates:
                found[name + RATE] = rate(late, part)
        return found


@final
@dataclass(frozen=True, eq=False)
class Shot:
    """A simulation: a window of a record, or a whole one.

    Attributes:
        record: its name.
        origin: time of the record from which the others are counted [s].
        t: compared times [s], shape (m,); the simulation starts at the first.
        end: end of the simulation [s].
        measured: signal -> values at `t`.
        places: signal -> slice of its residuals among the rows.
        drives: inputs of the record.
        held: state -> known start value.
        free: state -> column of its start value among the values.
    """

    record: str
    origin: float
    t: Array
    end: float
    measured: Mapping[str, Array]
    places: Mapping[str, slice]
    drives: Drives
    held: Mapping[str, float]
    free: Mapping[str, int]


@final
@dataclass(frozen=True, eq=False)
class SampledRun:
    """A motion of one window at the compared times."""

    signals: Mapping[str, Array]
    sensitivities: Mapping[str, Mapping[str, Array]]

    def __getitem__(self, name: str) -> Array:
        return self.signals[name]


def sampled_run(
    model: Model, shot: Shot, x0: Mapping[str, float], p: Array, tau: float, substeps: int
) -> SampledRun | str:
    """Return the motion of one window from `x0`, with all its derivatives, or a failure message.

    Args:
        model: one mass; plain, possibly with a dead time.
        shot: the window.
        x0: known start values.
        p: values of `model.p`.
        tau: dead time of the inputs [s].
        substeps: steps per sample.
    """
    drives = shot.drives
    first, last = np.searchsorted(drives.t, [shot.t[0], shot.end])
    t = drives.t[first : last + 1]
    names = [v.name for v in model.x]
    known = dict(zip([v.name for v in model.p], p.tolist(), strict=True))
    start = x0 if len(x0) == 2 else dict(zip(names, model.initial_state(x0, known), strict=True))
    begin = np.array([start[name] for name in names], dtype=float)
    instants = refined(t, substeps)
    columns = [_mean(v.name, drives, instants - tau) for v in model.u]
    between = np.array(columns).reshape(len(columns), instants.size - 1).T
    motion = stepped(model, instants, between, p, begin)
    look = np.searchsorted(t, shot.t) * substeps
    return motion if isinstance(motion, str) else _run(model, motion, look)


def _mean(name: str, drives: Drives, at: Array) -> Array:
    if name in drives.sampled:
        return means(drives.t, drives.sampled[name], at, drives.held)
    if name in drives.others:
        return np.full(at.size - 1, float(drives.others[name]))  # type: ignore[arg-type]
    values = np.interp(at, drives.t, drives.sampled[name.removesuffix(RATE)])
    return np.diff(values) / np.diff(at)


def _run(model: Model, motion: Motion, look: NDArray[np.intp]) -> SampledRun:
    states = [v.name for v in model.x]
    unknowns = [*(v.name for v in model.p), *(f"x0.{name}" for name in states)]
    slopes = motion.slopes[look]
    return SampledRun(
        {name: motion.states[look, k] for k, name in enumerate(states)},
        {
            unknown: {name: slopes[:, k, i] for k, name in enumerate(states)}
            for i, unknown in enumerate(unknowns)
        },
    )


@final
@dataclass(frozen=True, eq=False)
class Shots:
    """Residuals of simulated motions; see `Residuals`.

    Attributes:
        model: plain equations, with a parameter for the dead time if it is estimated.
        parameters: free parameters of the user's model.
        own: start values and dead time.
        channels: groups of rows.
        shots: the simulations.
        dead_time: of the inputs [s]; None: it is the first of the own unknowns.
        rtol, backend: as `simulate` takes them.
        substeps: steps per sample of the sampled engine; 0: `simulate` runs.
        easier: the same data in short windows, for distant starts.
    """

    model: Model
    parameters: tuple[str, ...]
    own: tuple[Unknown, ...]
    channels: tuple[Channel, ...]
    shots: tuple[Shot, ...]
    dead_time: float | None
    rtol: float
    backend: str
    substeps: int = 0
    easier: "tuple[Shots, ...]" = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Free parameters of the model, then the own unknowns."""
        return (*self.parameters, *(u.name for u in self.own))

    @property
    def rows(self) -> int:
        """Number of residuals, of all channels."""
        return self.channels[-1].rows.stop

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals and derivatives, or a message if a motion cannot be simulated."""
        r, J = np.empty(self.rows), np.zeros((self.rows, len(self.names)))
        columns = {name: i for i, name in enumerate(self.parameters)}
        if self.dead_time is None:
            columns[DEAD_TIME] = len(self.parameters)
        for shot in self.shots:
            own = columns | {f"x0.{state}": i for state, i in shot.free.items()}
            try:
                run = self._run(shot, values, tuple(own))
                if isinstance(run, str):
                    return self._failed(shot, values, run)
                for s, y in shot.measured.items():
                    place = shot.places[s]
                    r[place] = run[s] - y
                    for name, column in own.items():
                        J[place, column] = run.sensitivities[name][s]
            except ValueError as error:  # no consistent start, or a motion without derivative
                return self._failed(shot, values, str(error))
        if not (np.isfinite(r).all() and np.isfinite(J).all()):
            return self._failed(None, values, "the motion or its derivatives are not finite")
        return Evaluation(r, J)

    def predicted(self, values: Array) -> Array | str:
        """Return the simulated values alone, shape (rows,)."""
        found = np.empty(self.rows)
        for shot in self.shots:
            try:
                run = self._run(shot, values, ())
            except ValueError as error:
                run = str(error)
            if isinstance(run, str):
                return self._failed(shot, values, run)
            for s, place in shot.places.items():
                found[place] = run[s]
        return found

    def _run(
        self, shot: Shot, values: Array, names: tuple[str, ...]
    ) -> Trajectory | SampledRun | str:
        """Return the motion of one window, or a failure message."""
        estimated = self.dead_time is None
        tau = float(values[len(self.parameters)]) if self.dead_time is None else self.dead_time
        begin = float(shot.t[0])
        x0 = {**shot.held, **{state: float(values[i]) for state, i in shot.free.items()}}
        if self.substeps:
            p = np.append(values[: len(self.parameters)], [0.0] * estimated)  # rate of a dead time
            return sampled_run(self.model, shot, x0, p, tau, self.substeps)
        run = simulate(
            self.model,
            shot.end,
            t_start=begin,
            x0=x0,
            u=shot.drives.over(begin, shot.end, tau, estimated),
            p={name: float(values[i]) for i, name in enumerate(self.parameters)},
            rtol=self.rtol,
            t_eval=shot.t,
            method=METHOD,
            backend=self.backend,
            max_steps=LEAST_STEPS + STEPS * shot.t.size,
            sensitivities=names,
            throw=False,
        )
        if not run.status.ok:
            return run.message
        if run.t.size < shot.t.size:
            return f"the motion ends at t = {run.span[1]:g} s; {run.message}"
        return run

    def _failed(self, shot: Shot | None, values: Array, why: str) -> str:
        shown = zip(self.parameters[:LISTED], values, strict=False)
        there = ", ".join(f"{name} = {x:.5g}" for name, x in shown)
        more = ", ..." if len(self.parameters) > LISTED else ""
        where = (
            "" if shot is None else f"'{shot.record}' from t = {shot.origin + shot.t[0]:.12g} s "
        )
        counted = "" if shot is None or not shot.origin else " (t from the start of the record)"
        return f"{where}with {there}{more}: {why}{counted}"
