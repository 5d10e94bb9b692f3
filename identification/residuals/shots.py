"""Simulations of windows of records, and their residuals.

The sampled engine (`stepper`) steps one mass under friction without states. It is about a hundred
times faster than error control, with exact sensitivities, and as accurate as the samples of the
inputs permit. All other models are simulated.

With a dead time tau, a model is driven by the input recorded a time tau earlier,

    u(t) = recorded(t - tau),     du/dtau = -recorded'(t - tau)

Between samples an input is linear; its rate is therefore constant there and jumps at the samples.
With an additional parameter theta = 0, the model is driven by u - theta u_rate. For any model, the
derivative of the motion by theta then equals that by tau.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, cast, final

import casadi as ca
import numpy as np

from identification.residuals.evaluation import DEAD_TIME, Array, Blocks, Evaluation
from identification.residuals.stepper import Chain, Mass, SteppedMotion, given_inputs, why_no_motion
from symfric.foundation import checks
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.integrator import Hold, Input, Linear, simulate
from symfric.model import Model, Output

RATE = "_rate"
"""Suffix that turns the name of an input into the name of its rate."""


def delayed(model: Model, inputs: Sequence[str]) -> Model:
    """Return the model with a parameter `dead_time` (0) and the rates of `inputs` as inputs."""
    theta = Variable(DEAD_TIME, "s", nominal=1e-3, doc="0; derivatives by it are by the dead time")
    driven = [v for v in model.u if v.name in inputs]
    rates = [Variable(v.name + RATE, f"{v.unit}/s", nominal=v.nominal) for v in driven]
    old = stacked(v.symbol for v in driven)
    new = old - theta.symbol * stacked(v.symbol for v in rates)

    def put(expression: Any) -> ca.SX:
        return ca.substitute(ca.SX(expression), old, new)

    def within(part: Any, *names: str) -> Any:
        return replace(part, **{n: put(getattr(part, n)) for n in names})

    changes: dict[str, Any] = {
        "u": (*model.u, *rates),
        "p": (*model.p, theta),
        "outputs": {n: within(o, "expression") for n, o in model.outputs.items()},
        "monitors": tuple(within(m, "expression") for m in model.monitors),
        "events": tuple(
            replace(within(e, "expression"), reset={n: put(v) for n, v in e.reset.items()})
            for e in model.events
        ),
    }
    if model.holonomic is not None:
        mechanics = within(model.holonomic, "implicit", "rates", "pressing")
        changes |= {"holonomic": mechanics, "ode": None, "alg": ca.SX(0, 1)}
    elif model.ode is None:
        changes["residual"] = put(model.residual)
    else:
        changes |= {"ode": put(model.ode), "alg": put(model.alg)}
    return replace(model, **changes)


def plain(model: Model, signals: Iterable[str]) -> Model:
    """Return the equations of `model` with only the outputs in `signals`."""
    outputs = {name: output for name, output in model.outputs.items() if name in signals}
    return replace(
        model, outputs=outputs, contacts=(), opening=None, details=dict[str, Output], sketch=None
    )


HOLDS = ("linear", "held")
"""Inputs between two samples: linear, where steps use their mean, or held from the first sample."""

KEY = "identification.sampled"
"""Key of the chain in the memory of a model."""


def sampled_motion(
    model: Model, t: Array, inputs: Array, p: Array, start: Array,
    *, hold: Literal["linear", "held"] = "linear", substeps: int = 2,
) -> SteppedMotion | str:  # fmt: skip
    """Return the motion at the instants `t` with its derivatives, or a message if there is none.

    Args:
        model: model with two states x' = v and v' = a(x, v, u, p), such as a `Drive` with a static
            law (see `why_not_sampled`); all parameters in `model.p` are free.
        t: instants [s], shape (n,); not necessarily equidistant.
        inputs: inputs of the model at these instants, shape (n, inputs) or (n,).
        p: values of `model.p`.
        start: position and velocity at t[0].
        hold: inputs between samples: "linear", or "held" as by a digital amplifier.
        substeps: equal steps per sample, each with the mean of the input over the step.

    Returns:
        A `SteppedMotion`: states (n, 2) and slopes (n, 2, parameters + 2), the last two by the
        start.

    Raises:
        ValueError: the model is unsuitable, or an array has the wrong size.
    """
    checks.choice("sampled_motion: hold", hold, HOLDS)
    u = np.asarray(inputs, dtype=float).reshape(t.size, -1)
    sizes = u.shape[1], np.size(p), np.size(start)
    if sizes != (_chain(model).inputs, len(model.p), 2):
        such = f"{_chain(model).inputs} inputs, {len(model.p)} parameters and a start of 2"
        got = "{}, {} and {}".format(*sizes)
        raise ValueError(f"sampled_motion of '{model.name}': expected {such}, got {got}")
    instants = refined(t, substeps)
    between = [means(t, column, instants, hold == "held") for column in u.T]
    motion = stepped(model, instants, between, np.asarray(p, float), np.asarray(start, float))
    return motion if isinstance(motion, str) else motion.every(substeps)


def refined(t: Array, substeps: int) -> Array:
    """Return the instants `t` with `substeps` equal steps between consecutive instants."""
    shares = np.arange(substeps) / substeps
    return np.append((t[:-1, None] + np.diff(t)[:, None] * shares).ravel(), t[-1])


def stepped(
    model: Model, t: Array, between: list[Array], p: Array, start: Array
) -> SteppedMotion | str:
    """Return the motion for the mean of each input from each instant to the next, (n - 1,)."""
    rows = np.column_stack([np.diff(t), *between])
    start_slopes = np.hstack([np.zeros((2, p.size)), np.eye(2)])
    motion = _chain(model)(rows, p, start, start_slopes)
    return why_no_motion(motion) or motion


def means(t: Array, samples: Array, at: Array, held: bool) -> Array:
    """Return the mean of a sampled input from each of the instants `at` to the next one.

    Args:
        t: sample times [s], shape (n,).
        samples: samples, shape (n,); constant before the first and after the last one.
        at: instants [s], shape (k,).
        held: True if samples are held until the next one; False if linear between them.
    """
    k = np.clip(np.searchsorted(t, at, "right") - 1, 0, t.size - 2)
    dt = np.diff(t)
    rise = np.zeros_like(dt) if held else np.diff(samples) / dt
    whole = np.concatenate([[0.0], np.cumsum(dt * (samples[:-1] + rise * dt / 2))])
    s = np.clip(at, t[0], t[-1]) - t[k]
    outside = np.minimum(at - t[0], 0) * samples[0] + np.maximum(at - t[-1], 0) * samples[-1]
    integral = whole[k] + s * (samples[k] + rise[k] * s / 2) + outside
    return np.diff(integral) / np.diff(at)


def _chain(model: Model) -> Chain:
    """Return the chain of a model, which is built only once."""
    if KEY not in model.memory:
        mass = Mass(model)
        count = len(mass.inputs)
        model.memory[KEY] = Chain.of(mass, given_inputs(count), row=count, substeps=1)
    return cast(Chain, model.memory[KEY])


METHOD = "radau5"
"""Method of `simulate` with derivatives, also used without them for equal results."""
LEAST_STEPS, STEPS = 20_000, 50
"""Largest number of simulation steps: a constant, and an addition for each sample. At distant
values a motion may need a million steps.
"""
LISTED = 6
"""Largest number of values shown in a failure message."""


class Drives(NamedTuple):
    """Inputs of one record.

    Attributes:
        t: sample times relative to the origin of the shots [s], shape (n,).
        sampled: input -> samples, shape (n,).
        others: input -> input of `simulate`.
        held: True if samples are held until the next one; False if linear between them.
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
            if rates:  # 0 before the first and after the last sample
                since = np.concatenate([[late[0] - (late[1] - late[0])], late])
                slopes = np.concatenate([[0.0], np.diff(part) / np.diff(late), [0.0]])
                found[name + RATE] = Hold(since, slopes)
        return found

    def mean(self, name: str, at: Array) -> Array:
        """Return the mean of an input, or of its rate, from each of the instants `at` to the next.

        The dead time is already subtracted from the instants.
        """
        if name in self.sampled:
            return means(self.t, self.sampled[name], at, self.held)
        if name in self.others:
            return np.full(at.size - 1, float(self.others[name]))  # type: ignore[arg-type]
        values = np.interp(at, self.t, self.sampled[name.removesuffix(RATE)])
        return np.diff(values) / np.diff(at)


