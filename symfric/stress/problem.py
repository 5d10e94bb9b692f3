"""Model of a case, its reference solution, and the errors that the judge measures."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric import Model, SolveError, Trajectory, law_from_text, parameters, with_values
from symfric.foundation.numeric import Array
from symfric.integrator import Hold, Input, Linear, simulate
from symfric.integrator.methods.tableaux import another, chosen
from symfric.scenes import ALL_SCENES
from symfric.stress.cases import Case
from symfric.stress.referee import NO_FORCE, SINE, Question, Signal, knows, solve

WORK = 120_000
TIMES = 101
"""Number of times at which runs are compared."""
States = Callable[[Array], Array]
"""Function from times to states, shape (nx, times)."""
RTOL, ENOUGH = 1e-10, 0.3
"""Relative tolerance of the reference solver, and its largest accepted error [tolerances]."""
GAVE_UP = (ArithmeticError, ValueError)
RIGHT = 10.0
"""Largest error [tolerances] of a right run."""
STATIONS = (0, TIMES // 3, 2 * TIMES // 3)
"""Indices of the times at which a tolerance is added."""
STRIDES = 100
"""Smallest number of steps of a reference, which must not miss short events."""


def of(run: Trajectory) -> States:
    """Return the states of a run as a function of time."""
    return lambda times: table(run, times)


def table(run: Trajectory, times: Array) -> Array:
    """Return states at `times`, shape (nx, times)."""
    values = run.states(times)
    return np.stack([values[v.name] for v in run.model.x])


@final
@dataclass(frozen=True, eq=False)
class Answer:
    """Motion of a case, computed by the reference solver.

    Attributes:
        asked: data of the case.
        rtol: relative tolerance of SciPy.
        doubt: difference [tolerances] from another solve at the requested times.
    """

    asked: Question
    rtol: float
    doubt: Array

    def states(self, times: Array) -> Array:
        """Return states at times between start and end, shape (nx, times)."""
        at, back = np.unique([self.asked.times[0], *times], return_inverse=True)
        return solve(replace(self.asked, times=at), self.rtol)[:, back[1:]]

    def onward(self, times: Array, start: Array) -> Array | None:
        """Return states at `times` of the motion that starts at times[0] with `start`."""
        try:
            return solve(replace(self.asked, times=times, y=start), self.rtol)
        except GAVE_UP:
            return None


@final
@dataclass(frozen=True, eq=False)
class CaseProblem:
    """Model and data of a case, ready to run.

    Attributes:
        case: data of the case.
        model: equations.
        inputs: inputs for `simulate`.
        p: parameters given at run time.
        work: largest number of attempts times unknowns; attempts of large machines cost more.
    """

    case: Case
    model: Model
    inputs: Mapping[str, Input]
    p: Mapping[str, float]
    work: int = WORK

    @property
    def attempts(self) -> int:
        """Largest number of attempts of a run."""
        return self.work // (len(self.model.x) + len(self.model.z))

    @property
    def times(self) -> NDArray[np.float64]:
        """Times at which runs are compared [s]."""
        return np.linspace(self.case.t_start, self.case.t_end, TIMES)

    @property
    def other(self) -> str:
        """Name of a method of another family than that of the case."""
        return another(chosen("case", self.case.method, self.case.rtol))

    @property
    def third(self) -> str:
        """Name of the method of the second reference."""
        return "radau5" if self.other == "rodas5p" else "rodas5p"

    def patience(self, run: Trajectory) -> int:
        """Return the largest number of attempts of a reference for `run`."""
        return 10 * (run.statistics.steps + run.statistics.rejections) + self.attempts

    def run(self, rtol: float, method: str, **options: Any) -> Trajectory:
        """Return a run of `simulate` without warnings; errors are those of `simulate`."""
        given: dict[str, Any] = {"x0": self.case.x0, "t_eval": self.times, "backend": "vm"}
        given |= options
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            return simulate(
                self.model, self.case.t_end, t_start=float(given["t_eval"][0]), u=self.inputs,
                p=self.p, rtol=rtol, method=method, **given,
            )  # fmt: skip

    def attempt(
        self, rtol: float, method: str, limit: int, **options: Any
    ) -> Trajectory | SolveError:
        """Return a reference run with short steps, or its error if it fails.

        Args:
            rtol, method: as in `simulate`.
            limit: largest number of attempts.
            options: further arguments of `run`, by default those of the case.
        """
        longest = (self.case.t_end - self.case.t_start) / STRIDES
        try:
            return self.run(rtol, method, max_steps=limit, max_step=longest, **options)
        except SolveError as error:
            return error

    def distance(self, run: Trajectory, truth: States) -> float:
        """Return the largest difference of a state [tolerances], see `apart`."""
        return float(self.apart(table(run, self.times), truth).max())

    def at_steps(self, run: Trajectory, truth: States) -> float:
        """Return the largest difference [tolerances] at the ends of the steps of the run.

        An implicit step over a fast transient may end right although its interpolation is not.
        """
        times = run.step_times[run.step_times <= self.case.t_end]
        times = times[:: 1 + times.size // TIMES]
        size = self.tolerances(truth(self.times))
        return float((np.abs(table(run, times) - truth(times)) / size).max())

    def apart(self, y: Array, truth: States) -> Array:
        """Return differences [tolerances] of states y at the times of the problem, as y.

        In a model with events, regimes jump, so y may be early or late by rtol times the duration.
        """
        if not self.model.events:
            z = truth(self.times)
            return np.abs(y - z) / self.tolerances(z)
        late = self.case.rtol * (self.times[-1] - self.times[0])
        shifted = [np.clip(self.times + s * late, *self.times[[0, -1]]) for s in (-1, 0, 1)]
        near = truth(np.concatenate(shifted)).reshape(y.shape[0], 3, -1)
        off = np.maximum(0.0, np.maximum(y - near.max(1), near.min(1) - y))
        return off / self.tolerances(near[:, 1])

    def tolerances(self, z: Array) -> Array:
        """Return rtol max|x| + atol of each state, shape (nx, 1), from states z (nx, times)."""
        rtol, nominal = self.case.rtol, self.model.nominal("x")[:, None]
        return rtol * np.abs(z).max(1, keepdims=True) + 0.1 * rtol * nominal

    def amplification(self, y: Array, limit: int, answer: Answer | None = None) -> float:
        """Return the largest growth of one tolerance that is added to y at one of `STATIONS`."""
        size, worst = self.tolerances(y), 1.0
        for k in STATIONS:
            times, ends = self.times[k:], list[Array]()
            for added in (0.0, 1.0):
                start = y[:, k] + added * size[:, 0]
                if answer is not None and not self.model.events:
                    end = answer.onward(times, start)
                else:
                    end = self.onward(times, start, limit, self.third)
                if end is None:
                    return float("inf")
                ends.append(end)
            worst = max(worst, float((np.abs(ends[1] - ends[0]) / size).max()))
        return worst

    def onward(self, times: Array, y: Array, limit: int, method: str) -> Array | None:
        """Return states at `times` of the motion that starts with y; None if the run fails."""
        start = dict(zip((v.name for v in self.model.x), y.tolist(), strict=True))
        try:
            run = self.attempt(self.case.rtol / 100, method, limit, x0=start, t_eval=times)
        except ValueError:  # these states have no consistent algebraic unknowns
            return None
        return None if isinstance(run, SolveError) else table(run, times)

    def worst_step(self, run: Trajectory, size: Array, limit: int) -> float:
        """Return the largest error of a single step [tolerances], relative to a run from its start.

        Another method repeats sequences of steps. A sequence with an error above `RIGHT` is halved
        until one step is left, whose error is returned. Without such a sequence, the result is the
        largest error of a sequence; errors that are damped within a sequence do not affect the run.
        The result is infinite if the other method fails.
        """
        t = run.step_times[run.step_times <= self.case.t_end]
        y = table(run, t)
        cuts = np.unique(np.linspace(0, t.size - 1, STRIDES + 1).astype(int)).tolist()
        stretches, worst = list(pairwise(cuts)), 0.0
        while stretches:
            first, last = stretches.pop()
            span = t[[first, last]]
            part = replace(self, case=replace(self.case, t_end=float(span[1])))
            end = part.onward(span, y[:, first], limit, self.other)
            if end is None:
                return float("inf")
            error = float((np.abs(y[:, [last]] - end[:, 1:]) / size).max())
            if error > RIGHT and last - first > 1:
                middle = (first + last) // 2
                stretches += [(first, middle), (middle, last)]
            elif error > RIGHT:
                return error
            else:
                worst = max(worst, error)
        return worst

    def question(self) -> Question | None:
        """Return the case as data for the referee; None if the referee does not know it.

        Start values are those of the model, in which a bristle starts at its steady state.
        """
        case, model = self.case, self.model
        if not knows(case.law, case.scene) or any(name.endswith("mode") for name in case.x0):
            return None
        scene = with_values(ALL_SCENES[case.scene](law_from_text(case.law)), case.values)
        numbers = {name: float(known.value) for name, known in parameters(scene).items()}
        return Question(
            law=case.law,
            scene=case.scene,
            p=numbers,
            forms=case.forms,
            signal=case.inputs.get("force", SINE if case.scene == "drive" else NO_FORCE),
            y=model.initial_state(case.x0, self.p, case.t_start),
            scale=model.nominal("x"),
            times=self.times,
        )

    def answered(self) -> Answer | None:
        """Return the reference solution, or None if there is none.

        The solve at 1e-10 is compared with one at 1e-9 and, if they differ too much, with one at
        1e-12.
        """
        asked = self.question()
        if asked is None:
            return None
        try:
            fine = solve(asked, RTOL)
            for rtol, other in ((RTOL, 10 * RTOL), (RTOL / 100, RTOL / 100)):
                states = Answer(asked, other, np.zeros(0)).states
                answer = Answer(asked, rtol, self.apart(fine, states).max(0))
                if answer.doubt.max() <= ENOUGH:
                    break
        except GAVE_UP:
            return None
        return answer


def problem(case: Case, work: int = WORK) -> CaseProblem:
    """Return the model of a case.

    Raises:
        ValueError: the law, the scene or the equations refuse the numbers.
    """
    law = law_from_text(case.law)
    law = replace(law, **case.forms) if case.forms else law
    scene = with_values(ALL_SCENES[case.scene](law), case.values)
    p = {name: case.values[name] for name in case.free}
    if p:  # the model has default values; the values of the case are given at run time
        known = parameters(ALL_SCENES[case.scene](law))
        scene = with_values(scene, {name: known[name].value for name in p})
    inputs = {name: signal(s) for name, s in case.inputs.items()}
    return CaseProblem(case, scene.model(free=case.free), inputs, p, work)


def signal(s: Signal) -> Input:
    """Return an input for `simulate`.

    Raises:
        ValueError: an unknown kind, or a wrong number of values.
    """
    if s.kind in ("hold", "linear"):
        return (Hold if s.kind == "hold" else Linear)(s.t, s.values)
    if s.kind == "constant":
        (c,) = s.values
        return c
    a, b, c = s.values
    if s.kind == "sine":
        return lambda t: a * ca.sin(b * t) + c
    if s.kind == "pulse":  # rises and falls within a tenth of its width
        return lambda t: a / 2 * (ca.tanh(20 * (t - b) / c) - ca.tanh(20 * (t - b - c) / c))
    raise ValueError(
        f"case: expected a signal constant, hold, linear, sine or pulse, got {s.kind!r}"
    )
