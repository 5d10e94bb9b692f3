"""Public class `Fit`: fit a law, a machine or a model to measured data.

    data = Dataset.read("run*.csv", units="rad, N m")
    fit = Fit(Shooting(windows=4.0), "lugre", data, free={"sigma_0": log(1e3, 1e7)}).solve()

Steps: data, type of residuals, unknowns, least squares from several starts, verdict, result.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple, final

import numpy as np

from identification.data.dataset import Dataset
from identification.data.findings import Findings
from identification.residuals.evaluation import THRESHOLD, Array, Residuals
from identification.residuals.inverse import PART, InverseDynamics, InverseRows
from identification.residuals.points import PointRows, Points
from identification.result.build import fitted, tried, written
from identification.result.fitted import Fitted
from identification.result.parts import Asked, Kind, Live, expanded, matters
from identification.solving.descent import Progress, Start, best_of, descend, many_starts
from identification.solving.task import Task, remaining, task
from identification.starts.measured import Measured, measured, roles
from identification.starts.start import centre
from identification.unknowns.subject import Subject, subject
from identification.unknowns.unknowns import Unknowns, scattered, unknowns_of
from identification.verdict.covariance import Levels
from identification.verdict.judge import Verdict, judge
from symfric.foundation import checks
from symfric.foundation.status import SolveError, Status

MOST_STARTS = 10_000
QUICK = 40
"""Largest number of evaluations of a fit that selects a setting or adds dead times."""
SMALL = 0.1
"""Largest dead time [samples] in which residuals of long records are taken as linear."""
LONGEST = 30
"""Largest dead time that is estimated [samples]."""


@final
@dataclass(frozen=True, eq=False)
class Fit:
    """Least-squares fit of a law, a machine or a model to data.

        minimise over p, sigma   sum_s n_s ln sigma_s^2 + sum_i loss(r_i(p) / sigma_s(i))

    Attributes:
        kind: type of residuals: `Points()`, `InverseDynamics()`, `Shooting()`, `ClosedLoop()`.
        what: a law or its text ("stribeck", "asymmetric(coulomb+viscous)"), a scene, or a model. A
            law becomes the friction of a `Drive`.
        data: one or several records.
        free: names, or name -> a start value, (lower, upper), `log(...)`, `linear(...)`,
            `above(name)`, `tied(name, factor)`. These are fitted in addition to the parameters
            fitted by their role; of a model, all are. "x0" and "dead_time" are passed to `kind`.
        fixed: name -> value of parameters held constant; "others": all that are not in `free`.
        normal_force: normal force of a law [N]; with 1 N its coefficients are forces.
        noise: "estimate", or signal -> standard deviation [SI], also of positions that are not
            compared; others are estimated.
        loss: "squares", or a loss robust against outliers: "huber", "soft_l1", "cauchy", "arctan".
        starts: largest number of starts; fewer if others are unnecessary (see `many_starts`).
        start: parameter -> value; or "data", estimates from the data; or "law", values of the law.
        seed: random seed of the starts after the first.
        evaluations: limit of residual evaluations of a start; twice as many for the best start.

    Raises:
        ValueError: invalid arguments; from `solve`, invalid names and bounds, all in one error.
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
        for name, check in CHECKS.items():
            try:
                check(f"Fit: {name}", getattr(self, name))
            except ValueError as error:
                problems.append(str(error))
        if problems:
            raise ValueError("; ".join(problems))

    def solve(
        self, executor: Executor | None = None, progress: Progress | None = None, throw: bool = True
    ) -> Fitted:
        """Solve the fit.

        Args:
            executor: executor of `concurrent.futures` for the starts; the result is bit-identical.
            progress: called with a text and the completed fraction, 1.0 after all starts.
            throw: raise `SolveError` if the result is unusable; its `partial` is the result.

        Raises:
            ValueError: data or names cannot be used.
            SolveError: no start has residuals; with `throw`, also if the fit did not reach a
                minimum, or if data or residuals make the result implausible.
        """
        begun = perf_counter()
        throw = checks.flag("Fit: throw", throw)
        if progress is not None:
            checks.function("Fit: progress", progress, "a function of a text and a fraction")
        asked = self.prepared()
        made, kind = asked.task.part, asked.kind
        first = scattered(made.unknowns, asked.centre, self.starts, self.seed)
        starts = many_starts(made, first, executor, progress, self.evaluations)
        end, ends = best_of(starts), tried(made, starts)
        whole, asked = asked, asked._replace(task=made)
        live = self._live(asked, end.noise, end.w)
        if isinstance(live, str):
            message = f"Fit: {asked.subject.name}: no start has residuals: {live}"
            raise SolveError(message, Status.NOT_FINITE)
        tell: Progress = progress or (lambda text, share: None)
        for again in (partial(self._completed, whole), self._whitened, self._delayed):
            tell("further fits from there", 1.0)
            if end.status is Status.INTERRUPTED or (found := again(asked, live)) is None:
                continue
            asked, live, end = found
            best = replace(
                ends[0], cost=end.cost, status=end.status, message=end.message,
                evaluations=ends[0].evaluations + end.evaluations, values=live.values,
            )  # fmt: skip
            ends = (best, *ends[1:])
        tell("verdict and intervals", 1.0)
        verdict = judge(live.minimum.short, asked.findings, live.levels)
        gain = remaining(live.task, live.point) / max(live.point.cost, 1e-300)
        status, message = _status(asked, end, verdict, gain)
        result = fitted(
            live, ends, verdict, tuple(asked.findings),
            status=status, message=message, seconds=perf_counter() - begun,
            call=f"{written(self)}.solve()", kind=kind,
            asked=Asked(replace(self, kind=asked.kind), dict(live.task.noise), live.point.w),
        )  # fmt: skip
        if throw and not status.ok:
            raise SolveError(f"Fit: {asked.subject.name}: {result.message}", status, result)
        return result

    def _completed(self, whole: "FitSetup", asked: "FitSetup", live: Live) -> "Refined | None":
        """Fit all rows, starting at the values fitted to part of them."""
        if asked.task is whole.task:
            return None
        return self._refined(whole, live.point.w, self.evaluations)

    def _whitened(self, asked: "FitSetup", live: Live) -> "Refined | None":
        """Fit again with the noise of the path linearised at the values of a first fit."""
        kind, rows = asked.kind, live.task.residuals
        if not (isinstance(kind, Points) and isinstance(rows, PointRows) and rows.noises):
            return None
        made = replace(live.task, residuals=rows.whitened(live.point.values))
        kind = replace(kind, near=live.values)
        return self._refined(asked._replace(kind=kind, task=made), live.point.w, self.evaluations)

    def _delayed(self, asked: "FitSetup", live: Live) -> "Refined | None":
        """Fit again with dead times; return None if the data do not determine them."""
        kind = asked.kind
        if not isinstance(kind, InverseDynamics) or kind.dead_time != "auto":
            return None
        rows = live.task.residuals
        if not isinstance(rows, InverseRows) or not matters(live, rows):
            return None
        step = max(record.median_step for record in self.data)
        bounds = (0.0, float(f"{LONGEST * step:.3g}"))
        kind = replace(kind, dead_time=bounds)
        try:
            residuals = rows.delayed(*bounds)
            unknowns = _unknowns(residuals, asked.subject)
        except ValueError:  # a law depends on the force, or few residuals
            return None
        made = replace(live.task, residuals=residuals, unknowns=unknowns)
        changed = asked._replace(kind=kind, task=made)
        start, most, found = unknowns.of(live.values), min(self.evaluations, QUICK), None
        if live.task.rows > PART:  # small dead times do not need an interpolated force
            small = replace(made, residuals=expanded(residuals))
            found = self._refined(changed._replace(task=small), start, most)
        if found is None or found.live.dead_time > SMALL * step:
            found = self._refined(changed, start, most)
        if found is None or not found.end.status.ok or found.live.minimum.held.any():
            return None
        lost, before = (one.minimum.sandwich.null.shape[1] for one in (found.live, live))
        return None if lost > before else found

    def _refined(self, asked: "FitSetup", w: Array, evaluations: int) -> "Refined | None":
        """Solve a changed problem from the coordinates `w`; return None without residuals."""
        end = descend(asked.task.reduced(w), w, 0, evaluations)
        live = self._live(asked, end.noise, end.w)
        return None if isinstance(live, str) else Refined(asked, live, end)

    def prepared(self) -> "FitSetup":
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
            v_min=seen.slowest if seen is not None and isinstance(kind, Points) else 0.0,
            natural=None if seen is None or self.start == "law" else seen.natural,
        )
        checks.check_names("Fit: start", given, found.names)
        values = centre(found, None if self.start == "law" else seen, given)

        def posed(residuals: Residuals) -> Task:
            unknowns = _unknowns(residuals, found)
            return task(residuals, unknowns, noise, self.loss, found.guard)

        try:
            kind, noise = _with_noise(kind, self.noise, found, self.data)
            if getattr(kind, "windows", None) == "choose":
                from identification.residuals.shooting import choose  # noqa: PLC0415 (slow to import)

                chosen: Any = kind
                kind = choose(chosen, found, self.data, self._quickly)
            residuals = kind.prepare(found, self.data, values)
        except ValueError as error:  # an error found in the data explains it
            if not findings.errors:
                raise
            sentence = findings.errors[0].sentence.rstrip(".")
            raise ValueError(f"data '{findings.name}': {sentence}; then {error}") from None
        easier = tuple(map(posed, getattr(residuals, "easier", ())))
        made = replace(posed(residuals), easier=easier)
        return FitSetup(kind, found, findings, made, made.unknowns.of(values), seen)

    def live(self, noise: dict[str, float], w: Array) -> Live:
        """Return the solved problem at the coordinates `w` of its solution.

        Raises:
            ValueError: the residuals cannot be evaluated again.
        """
        asked = self.prepared()
        found = self._live(asked, noise, w)
        if isinstance(found, str):
            raise ValueError(f"Fit: {asked.subject.name}: no residuals: {found}")
        return found

    def _live(self, asked: "FitSetup", noise: dict[str, float], w: Array) -> Live | str:
        """Return the problem at the coordinates `w` of its solution, or a message on failure."""
        made = asked.task.with_noise(noise)
        point = made.at(w)
        if isinstance(point, str):
            return point
        values = dict(zip(made.residuals.names, point.values.tolist(), strict=True))
        drive = asked.subject.drive
        mass = None if drive is None else float(values.get("m", drive.m))
        seen, kind = asked.seen, asked.kind
        loaded = isinstance(kind, Points) and (
            kind.N is not None or any("N" in r for r in self.data)
        )
        largest = None if seen is None or loaded else seen.strongest(mass)
        v = np.zeros(1) if seen is None else seen.v
        levels = Levels.of(asked.subject, values, largest, v, self.data.rotary)
        return Live(kind, asked.subject, self.data, made, point, levels)

    def _quickly(self, kind: Kind, data: Dataset) -> dict[str, float] | None:
        """Fit other data from one start without a verdict; return the values, None if it fails."""
        asked = replace(self, kind=kind, data=data).prepared()
        end = descend(asked.task, asked.centre, 0, min(self.evaluations, QUICK))
        return asked.task.unknowns.named(end.w) if np.isfinite(end.cost) else None


