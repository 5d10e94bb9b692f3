"""Monitoring of a running solver: its best iterate, reasons to stop, and what went wrong."""

import signal
import threading
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from time import perf_counter
from types import FrameType
from typing import NamedTuple, final

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


class Seen(NamedTuple):
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
        halt: status of a stop, if any.
        error: an exception in `progress`.
    """

    def __init__(self, program: Program, progress: Report | None, max_time: float | None) -> None:
        self._program, self._progress = program, progress
        self._deadline = None if max_time is None else perf_counter() + max_time
        self.best: Seen | None = None
        self.last: Seen | None = None
        self.trace: list[tuple[float, float, float]] = []
        self.counted: int | None = None
        self.halt: Status | None = None
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
            self.halt = self.halt or Status.TIME_LIMIT
        if np.abs(w).max(initial=0.0) > FAR:
            self.halt = self.halt or Status.UNBOUNDED
        if self._progress is not None:
            try:
                self._progress(Progress(self.iterations, f, violation))
            except KeyboardInterrupt:
                self.halt = Status.INTERRUPTED
            # An exception cannot cross C++: it is stored here and raised again afterwards.
            except BaseException as error:  # noqa: BLE001
                self.error, self.halt = error, Status.INTERRUPTED
        return self.halt is not None

    @property
    def cycles(self) -> bool:
        """True if neither cost nor violation improved in the last iterations, while w moved.

        A Newton method behaves like this at a kink that is smoothed over less than one step: it
        jumps from one side to the other.
        """
        if len(self.trace) <= 2 * WINDOW:
            return False
        halves = np.array(self.trace[-2 * WINDOW :]).reshape(2, WINDOW, 3)
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
        watch.halt = Status.INTERRUPTED
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


At = Callable[[Array, Place], str]
"""(w, place) -> text for its time."""


def worst(program: Program, point: Seen, at: At) -> str:
    """Return a message on the most violated row or bound, or that there is none."""
    far = point.violation
    if far <= FEASIBLE:
        return f"The best iterate satisfies all constraints, at a cost of {point.f:.6g}."
    rows = outside(point.g, program.lower_g, program.upper_g)
    if rows.max(initial=0.0) >= far:
        place = program.rows[int(np.argmax(rows))]
        name = place.name
    else:
        bounds = outside(point.w, program.lower_w, program.upper_w)
        place = program.unknowns[int(np.argmax(bounds))]
        name = f"the bound on {place.name}"
    return f"Most violated is {name} {at(point.w, place)}, by {far:.3g} in scaled units."


def not_finite(program: Program, w: Array, values: Array, at: At) -> str:
    """Return a message on a NaN or infinite equation or derivative at `w`; "" if none."""
    cost, slope = program.gradient(w, values)
    g, jacobian = program.jacobian(w, values)
    bad = ~np.isfinite(g.full().ravel())
    if bad.any():
        place = program.rows[int(np.argmax(bad))]
        return f"It is {place.name} {at(w, place)}."
    if not np.isfinite(float(cost)):
        return "It is the cost."
    bad = ~np.isfinite(np.array(jacobian.nonzeros()))
    if bad.any():
        rows, columns = jacobian.sparsity().get_triplet()
        k = int(np.argmax(bad))
        row, unknown = program.rows[rows[k]], program.unknowns[columns[k]]
        return f"It is the derivative of {row.name} in {unknown.name} {at(w, row)}."
    bad = ~np.isfinite(ca.densify(slope).full().ravel())
    if bad.any():
        unknown = program.unknowns[int(np.argmax(bad))]
        return f"It is the derivative of the cost in {unknown.name} {at(w, unknown)}."
    return ""


def as_fraction(w: Array, place: Place) -> str:
    """Return the time of a place as a fraction, without known durations."""
    del w
    return f"at {place.fraction:.4g} of the duration"