class Shot(NamedTuple):
    """Simulation of a window of a record or of a whole record.

    Attributes:
        record: name of the record.
        origin: time in the record at which all other times are zero [s].
        t: compared times [s], shape (m,); the simulation starts at the first one.
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


Run = tuple[Mapping[str, Array], Mapping[str, Mapping[str, Array]]]
"""Signals of a motion, and value -> signal -> derivatives."""


@final
@dataclass(frozen=True, eq=False)
class Shots(Blocks):
    """Residuals of simulated motions.

    Attributes:
        model: plain equations, with a parameter for the dead time if it is estimated.
        shots: the simulations.
        dead_time: dead time of the inputs [s]; None: it is the first of the own unknowns.
        rtol, backend: arguments of `simulate`.
        substeps: steps per sample of the sampled engine; 0: `simulate` is used.
        easier: residuals of the same data in short windows, for distant starts.
    """

    model: Model
    shots: tuple[Shot, ...]
    dead_time: float | None
    rtol: float
    backend: str
    substeps: int = 0
    easier: "tuple[Shots, ...]" = ()

    @property
    def rows(self) -> int:
        """Number of residuals of all channels."""
        return self.channels[-1].rows.stop

    def at(self, values: Array) -> Evaluation | str:
        """Return residuals and derivatives, or a message if a motion cannot be simulated."""
        r, J = np.empty(self.rows), np.zeros((self.rows, len(self.names)))
        columns = {name: i for i, name in enumerate(self.parameters)}
        if self.dead_time is None:
            columns[DEAD_TIME] = len(self.parameters)
        for shot in self.shots:
            own = columns | {f"x0.{state}": i for state, i in shot.free.items()}
            run = self._run(shot, values, tuple(own))
            if isinstance(run, str):
                return run
            signals, slopes = run
            for s, place in shot.places.items():
                r[place] = signals[s] - shot.measured[s]
                for name, column in own.items():
                    J[place, column] = slopes[name][s]
        if not (np.isfinite(r).all() and np.isfinite(J).all()):
            return self._failed(None, values, "the motion or its derivatives are not finite")
        return Evaluation(r, J)

    def predicted(self, values: Array) -> Array | str:
        """Return the simulated values without derivatives, shape (rows,)."""
        found = np.empty(self.rows)
        for shot in self.shots:
            run = self._run(shot, values, ())
            if isinstance(run, str):
                return run
            for s, place in shot.places.items():
                found[place] = run[0][s]
        return found

    def _run(self, shot: Shot, values: Array, names: tuple[str, ...]) -> Run | str:
        """Return the motion of one window with derivatives by `names`, or a message on failure."""
        count = len(self.parameters)
        tau = float(values[count]) if self.dead_time is None else self.dead_time
        x0 = {**shot.held, **{state: float(values[i]) for state, i in shot.free.items()}}
        try:
            run = (self._sampled if self.substeps else self._simulated)(
                shot, x0, values[:count], tau, names
            )
        except ValueError as error:  # no consistent start, or a motion without derivatives
            run = str(error)
        return self._failed(shot, values, run) if isinstance(run, str) else run

    def _simulated(
        self, shot: Shot, x0: Mapping[str, float], p: Array, tau: float, names: tuple[str, ...]
    ) -> Run | str:
        begin = float(shot.t[0])
        run = simulate(
            self.model,
            shot.end,
            t_start=begin,
            x0=x0,
            u=shot.drives.over(begin, shot.end, tau, self.dead_time is None),
            p=dict(zip(self.parameters, p.tolist(), strict=True)),
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
        return {s: run[s] for s in shot.places}, run.sensitivities if names else {}

    def _sampled(
        self, shot: Shot, x0: Mapping[str, float], p: Array, tau: float, names: tuple[str, ...]
    ) -> Run | str:
        model, drives = self.model, shot.drives
        p = np.append(p, [0.0] * (self.dead_time is None))  # theta, for derivatives by a dead time
        first, last = np.searchsorted(drives.t, [shot.t[0], shot.end])
        t, states = drives.t[first : last + 1], [v.name for v in model.x]
        known = dict(zip([v.name for v in model.p], p.tolist(), strict=True))
        start = dict(x0)
        if len(x0) < 2:
            start = dict(zip(states, model.initial_state(x0, known), strict=True))
        instants = refined(t, self.substeps)
        between = [drives.mean(v.name, instants - tau) for v in model.u]
        motion = stepped(model, instants, between, p, np.array([start[n] for n in states], float))
        if isinstance(motion, str):
            return motion
        look = np.searchsorted(t, shot.t) * self.substeps
        unknowns, signals = [*known, *(f"x0.{name}" for name in states)], enumerate(states)
        columns = {unknown: motion.slopes[look, :, i] for i, unknown in enumerate(unknowns)}
        by = {u: {name: columns[u][:, k] for k, name in enumerate(states)} for u in names}
        return {name: motion.states[look, k] for k, name in signals}, by

    def _failed(self, shot: Shot | None, values: Array, why: str) -> str:
        shown = zip(self.parameters[:LISTED], values, strict=False)
        there = ", ".join(f"{name} = {x:.5g}" for name, x in shown)
        there = f"with {there}{', ...' if len(self.parameters) > LISTED else ''}: {why}"
        if shot is None:
            return there
        counted = " (t from the start of the record)" if shot.origin else ""
        return f"'{shot.record}' from t = {shot.origin + shot.t[0]:.12g} s {there}{counted}"
