"""Monitoring of a running solver: its best iterate, reasons to stop, and the final message."""

import signal
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from time import perf_counter
from types import FrameType
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.transcription.program import Place, Program, Progress, Report, outside, worst_of
from symfric.foundation.status import Status

Array = NDArray[np.float64]

FEASIBLE = 1e-6
"""Largest scaled violation of an iterate that counts as feasible."""
WINDOW = 30
"""Number of iterations in which a converging Newton method makes visible progress."""
FAR = 1e10
"""Scaled unknowns above this count as diverging."""
RESTING = 1e-6
"""Steps of scaled unknowns below this count as zero."""


class Halt(Enum):
    """Reasons to stop a solver."""

    USER = "the user"
    TIME = "the time limit"
    ERROR = "an exception in `progress`"
    FAR = "unknowns that grow without bound"


@final
@dataclass(frozen=True, eq=False)
class Seen:
    """An iterate of the solver; multipliers are zero if it does not report them."""

    w: Array
    f: float
    g: Array
    lam_w: Array
    lam_g: Array
    violation: float

    @property
    def finite(self) -> bool:
        """True if cost and rows are numbers."""
        return bool(np.isfinite(self.f) and np.isfinite(self.violation))

    def better_than(self, other: "Seen | None") -> bool:
        """Return True if better: feasible with the lower cost, or less violated."""
        if other is None or not (self.finite and other.finite):
            return other is None or self.finite
        if max(self.violation, other.violation) <= FEASIBLE:
            return self.f < other.f
        return self.violation < other.violation


@final
class Watch:
    """A monitored run of a solver.

    Attributes:
        best, last: iterates; None before the first one.
        trace: cost, violation and largest step of each iterate.
        counted: iterations counted by the solver, after its return.
        halt: reason of a stop, if any.
        error: an exception in `progress`.
    """

    def __init__(self, program: Program, progress: Report | None, max_time: float | None) -> None:
        self._program, self._progress = program, progress
        self._deadline = None if max_time is None else perf_counter() + max_time
        self.best: Seen | None = None
        self.last: Seen | None = None
        self.trace: list[tuple[float, float, float]] = []
        self.counted: int | None = None
        self.halt: Halt | None = None
        self.error: BaseException | None = None

    @property
    def iterations(self) -> int:
        """Observed iterations without the start; a restoration reports its first point twice."""
        seen = max(0, len(self.trace) - 1)
        return seen if self.counted is None else min(seen, self.counted)

    def see(self, w: Array, f: float, g: Array, lam_w: Array, lam_g: Array) -> bool:
        """Record an iterate; return True to stop the solver."""
        violation = worst_of(self._program, w, g)
        step = np.inf if self.last is None else float(np.abs(w - self.last.w).max(initial=0.0))
        self.last = Seen(w, f, g, lam_w, lam_g, violation)
        if self.last.better_than(self.best):
            self.best = self.last
        self.trace.append((f, violation, step))
        if self._deadline is not None and perf_counter() > self._deadline:
            self.halt = self.halt or Halt.TIME
        if np.abs(w).max(initial=0.0) > FAR:
            self.halt = self.halt or Halt.FAR
        if self._progress is not None:
            try:
                self._progress(Progress(self.iterations, f, violation))
            except KeyboardInterrupt:
                self.halt = Halt.USER
            # An exception cannot cross C++: it is stored here and raised again afterwards.
            except BaseException as error:  # noqa: BLE001
                self.error, self.halt = error, Halt.ERROR
        return self.halt is not None

    @property
    def cycles(self) -> bool:
        """True if the last iterations were cyclic (see `goes_round`)."""
        return goes_round(self.trace)