def _unknowns(residuals: Residuals, found: Subject) -> Unknowns:
    """Return the coordinates of the fitted values.

    Raises:
        ValueError: fewer residuals than unknowns.
    """
    own = (*found.unknowns, *residuals.own)
    unknowns = unknowns_of(own, found.ties, residuals.names, found.held)
    rows = sum(c.t.size for c in residuals.channels)
    if rows < len(unknowns.unknowns):
        raise ValueError(
            f"Fit: expected at least {len(unknowns.unknowns)} residuals for as many unknowns, "
            f"got {rows}; hold some, or add data"
        )
    return unknowns


class FitSetup(NamedTuple):
    """Complete definition of a fit before its solution.

    Attributes:
        kind: type of residuals, including the entries of `free` that belong to it.
        subject: fitted law, machine or model.
        findings: warnings on the data.
        task: the least-squares problem.
        centre: coordinates of the first start, shape (n,).
        seen: measured velocity and force, if the data contain them.
    """

    kind: Kind
    subject: Subject
    findings: Findings
    task: Task
    centre: Any
    seen: Measured | None


class Refined(NamedTuple):
    """Fit that started from the values of a first fit."""

    asked: FitSetup
    live: Live
    end: Start


def findings_of(kind: object, data: Dataset) -> Findings:
    """Return the findings of the data check for these residuals."""
    if isinstance(kind, Points):
        return data.check()
    return data.check(**{p: n for p, n in roles(kind).items() if any(n in r for r in data)})


