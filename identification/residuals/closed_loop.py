"""Residuals of a drive simulated under its sampled controller.

At each sample the controller reads the simulated motion and sets the command of the drive until
the next sample:

    (s, command)_k = controller(s_(k-1), x_k, reference_k)
    force_k = gain (command_k + disturbance_k),   m v' = force_k - F(v) - offset

Residuals are those of position and force. The controller keeps the motion near the reference;
errors therefore do not drift as in open loop, and the force contains the friction.
Source of the error measure: Janot, Gautier, Brunot, Nonlinear System Identification Benchmarks
2019.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from identification.data.dataset import Dataset
from identification.data.record import PositionLoop, Record
from identification.residuals.evaluation import Array, Blocks, Channel
from identification.residuals.initial import local, noise_of
from identification.residuals.stepper import Chain, Dual, Feedback, Mass, why_no_motion
from identification.unknowns.spec import Unknown
from identification.unknowns.subject import Subject
from symfric.foundation import checks

SIGNALS = ("x", "force")
WHERE = "ClosedLoop"


@final
@dataclass(frozen=True, eq=False)
class Controller:
    """User-defined controller, called once per sample.

        (state, command) = step(state, measured, reference),   force = gain (command + disturbance)

    Attributes:
        step: CasADi Function (state (n,), measured (1,) or (2,), reference (r,)) -> (state (n,),
            command (1,)). The measured values are the position, or position and velocity, of the
            simulated drive at the sample. Without memory, n = 0.
        reference: channels of the reference in the data.
        disturbance: channel added to the command; None: no disturbance.
        gain: force per command [N or N m per command unit].
        start: state before the first sample as numbers, or a Function of (x, v) at that sample;
            None: zeros.
    """

    step: ca.Function
    reference: tuple[str, ...] = ("reference",)
    disturbance: str | None = None
    gain: float = 1.0
    start: Sequence[float] | ca.Function | None = None

    def __post_init__(self) -> None:
        where = "Controller"
        step = checks.kind(f"{where}: step", self.step, ca.Function, "a CasADi Function")
        reference = (self.reference,) if isinstance(self.reference, str) else self.reference
        names = checks.names(f"{where}: reference", reference)
        object.__setattr__(self, "reference", tuple(names))
        object.__setattr__(self, "gain", checks.number(f"{where}: gain", self.gain))
        sizes = [step.numel_in(i) for i in range(step.n_in())]
        out, n = [step.numel_out(i) for i in range(step.n_out())], sizes[0] if sizes else 0
        if len(sizes) != 3 or sizes[1] not in (1, 2) or sizes[2] != len(names) or out != [n, 1]:
            raise ValueError(
                f"{where}: step: expected (state, measured of 1 or 2, reference of {len(names)}) "
                f"-> (state, command of 1), got arguments of {sizes} and results of {out}"
            )
        if isinstance(self.start, ca.Function):
            into, out = self.start.numel_in(0), self.start.numel_out(0)
            if (self.start.n_in(), into, out) != (1, 2, n):
                raise ValueError(
                    f"{where}: start: expected a Function of (x, v), 2 numbers, returning {n}, "
                    f"got one of {into} returning {out}"
                )
        elif self.start is not None:
            start = tuple(checks.array(f"{where}: start", self.start).tolist())
            if len(start) != n:
                raise ValueError(f"{where}: start: expected {n} numbers, got {len(start)}")
            object.__setattr__(self, "start", start)

    @property
    def memory(self) -> int:
        """Number of controller states."""
        return self.step.numel_in(0)

    def feedback(self) -> Feedback:
        """Return the controller with derivatives; its rows are references and the disturbance."""
        s, y, r = self.step.sx_in()
        after, command = self.step(s, y, r)
        both = ca.vertcat(after, command)
        results = [both, ca.jacobian(both, s), ca.jacobian(both, y)]
        known = ca.Function("controller", [s, y, r], results)
        count = len(self.reference)

        def act(state: Sequence[Dual], row: ca.SX) -> tuple[list[Dual], list[Dual]]:
            memory, seen = state[2:], state[: y.numel()]
            at = [ca.vertcat(*(q.value for q in part)) for part in (memory, seen)]
            value, by_s, by_y = known(*at, row[:count])
            slope = _times(by_s, memory) + _times(by_y, seen)
            *new, command = (Dual(value[i], slope[i, :]) for i in range(self.memory + 1))
            force = self.gain * (command.value + row[count])
            return [Dual(force, self.gain * command.slope)], new

        return act

    def rows(self, record: Record) -> Array:
        """Return references and disturbance at the samples, shape (n, r + 1)."""
        name = self.disturbance
        disturbance = np.zeros(record.size) if name is None else record[name]
        return np.column_stack([*(record[name] for name in self.reference), disturbance])

    def begin(self) -> ca.Function:
        """Return a Function (x, v) -> (x, v, controller state) at the start, and its derivative."""
        x = ca.SX.sym("x", 2)
        if isinstance(self.start, ca.Function):
            state = self.start(x)
        else:
            state = ca.SX(ca.DM(self.start or [0.0] * self.memory))
        both = ca.vertcat(x, state)
        return ca.Function("begin", [x], [ca.densify(both), ca.densify(ca.jacobian(both, x))])


def _times(slopes: ca.SX, parts: Sequence[Dual]) -> ca.SX:
    if not parts:
        return ca.SX(0)
    return ca.mtimes(slopes, ca.vertcat(*(part.slope for part in parts)))


def position_controller(loop: PositionLoop, step: float) -> Controller:
    """Return the controller of a `PositionLoop` at a sample time of `step` [s].

    The drive is assumed to move at its initial velocity before the first sample.
    """
    xv = ca.SX.sym("xv", 2)
    before = ca.vertcat(xv[0] - step * xv[1], xv[0] - 1.5 * step * xv[1])
    s, x, r = ca.SX.sym("s", 2), ca.SX.sym("x"), ca.SX.sym("r")
    mean = (x + s[0]) / 2
    command = loop.kp * loop.kv * (r - x) - loop.kv * (mean - s[1]) / step
    command = ca.fmin(ca.fmax(command, -loop.limit), loop.limit)
    return Controller(
        ca.Function("position_loop", [s, x, r], [ca.vertcat(x, mean), command]),
        gain=loop.gain,
        start=ca.Function("position_start", [xv], [before]),
    )


@final
@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """Residuals of position and force of the drive simulated under its controller.

    Attributes:
        loop: the controller; None: the controller of each record (`Record.loop`).
        signals: compared signals: "x", "v" and "force".
        x0: "given": the motion starts at the first measured position, with the velocity of a cubic
            through the first positions; "estimate": both are unknowns of each record.
        substeps: implicit steps per sample.

    Limits: the controller reads the simulated position without noise, so the noise fed back in the
    experiment remains in the residuals of the force. The measured force must be the one held after
    its sample, as the controller records it. A mean of the forces before and after a sample lags by
    half a sample. The error is small where the force changes slowly (the mass of
    `synthetic_drive_data` decreases by .005 %) but visible in the residuals at each reversal. The
    model must be one mass with a law without states.
    """

    loop: PositionLoop | Controller | None = None
    signals: tuple[str, ...] = SIGNALS
    x0: str = "given"
    substeps: int = 2

    def __post_init__(self) -> None:
        loop: Any = self.loop
        if not (loop is None or isinstance(loop, PositionLoop | Controller)):
            raise checks.refused(f"{WHERE}: loop", "a PositionLoop or a Controller", loop)
        signals = tuple(checks.names(f"{WHERE}: signals", self.signals))
        for name in signals:
            checks.choice(f"{WHERE}: signals", name, ("x", "v", "force"))
        object.__setattr__(self, "signals", signals)
        checks.choice(f"{WHERE}: x0", self.x0, ("given", "estimate"))
        checks.count(f"{WHERE}: substeps", self.substeps)

    def prepare(
        self, subject: Subject, data: Dataset, start: Mapping[str, float] | None = None
    ) -> "LoopRows":
        """Return the residuals of `data`.

        Raises:
            ValueError: the model is not one mass with stateless friction, the controller of a
                record is unknown, channels are missing, or intervals are unequal.
        """
        del start
        mass = Mass(subject.model)
        if len(mass.inputs) != 1:
            raise ValueError(
                f"{WHERE}: model '{subject.model.name}': expected one input, the force, got "
                f"{', '.join(mass.inputs) or 'none'}"
            )
        runs, own, channels, first = list[ControlledRecord](), list[Unknown](), list[Channel](), 0
        for number, record in enumerate(data):
            run, given = self._run(mass, record)
            runs.append(run)
            units = {name: record.unit(name) for name in self.signals}
            regressors = _regressors(record, given, self.signals)
            for name, y in run.measured.items():
                rows, unit = slice(first, first := first + y.size), units[name]
                channels.append(Channel(number, name, unit, rows, record.time, y, regressors))
            unit = units.get("x", "m")
            for k, of in enumerate((unit, f"{unit}/s")):
                value, start_value = float(run.first[k]), f"x0.{'xv'[k]}[{number}]"
                scale = max(abs(value), subject.model.x[k].nominal)
                own.append(Unknown(start_value, of, value, scale=scale, nuisance=True))
        free = tuple(own) if self.x0 == "estimate" else ()
        return LoopRows(subject.names, free, tuple(channels), tuple(runs))

    def _run(self, mass: Mass, record: Record) -> tuple["ControlledRecord", Array]:
        """Return the record with drive and controller, and its references and disturbance."""
        loop, where = record.loop if self.loop is None else self.loop, f"data '{record.name}'"
        if loop is None:
            hint = "give ClosedLoop(loop=...) or fit Shooting()"
            raise ValueError(f"{WHERE}: {where}: expected a known controller, got none; {hint}")
        record = record.uniform()
        if isinstance(loop, PositionLoop):
            controller = position_controller(loop, record.step)
            if (size := loop.reference.size) != record.size:
                such = f"a reference of {record.size} samples"
                raise ValueError(f"{WHERE}: {where}: expected {such}, got {size}")
            given = np.column_stack([loop.reference, loop.disturbance])
        else:
            controller, given = loop, loop.rows(record)
        feedback, memory = controller.feedback(), controller.memory
        chain = Chain.of(mass, feedback, row=given.shape[1], memory=memory, substeps=self.substeps)
        rows = np.column_stack([np.full(record.size, record.step), given])
        x, measured = record["x"], {name: record[name] for name in self.signals}
        v = record["v"][0] if "v" in record else local(record.time, x, 0, noise_of(x)).rate
        first = np.array([x[0], float(v)])
        return ControlledRecord(
            record.name, chain, controller.begin(), rows, first, measured
        ), given


def _regressors(record: Record, given: Array, signals: Sequence[str]) -> dict[str, Array]:
    """Return references and disturbance, of which correct residuals are independent.

    The measured velocity is included only if no motion is compared, because residuals of a position
    depend on the noise of that velocity. The tests use the simulated motion instead.
    """
    found = dict[str, Array]()
    if not {"x", "v"} & set(signals):
        v = record["v"] if "v" in record else np.gradient(record["x"], record.step)
        rest = np.abs(v) < 0.01 * np.abs(v).max()
        found |= {"v": v, "sign(v)": np.where(rest, 0.0, np.sign(v))}
    for i, column in enumerate(given.T):
        name = "disturbance" if i == given.shape[1] - 1 else "reference"
        if np.ptp(column) > 0:
            found[name if name not in found else f"{name} {i + 1}"] = column
    return found


class ControlledRecord(NamedTuple):
    """Record with its drive and controller.

    Attributes:
        name: name of the record.
        chain: drive and controller, sample by sample.
        begin: (x, v) -> all states at the first sample, and their derivatives.
        rows: inputs of the chain, shape (n, ...).
        first: measured position and velocity at the first sample.
        measured: signal -> samples.
    """

    name: str
    chain: Chain
    begin: ca.Function
    rows: Array
    first: Array
    measured: Mapping[str, Array]

    def signals(self, p: Array, first: Array) -> dict[str, tuple[Array, Array]] | str:
        """Return signal -> values (n,) and derivatives (n, parameters + 2), or a message.

        The motion starts at position and velocity `first`.
        """
        state, slope = (np.asarray(a.full()) for a in self.begin(first))
        slopes = np.hstack([np.zeros((len(state), p.size)), slope])
        motion = self.chain(self.rows, p, state.ravel(), slopes)
        if why := why_no_motion(motion):
            return f"data '{self.name}': {why}"
        found = {n: (motion.states[:-1, k], motion.slopes[:-1, k]) for k, n in enumerate("xv")}
        return found | {"force": (motion.inputs[:, 0], motion.input_slopes[:, 0])}


@final
@dataclass(frozen=True, eq=False)
class LoopRows(Blocks):
    """Residuals of `ClosedLoop`: simulated minus measured signals.

    With x0="estimate", `own` contains position and velocity at the start of each record.
    """

    runs: tuple[ControlledRecord, ...]

    def blocks(self, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        """Yield the residuals of each signal of each record, and their derivatives."""
        for k, run in enumerate(self.runs):
            first = own[2 * k : 2 * k + 2] if own.size else run.first
            signals = run.signals(p, first)
            if isinstance(signals, str):
                yield signals
                return
            for name, y in run.measured.items():
                value, slope = signals[name]
                whole = np.zeros((y.size, p.size + own.size))
                whole[:, : p.size] = slope[:, : p.size]
                if own.size:
                    place = p.size + 2 * k
                    whole[:, place : place + 2] = slope[:, p.size :]
                yield value - y, whole