def goes_round(trace: Sequence[tuple[float, float, float]]) -> bool:
    """Return True if neither cost nor violation improved in the last iterations, while w moved.

    A Newton method behaves like this at a kink that is smoothed over less than one step: it jumps
    from one side to the other.

    Args:
        trace: cost, violation and largest step of a scaled unknown of each iterate.
    """
    if len(trace) <= 2 * WINDOW:
        return False
    halves = np.array(trace[-2 * WINDOW :]).reshape(2, WINDOW, 3)
    costs, violations, steps = np.moveaxis(halves, 2, 0)
    before, now = np.median(steps, axis=1)
    moves = now > RESTING and now > 0.1 * before
    far, near = violations.min(axis=1)
    closer = near < 0.5 * far and far > FEASIBLE
    dear, cheap = costs.min(axis=1)
    feasible = max(far, near) <= FEASIBLE
    cheaper = feasible and cheap < dear - 1e-4 * max(abs(dear), 1e-8)
    return bool(moves and not closer and not cheaper)


class Shaped(ca.Callback):
    """A function of CasADi that calls Python, with arguments and one result of given shapes."""

    def __init__(
        self, name: str, inputs: Mapping[str, ca.Sparsity], output: str, shape: ca.Sparsity
    ) -> None:
        super().__init__()
        self._inputs, self._output, self._shape = [*inputs.items()], output, shape
        self.construct(name, {})

    def get_n_in(self) -> int:  # noqa: D102
        return len(self._inputs)

    def get_n_out(self) -> int:  # noqa: D102
        return 1

    def get_name_in(self, i: int) -> str:  # noqa: D102
        return self._inputs[i][0]

    def get_name_out(self, i: int) -> str:  # noqa: D102
        del i
        return self._output

    def get_sparsity_in(self, i: int) -> ca.Sparsity:  # noqa: D102
        return self._inputs[i][1]

    def get_sparsity_out(self, i: int) -> ca.Sparsity:  # noqa: D102
        del i
        return self._shape


@final
class IterationHook(Shaped):
    """Callback of a solver (Ipopt, SQP) that reports every iterate to the current `watch`."""

    def __init__(self, program: Program) -> None:
        n, m, k = program.w.numel(), program.g.numel(), program.p.numel()
        rows = {"x": n, "lam_x": n, "g": m, "lam_g": m, "f": 1, "lam_p": k}
        names = [ca.nlpsol_out(i) for i in range(ca.nlpsol_n_out())]
        self.watch: Watch | None = None
        super().__init__(
            "watch", {n: ca.Sparsity.dense(rows[n], 1) for n in names}, "stop", ca.Sparsity.dense(1)
        )

    def eval(self, arg: Sequence[ca.DM]) -> list[float]:  # noqa: D102
        if self.watch is None:
            return [0.0]
        at = {ca.nlpsol_out(i): value.full().ravel() for i, value in enumerate(arg)}
        stop = self.watch.see(at["x"], float(at["f"][0]), at["g"], at["lam_x"], at["lam_g"])
        return [float(stop)]


@final
class GradientHook(Shaped):
    """Gradient of the cost, used to monitor a solver without callback (fatrop).

    It is evaluated once per iteration, at the new iterate. To stop the solver, it returns NaN.
    """

    def __init__(self, program: Program) -> None:
        self._gradient = program.gradient
        self._values = ca.Function("values", [program.w, program.p], [program.f, program.g])
        self.watch: Watch | None = None
        x, p = (ca.Sparsity.dense(part.numel(), 1) for part in (program.w, program.p))
        super().__init__("nlp_grad_f", {"x": x, "p": p}, "grad_f_x", x)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:  # noqa: D102
        slope = ca.densify(self._gradient(*arg)[1])
        if self.watch is not None:
            f, g = (value.full().ravel() for value in self._values(*arg))
            w = arg[0].full().ravel()
            if self.watch.see(w, float(f[0]), g, np.zeros(w.size), np.zeros(g.size)):
                slope = slope * np.nan
        return [slope]


Hook = IterationHook | GradientHook


@contextmanager
def interrupts(watch: Watch) -> Generator[None, None, None]:
    """Turn the first Ctrl-C into a stop after the current iteration; the second ends as usual."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGINT)

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        watch.halt = Halt.USER
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


Array = NDArray[np.float64]

At = Callable[[Array, Place], str]
"""(w, place) -> text for its time."""

OVERDETERMINED = "Not_Enough_Degrees_Of_Freedom"
"""Ipopt's answer to a program with more equations than unknowns."""