def _status(asked: FitSetup, end: Start, verdict: Verdict, gain: float) -> tuple[Status, str]:
    """Return status and message of the fit; `gain` is an argument of `Verdict.status`."""
    status, message = verdict.status(end.status, gain), end.message
    if status is Status.DOUBTFUL and not end.status.ok:
        message = f"The search was not finished; a better fit may be near: {message}"
    texts = [text for text in (message, *verdict.sentences) if text]
    message = " ".join(t if t.endswith(".") else f"{t[0].upper()}{t[1:]}." for t in texts)
    law, follows = asked.subject.law, isinstance(asked.kind, InverseDynamics)
    if status is Status.DOUBTFUL and law is not None and law.states and follows:
        message += (
            f" The states of {type(law).__name__} follow the measured velocity, which noise and "
            "sampling make inaccurate near rest: use Fit(Shooting(windows=1.0), ...), which "
            "simulates."
        )
    return status, message


def _to_kind(kind: Kind, free: Any) -> tuple[Kind, Any]:
    """Pass start values and dead times to the residuals; return them and the other entries."""
    if not isinstance(free, Mapping):
        return kind, free
    given: dict[str, Any] = dict(free)  # pyright: ignore[reportUnknownArgumentType]
    mine = {name: given.pop(name) for name in ("x0", "dead_time") if name in given}
    known = {item.name for item in fields(kind)}  # pyright: ignore[reportArgumentType]
    for name in mine:
        if name not in known:
            raise ValueError(
                f"Fit: free: expected parameters, got {name}, which {type(kind).__name__} lacks; "
                "Shooting has start values and a dead time"
            )
    return (replace(kind, **mine) if mine else kind), given  # pyright: ignore[reportArgumentType, reportUnknownVariableType]


