"""Fit a law, a machine or a model to measured data.

    data = Dataset.read("run*.csv", units="rad, N m")
    fit = Fit(Shooting(windows=4.0), "lugre", data, free={"sigma_0": log(1e3, 1e7)}).solve()

data -> type of residuals -> unknowns -> least squares from many starts -> verdict -> result
"""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.findings import Findings
from identification.residuals.evaluation import Residuals
from identification.residuals.inverse import InverseDynamics
from identification.residuals.points import Points
from identification.result.build import fitted, levels_of, written
from identification.result.fitted import Fitted
from identification.result.live import Asked, Kind, Live
from identification.solving.descent import Start, descend, remaining
from identification.solving.many_starts import Progress, best_of, many_starts, scattered
from identification.solving.task import THRESHOLD, Point, Task, task
from identification.starts.measured import Measured
from identification.starts.start import centre, explained, findings_of, measured, slowest, strongest
from identification.unknowns.subject import Subject, subject
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import covariance
from identification.verdict.judge import Verdict, judge
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

Array = NDArray[np.float64]
MOST_STARTS = 10_000
QUICK = 40
"""Evaluations of a fit that only selects a setting."""
OF_KIND = ("x0", "dead_time")
"""Entries of `free` that belong to the residuals."""


@final
@dataclass(frozen=True, eq=False)
class Fit:
    """A fit of a law, a machine or a model to data.

        minimise over p, sigma   sum_s n_s ln sigma_s^2 + sum_i loss(r_i(p) / sigma_s(i))

    Attributes:
        kind: type of residuals: `Points()`, `InverseDynamics()`, `Shooting()`, `ClosedLoop()`.
        what: a law or its text ("stribeck", "asymmetric(coulomb+viscous)"), a scene, or a model. A
            law becomes the friction of a `Drive`.
        data: one or several records.
        free: names, or name -> a start value, (lower, upper), `log(...)`, `linear(...)`,
            `above(name)`, `tied(name, factor)`. They are fitted in addition to those fitted by
            their role; for a model, all parameters. "x0" and "dead_time" go to `kind`.
        fixed: name -> value of held parameters; "others": all that are not in `free`.
        normal_force: of a law [N]; with 1 N its coefficients read as forces.
        noise: "estimate", or signal -> standard deviation [SI]; others are estimated.
        loss: "squares", or against outliers "huber", "soft_l1", "cauchy", "arctan".
        starts: largest number of starts; fewer if others are unnecessary (see `many_starts`).
        start: parameter -> value, or "data" (the default), or "law": its values.
        seed: random seed of the starts after the first.
        evaluations: of the residuals, allowed to each start, and as many again to the best one.

    Raises:
        ValueError: bad arguments; from `solve` names and bounds, all in one error.
    """

    kind: Kind
    what: Any
    data: Dataset
    free: Any = None
    fixed: Any = None
    normal_force: float = 1.0
    noise: Any = "estimate"
    loss: str = "squares"
    starts: int = 6
    start: Any = "data"
    seed: int = 0
    evaluations: int = 120

    def __post_init__(self) -> None:
        problems: list[str] = []
        for check in (_check_kind, _check_data, _check_loss, _check_counts, _check_start):
            try:
                check(self)
            except ValueError as error:
                problems.append(str(error))
        if problems:
            raise ValueError("; ".join(problems))

    def solve(
        self,
        executor: Executor | None = None,
        progress: Progress | None = None,
        throw: bool = True,
    ) -> Fitted:
        """Solve the fit.

        Args:
            executor: of `concurrent.futures`, for the starts; the result is bit-identical.
            progress: called with a text and the fraction done.
            throw: raise `SolveError` if the result is unusable; its `partial` is the result.

        Raises:
            ValueError: data or names that cannot be used.
            SolveError: no start has residuals; with `throw`, also if the fit did not reach a
                minimum, or data or residuals make the result implausible.
        """
        begun = perf_counter()
        throw = checks.flag("Fit: throw", throw)
        if progress is not None:
            checks.function("Fit: progress", progress, "a function of a text and a fraction")
        asked = self.prepared()
        made = asked.task
        first = scattered(made.unknowns, asked.centre, self.starts, self.seed)
        starts = many_starts(made, first, executor, progress, self.evaluations)
        end = best_of(starts)
        point = made.with_noise(end.noise).at(end.w)
        if isinstance(point, str):
            message = f"Fit: {asked.subject.name}: no start has residuals: {point}"
            raise SolveError(message, Status.NOT_FINITE)
        return self._result(asked, starts, end, point, throw, perf_counter() - begun)

    def prepared(self) -> "Prepared":
        """Check the data, choose the subject and set up the residuals, without solving."""
        kind, free = _to_kind(self.kind, self.free)
        findings = findings_of(kind, self.data)
        seen = measured(kind, self.data, self.normal_force)
        imposed = isinstance(kind, Points) and all(r.t is not None for r in self.data)
        given: Mapping[str, float] = self.start if isinstance(self.start, Mapping) else {}
        found = subject(
            self.what,
            free=free,
            fixed=self.fixed,
            start=given,
            normal_force=self.normal_force,
            points=isinstance(kind, Points),
            moving=imposed and kind.states != "steady" if isinstance(kind, Points) else None,
            turning=self.data.rotary,
            v_max=0.0 if seen is None else seen.fastest,
            v_min=slowest(kind, seen),
        )
        checks.check_names("Fit: start", given, found.names)
        values = centre(found, None if self.start == "law" else seen, given)
        try:
            if getattr(kind, "windows", None) == "choose":
                from identification.residuals.shooting import choose  # noqa: PLC0415 (slow to import)

                chosen: Any = kind
                kind = choose(chosen, found, self.data, self._quickly)
            residuals = kind.prepare(found, self.data, values)
        except ValueError as error:
            raise explained(error, findings) from None
        made = self._task(residuals, found)
        easier = tuple(self._task(r, found) for r in getattr(residuals, "easier", ()))
        made = replace(made, easier=easier)
        return Prepared(kind, found, findings, made, made.unknowns.of(values), seen)

    def live(self, noise: dict[str, float], w: Array) -> Live:
        """Return the solved problem, with its end at the coordinates `w`.

        Raises:
            ValueError: the residuals cannot be evaluated again.
        """
        asked = self.prepared()
        made = asked.task.with_noise(noise)
        point = made.at(w)
        if isinstance(point, str):
            raise ValueError(f"Fit: {asked.subject.name}: no residuals: {point}")
        return self._live(asked, made, point)

    def _live(self, asked: "Prepared", made: Task, point: Point) -> Live:
        """Return the problem with its minimum and its uncertainty."""
        found = dict(zip(made.residuals.names, point.values.tolist(), strict=True))
        drive = asked.subject.drive
        mass = None if drive is None else float(found.get("m", drive.m))
        largest = strongest(asked.kind, self.data, asked.seen, mass)
        levels = levels_of(asked.subject, largest, self.data.rotary)
        certain = covariance(made, point, levels)
        return Live.of(asked.kind, asked.subject, self.data, made, point, certain)

    def _quickly(self, kind: Kind, data: Dataset) -> dict[str, float] | None:
        """Return the values of a fit to other data, from one start and without a verdict."""
        asked = replace(self, kind=kind, data=data).prepared()
        end = descend(asked.task, asked.centre, 0, min(self.evaluations, QUICK))
        return asked.task.unknowns.named(end.w) if np.isfinite(end.cost) else None

    def _task(self, residuals: Residuals, found: Subject) -> Task:
        """Return the least-squares problem of residuals."""
        unknowns = unknowns_of(
            (*found.unknowns, *residuals.own), found.ties, residuals.names, found.held
        )
        rows = sum(c.t.size for c in residuals.channels)
        if rows < len(unknowns.unknowns):
            raise ValueError(
                f"Fit: expected at least {len(unknowns.unknowns)} residuals for as many unknowns, "
                f"got {rows}; hold some, or add data"
            )
        return task(residuals, unknowns, self.noise, self.loss, found.guard)

    def _result(
        self, asked: "Prepared", starts: tuple[Start, ...], end: Start, point: Point,
        throw: bool, seconds: float,
    ) -> Fitted:  # fmt: skip
        made = asked.task.with_noise(end.noise)
        verdict = judge(made, point, asked.findings)
        status, message = _status(end, verdict, remaining(made, point) / max(point.cost, 1e-300))
        if status is Status.DOUBTFUL:
            message += _unseen(asked)
        question = Asked(replace(self, kind=asked.kind), dict(made.noise), point.w)
        result = fitted(
            self._live(asked, made, point), starts, verdict, tuple(asked.findings), status=status,
            message=message, seconds=seconds, call=f"{written(self)}.solve()", asked=question,
        )  # fmt: skip
        if throw and not status.ok:
            raise SolveError(f"Fit: {asked.subject.name}: {result.message}", status, result)
        return result


