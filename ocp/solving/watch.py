"""Monitoring of a running solver: its best iterate, reasons to stop, and causes of failure."""

import signal
import threading
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from time import perf_counter
from types import FrameType
from typing import NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.phase import Array
from ocp.solving.motion import ScenarioMotion, motions_of
from ocp.transcription.program import Program, worst_of
from ocp.transcription.transcribe import Transcription
from symfric.foundation.status import Status

FEASIBLE = 1e-6
"""Largest scaled violation of an iterate that counts as feasible."""
WINDOW = 30
"""Number of iterations within which Newton's method, if it converges, improves the iterate."""
FAR = 1e10
"""Magnitude of scaled unknowns above which they count as diverging."""
RESTING = 1e-6
"""Size of steps of scaled unknowns below which they count as zero."""


@final
@dataclass(frozen=True, eq=False)
class Progress:
    """State of the optimisation after an iteration.

    Attributes:
        iteration: number of iterations in this solve.
        cost: J of the iterate.
        violation: largest violation of an equation, a constraint or a bound, scaled.
        stage: name of one of several solves, such as "widths 0.1"; empty for a single solve.
        w: scaled unknowns.
        transcription: program of the solve; None if a solver is used without it.
    """

    iteration: int
    cost: float
    violation: float
    stage: str
    w: Array
    transcription: Transcription | None = None

    @property
    def motion(self) -> ScenarioMotion:
        """Motion of the iterate in the first scenario, evaluated on each access.

        Its model is that of the current solve: with smooth friction, or the arcs of modes.

        Raises:
            ValueError: the program is unknown.
        """
        made = self.transcription
        if made is None:
            raise ValueError("progress: expected a solve of a problem, got a program alone")
        scheme, points = made.scheme.coefficients(), made.unpack(self.w)
        return motions_of(made.problem, made.meshes, scheme, points)[0]


Report = Callable[[Progress], object]


def in_stage(
    progress: Report | None, stage: str, transcription: Transcription | None = None
) -> Report | None:
    """Return `progress` with the name of a solve and its program added to its argument."""
    if progress is None:
        return None
    return lambda now: progress(replace(now, stage=stage, transcription=transcription))


class Seen(NamedTuple):
    """Iterate of the solver; multipliers that the solver does not report are zero."""

    w: Array
    f: float
    g: Array
    lam_w: Array
    lam_g: Array
    violation: float

    @property
    def finite(self) -> bool:
        """True if the cost and all rows are finite."""
        return bool(np.isfinite(self.f) and np.isfinite(self.violation))

    def better_than(self, other: "Seen | None") -> bool:
        """Return True if both are feasible and the cost is lower, or the violation is smaller."""
        if other is None or not (self.finite and other.finite):
            return other is None or self.finite
        if max(self.violation, other.violation) <= FEASIBLE:
            return self.f < other.f
        return self.violation < other.violation


@final
class Watch:
    """Record of a run of a solver, which can stop the run.

    Attributes:
        best, last: best and last iterate; None before the first one.
        trace: cost, violation and largest step of each iterate.
        counted: number of iterations reported by the solver after its return.
        halt: status if the run was stopped.
        error: exception in `progress`, if any.
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
        """Number of iterations; the smaller count, as restorations report their start twice."""
        seen = max(0, len(self.trace) - 1)
        return seen if self.counted is None else min(seen, self.counted)

    def see(self, w: Array, f: float, g: Array, lam_w: Array, lam_g: Array) -> bool:
        """Record an iterate, and return True if the solver has to stop."""
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
                self._progress(Progress(self.iterations, f, violation, "", w))
            except KeyboardInterrupt:
                self.halt = Status.INTERRUPTED
            # Exceptions cannot pass through C++, so it is stored and raised again later.
            except BaseException as error:  # noqa: BLE001
                self.error, self.halt = error, Status.INTERRUPTED
        return self.halt is not None

    @property
    def cycles(self) -> bool:
        """True if w moved in the last iterations without improvement of cost or violation.

        This occurs at a kink that is smoothed over less than one step of Newton's method: iterates
        alternate between the two sides.
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
    """CasADi function evaluated in Python, with arguments and one result of given shapes."""

    def __init__(self, name: str, inputs: Sequence[ca.Sparsity], shape: ca.Sparsity) -> None:
        super().__init__()
        self._inputs, self._shape = inputs, shape
        self.construct(name, {})

    def get_n_in(self) -> int:  # noqa: D102
        return len(self._inputs)

    def get_sparsity_in(self, i: int) -> ca.Sparsity:  # noqa: D102
        return self._inputs[i]

    def get_sparsity_out(self, i: int) -> ca.Sparsity:  # noqa: D102
        del i
        return self._shape


@final
class IterationHook(Shaped):
    """Iteration callback of Ipopt and SQP that reports each iterate to the current `watch`."""

    def __init__(self, program: Program) -> None:
        n, m, k = program.w.numel(), program.g.numel(), program.p.numel()
        rows = {"x": n, "lam_x": n, "g": m, "lam_g": m, "f": 1, "lam_p": k}
        names = [ca.nlpsol_out(i) for i in range(ca.nlpsol_n_out())]
        self._shown = [names.index(name) for name in ("x", "f", "g", "lam_x", "lam_g")]
        self.watch: Watch | None = None
        columns = [ca.Sparsity.dense(rows[name], 1) for name in names]
        super().__init__("watch", columns, ca.Sparsity.dense(1))

    def has_eval_buffer(self) -> bool:  # noqa: D102
        return True

    def eval_buffer(self, arg: Sequence[memoryview], res: Sequence[memoryview]) -> int:
        """Report an iterate; a `DM` of each argument would take as long as a step of Ipopt."""
        stop = False
        if self.watch is not None:
            w, f, g, lam_w, lam_g = (np.frombuffer(arg[i]).copy() for i in self._shown)
            stop = self.watch.see(w, float(f[0]), g, lam_w, lam_g)
        np.frombuffer(res[0])[:] = stop
        return 0


@final
class GradientHook(Shaped):
    """Gradient of the cost that monitors a solver without iteration callback (fatrop).

    The solver evaluates it once per iteration, at the new iterate. NaN as result stops the solver.
    """

    def __init__(self, program: Program) -> None:
        self._gradient = program.gradient
        self._values = ca.Function("values", [program.w, program.p], [program.f, program.g])
        self.watch: Watch | None = None
        x, p = (ca.Sparsity.dense(part.numel(), 1) for part in (program.w, program.p))
        super().__init__("nlp_grad_f", [x, p], x)

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
    """Stop the solver after its iteration on the first Ctrl-C; restore the handler for others."""
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