def _with_noise(kind: Kind, noise: Any, found: Subject, data: Dataset) -> tuple[Kind, Any]:
    """Pass the noise of channels of the motion to the residuals; return both."""
    if not isinstance(noise, Mapping) or not isinstance(kind, Points | InverseDynamics):
        return kind, noise
    given = checks.named("Fit: noise", noise)
    motion = [n for n in kind.motion_channels(found) if any(n in r for r in data)]
    mine = {n: given.pop(n) for n in motion if n in given}
    return replace(kind, noise=mine or kind.noise), given


def _check_kind(where: str, kind: object) -> None:
    if isinstance(kind, type) or not callable(getattr(kind, "prepare", None)):
        such = "a type of residuals, such as Points(), InverseDynamics() or Shooting()"
        raise checks.refused(where, such, kind)


def _check_start(where: str, start: object) -> None:
    if isinstance(start, str):
        checks.choice(where, start, ("data", "law"))
        return
    for name, value in checks.named(where, start).items():
        checks.number(f"{where}: {name}", value)


CHECKS: Mapping[str, Callable[[str, Any], object]] = {
    "kind": _check_kind,
    "data": partial(checks.kind, wanted=Dataset, such_as="data, such as Dataset.read('run.csv')"),
    "loss": partial(checks.choice, choices=THRESHOLD),
    "starts": partial(checks.count, most=MOST_STARTS),
    "seed": partial(checks.count, least=0),
    "evaluations": partial(checks.count, least=2),
    "start": _check_start,
}