@final
@dataclass(frozen=True, eq=False)
class Prepared:
    """A fit before its solution.

    Attributes:
        kind: type of residuals, with its entries of `free`.
        subject: fitted law, machine or model.
        findings: warnings on the data.
        task: the least-squares problem.
        centre: coordinates of the first start, shape (n,).
        seen: velocity and force, if the data have them.
    """

    kind: Kind
    subject: Subject
    findings: Findings
    task: Task
    centre: Any
    seen: Measured | None


def _status(end: Start, verdict: Verdict, gain: float) -> tuple[Status, str]:
    """Return the status of the fit and its message; for `gain` see `Verdict.status`."""
    status, message = verdict.status(end.status, gain), end.message
    if status is Status.DOUBTFUL and not end.status.ok:
        message = f"The search was not finished; a better fit may be near: {message}"
    messages = [message, *verdict.sentences]
    return status, " ".join(_sentence(text) for text in messages if text)


def _unseen(asked: Prepared) -> str:
    """Return a message on the limits of inverse dynamics for a law with states."""
    law = asked.subject.law
    if law is None or not law.states or not isinstance(asked.kind, InverseDynamics):
        return ""
    return (
        f" The states of {type(law).__name__} follow the measured velocity, which noise and "
        "sampling make inaccurate near rest: use Fit(Shooting(windows=1.0), ...), which simulates."
    )


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text[0].upper()}{text[1:]}."