HINTS: dict[str, str] = {
    OVERDETERMINED: (
        "There are more equations than unknowns; use fewer end and via conditions, or more "
        "intervals."
    ),
    "Insufficient_Memory": "The memory is exhausted; use fewer intervals.",
}
"""Return code -> message, if the status alone is not specific."""

TRIED = (
    "It happened at a point tried by the solver, not at an iterate; bound the states to where "
    "the equations are defined."
)


def sentence(
    program: Program,
    watch: Watch,
    point: Seen,
    status: Status,
    answer: str,
    solver: str,
    max_time: float | None,
    values: Array,
    at: At,
) -> str:
    """Return the message on the end of a solve, the worst row at `point`, and what to try."""
    if status.ok:
        return status.value
    count = watch.iterations
    reason = _reason(watch, status, answer, solver, max_time)
    if watch.halt is None:
        reason += f" ({solver} after {count} iterations: {answer}.)"
    if status is Status.NOT_FINITE:
        tried = [seen for seen in (watch.last, point) if seen is not None]
        named = (not_finite(program, seen.w, values, at) for seen in tried)
        return f"{reason} {next(filter(None, named), TRIED)}"
    if watch.cycles:
        reason += " The last iterations repeat without improvement, as at a kink."
    return f"{reason} {worst(program, point, at)}"


def _reason(watch: Watch, status: Status, answer: str, solver: str, max_time: float | None) -> str:
    count = watch.iterations
    if watch.halt is Halt.ERROR:
        return f"Stopped by an exception in progress after {count} iterations: {watch.error!r}."
    if watch.halt is Halt.USER:
        return f"Stopped by the user after {count} iterations; the result is the best iterate."
    if status is Status.TIME_LIMIT:
        limit = "The time limit" if max_time is None else f"The time limit of {max_time:g} s"
        return (
            f"{limit} ended {solver} after {count} iterations; allow more time or continue from "
            "the result, which is the best iterate."
        )
    if watch.halt is Halt.FAR:
        size = f"{FAR:g} times their typical size"
        return f"{status.value} Unknowns were {size} after {count} iterations."
    return HINTS.get(answer, status.value)


def worst(program: Program, point: Seen, at: At) -> str:
    """Return a message on the most violated row or bound, or that there is none."""
    rows = outside(point.g, program.lower_g, program.upper_g)
    bounds = outside(point.w, program.lower_w, program.upper_w)
    far = point.violation
    if far <= FEASIBLE:
        return f"The best iterate satisfies all constraints, at a cost of {point.f:.6g}."
    if rows.max(initial=0.0) >= far:
        place = program.rows[int(np.argmax(rows))]
        name = place.name
    else:
        place = program.unknowns[int(np.argmax(bounds))]
        name = f"the bound on {place.name}"
    return f"Most violated is {name} {at(point.w, place)}, by {far:.3g} in scaled units."


def not_finite(program: Program, w: Array, values: Array, at: At) -> str:
    """Return a message on a NaN or infinite equation or derivative at `w`; "" if none."""
    cost, slope = program.gradient(w, values)
    g, jacobian = program.jacobian(w, values)
    rows, columns = (np.array(part) for part in jacobian.sparsity().get_triplet())
    bad = ~np.isfinite(g.full().ravel())
    if bad.any():
        place = program.rows[int(np.argmax(bad))]
        return f"It is {place.name} {at(w, place)}."
    if not np.isfinite(float(cost)):
        return "It is the cost."
    bad = ~np.isfinite(np.array(jacobian.nonzeros()))
    if bad.any():
        k = int(np.argmax(bad))
        row, unknown = program.rows[int(rows[k])], program.unknowns[int(columns[k])]
        return f"It is the derivative of {row.name} in {unknown.name} {at(w, row)}."
    bad = ~np.isfinite(ca.densify(slope).full().ravel())
    if bad.any():
        unknown = program.unknowns[int(np.argmax(bad))]
        return f"It is the derivative of the cost in {unknown.name} {at(w, unknown)}."
    return ""


def plainly(w: Array, place: Place) -> str:
    """Return the time of a place as a fraction, without known durations."""
    del w
    return f"at {place.fraction:.4g} of the duration"