def _to_kind(kind: Kind, free: Any) -> tuple[Kind, Any]:
    """Return the residuals with their entries of `free`, and the rest of `free`."""
    if not isinstance(free, Mapping):
        return kind, free
    given: dict[str, Any] = dict(free)  # pyright: ignore[reportUnknownArgumentType]
    mine = {name: given.pop(name) for name in OF_KIND if name in given}
    known = {item.name for item in fields(kind)}  # pyright: ignore[reportArgumentType]
    for name in mine:
        if name not in known:
            raise ValueError(
                f"Fit: free: expected parameters, got {name}, which {type(kind).__name__} lacks; "
                "Shooting has start values and a dead time"
            )
    return (replace(kind, **mine) if mine else kind), given  # pyright: ignore[reportArgumentType, reportUnknownVariableType]


def _check_kind(fit: Fit) -> None:
    if isinstance(fit.kind, type) or not callable(getattr(fit.kind, "prepare", None)):
        such = "a type of residuals, such as Points(), InverseDynamics() or Shooting()"
        raise checks.refused("Fit: kind", such, fit.kind)


def _check_data(fit: Fit) -> None:
    checks.kind("Fit: data", fit.data, Dataset, "data, such as Dataset.read('run.csv')")


def _check_loss(fit: Fit) -> None:
    checks.choice("Fit: loss", fit.loss, THRESHOLD)


def _check_counts(fit: Fit) -> None:
    checks.count("Fit: starts", fit.starts, most=MOST_STARTS)
    checks.count("Fit: seed", fit.seed, least=0)
    checks.count("Fit: evaluations", fit.evaluations, least=2)


def _check_start(fit: Fit) -> None:
    if isinstance(fit.start, str):
        checks.choice("Fit: start", fit.start, ("data", "law"))
        return
    for name, value in checks.named("Fit: start", fit.start).items():
        checks.number(f"Fit: start: {name}", value)
