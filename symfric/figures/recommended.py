"""Softest regularisation of a law that a wanted error allows in a given machine."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import floor, inf, isfinite, log, log10
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, final

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.regularisation import (
    Machine,
    Measure,
    Regularisation,
    Sample,
    distance,
    machine_of,
    regularisation,
    sample,
)
from symfric.foundation import checks
from symfric.foundation.parameters import parameters
from symfric.foundation.shown import WIDTH, Showing, Shown
from symfric.foundation.status import SolveError, Status
from symfric.integrator.equations.inputs import Input
from symfric.laws import Law
from symfric.laws.base.law import check_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATIO = 4.0
"""From one width of the curve to the next."""
SLOWEST = 0.2
"""Orders below this are none: the curve has not settled."""
SHARE = 0.2
"""Part of the wanted error that may be the reference's own."""
MARGIN = 0.8
"""Part of the wanted error that is aimed at between two widths of the curve."""
DRIEST, SOFTEST = 20, 5
"""Widths tried on either side of that of the law."""
MOST_STEPS = 400_000
"""Attempts of a run, seconds at most."""
FINEST = 1e-11
"""Smallest relative tolerance of a run of the curve."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Recommendation(Showing):
    """Law as smooth as a wanted error allows.

    Attributes:
        law: with its width or stiffness set.
        values: the parameters that were set.
        error: of a run of `law` at `rtol`, measured: the largest difference from dry friction
            relative to the motion, and what the reference may be off.
        wanted: the given error.
        uncertain: the part of `error` that is the reference's.
        order: in which the error falls with the width where it was chosen; NaN where nothing
            depends on it.
        reference: what dry friction is here.
        rtol: relative tolerance that the error includes.
        steps, attempts: of that run.
        time_s: its CPU time [s].
        curve: error, steps and CPU time against the parameter, of runs in which the integrator's
            error is negligible.
    """

    law: Law
    values: dict[str, float]
    error: float
    wanted: float
    uncertain: float
    order: float
    reference: str
    rtol: float
    steps: int
    attempts: int
    time_s: float
    curve: FigureData

    def __str__(self) -> str:
        """Return the result in a sentence."""
        found = ", ".join(f"{name} = {value:g}" for name, value in self.values.items())
        return (
            f"{type(self.law).__name__}: {found} is off {self.reference} by {self.error:.2g} "
            f"({self.wanted:g} wanted) at rtol = {self.rtol:g}, in {self.steps} steps"
        )

    def shown(self) -> Shown:
        """Return the result in a sentence."""
        return Shown("recommended", tuple(wrap(str(self), WIDTH)))

    def thumbnail(self) -> "Figure":
        """Return the curve."""
        return self.plot()

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the curve; save it to `path` if given."""
        return self.curve.plot(path)


def recommended(
    law: Law,
    scene: object,
    error: float,
    *,
    t_end: float | None = None,
    parameter: str | Iterable[str] | None = None,
    exact: Law | None = None,
    of: Measure | None = None,
    u: Mapping[str, Input] | None = None,
    rtol: float = 1e-6,
) -> Recommendation:
    """Set what makes `law` smooth so that its motion is `error` off that with dry friction.

        error = max |x - x_dry| / (largest - smallest value of x_dry)     over signals and times

    The widths of the law shrink in steps of 4 until three runs settle into a power of the width,
    which says how far the last is from the limit (Richardson): that run is x_dry. The softest width
    is chosen below which every run keeps the error; a run at `rtol` verifies it.

    Args:
        law: where the search starts.
        scene: a machine (`FourMass`, `FourMass(law, k=3.0)`) or a function law -> Model. The width
            that an error needs depends on the machine and on how long it runs.
        error: wanted, relative to the size of the motion; between 0 and 1.
        t_end: end of the motion [s]; that of the scene.
        parameter: what is scaled, if it is not what the roles say (`regularisation`): stiffnesses
            of bristles, v_t, widths. Several are scaled together, stiffnesses inversely.
        exact: a law without regularisation, such as `ExactCoulomb`, to compare with instead of the
            limit of `law` itself. Then differences of their levels are errors that no width mends.
        of: what is compared: names of signals, or a function that takes numbers from a trajectory,
            such as the period of a cycle, where an error of phase would grow with time; by default
            positions, which are the states of the machine that are no rates of others.
        u: inputs, as for `simulate`.
        rtol: relative tolerance that the law is going to be run with.

    Raises:
        ValueError: bad input.
        SolveError: the error is not reached; the message says which one is, `partial` is the curve.

    Limits: a motion that has no limit, such as a chaotic one over a long time, does not settle;
    shorten it or compare other numbers. Runs are seen at 2001 times.
    """
    where = "recommended"
    check_law(f"{where}: law", law)
    wanted = checks.number(f"{where}: error", error, above=0.0, upper=1.0)
    rtol = checks.number(f"{where}: rtol", rtol, lower=1e-12, upper=1e-3)
    machine = machine_of(where, scene, t_end, of, u, law)
    search = _Search(machine, regularisation(where, law, parameter), wanted, rtol)
    if exact is None:
        search.settle()
    else:
        check_law(f"{where}: exact", exact)
        search.compare(exact)
    return search.choose()


@final
class _Search:
    """Runs along the curve, driest last."""

    def __init__(self, machine: Machine, knob: Regularisation, wanted: float, rtol: float) -> None:
        self.machine, self.knob, self.wanted, self.rtol = machine, knob, wanted, rtol
        self.fine = max(FINEST, min(0.1 * rtol, 1e-3 * wanted))
        self.runs: list[Sample] = []
        self.reference: Sample | None = None
        self.about, self.uncertain = "", inf

    def run(self, s: float, rtol: float) -> Sample:
        """Return the machine with the widths at the factor `s`."""
        law, values = self.knob.at(s), self.knob.values(s)
        return sample(self.machine, law, rtol, s, values, max_steps=MOST_STEPS)

    def drier(self) -> None:
        """One more run, its widths a quarter of those before."""
        s = self.runs[-1].s / RATIO if self.runs else 1.0
        if len(self.runs) > DRIEST:
            self.give_up("the curve has not settled by then")
        try:
            self.runs.append(self.run(s, self.fine))
        except SolveError as problem:
            if self.runs:
                self.give_up(f"beyond: {problem}", problem)
            given = f"recommended: {self.shown(s)}, where the search starts: {problem}"
            raise SolveError(given, problem.status, problem.partial) from problem
        except ValueError as problem:
            if not self.runs:
                raise
            self.give_up(f"beyond: {problem}", problem)

    def settle(self) -> None:
        """Go on until the limit is known well enough, and take the last run for it."""
        while self.uncertain > SHARE * self.wanted:
            self.drier()
            self.uncertain = self.remaining()
        self.reference, last = self.runs[-1], self.runs[-1].values
        self.about = ", ".join(f"{name} = {value:.3g}" for name, value in last.items())

    def compare(self, exact: Law) -> None:
        """Go on until two runs keep the wanted error off the motion with the law `exact`."""
        own = replace(self.machine, free=False)
        self.reference = sample(own, exact, self.fine)
        self.about, self.uncertain = type(exact).__name__, self.fine
        while len(self.runs) < 2 or max(map(self.off, self.runs[-2:])) > self.wanted:
            self.drier()
            last = [self.off(run) for run in self.runs[-4:]]
            if len(last) > 3 and min(last[1:]) >= last[0]:
                self.give_up(f"it does not tend to {self.about}: do their levels differ?")

    def remaining(self) -> float:
        """Distance of the last run from the limit, from how the last four follow each other.

        With differences d and D before, and D/d = 4^q, the sum of all that follow is d / (4^q - 1).
        """
        if len(self.runs) < 3:
            return inf
        gaps = [distance(a, b) for a, b in pairwise(self.runs[-4:])]
        if max(gaps[-2:]) < 1e-2 * self.wanted:
            return max(gaps[-2:])
        if len(gaps) < 3 or not all(isfinite(gap) and gap > 0 for gap in gaps):
            return inf
        orders = [log(a / b) / log(RATIO) for a, b in pairwise(gaps)]
        slowest = min(orders)
        return gaps[-1] / (RATIO**slowest - 1.0) if slowest > SLOWEST else inf

    def off(self, run: Sample) -> float:
        """Error of a run and of the reference together; infinite where they are not comparable."""
        if self.reference is None:
            return inf
        return distance(run, self.reference) + self.uncertain

    def choose(self) -> Recommendation:
        """Return the softest width below which all keep the wanted error, verified."""
        if self.off(self.runs[0]) <= self.wanted:
            self.soften()
        errors = [self.off(run) for run in self.runs]
        kept = len(errors)
        while kept and errors[kept - 1] <= self.wanted:
            kept -= 1
        # runs[kept] is the softest that keeps it, runs[kept - 1] the driest that does not
        keeps = self.runs[kept].s
        factors, order = [keeps], float("nan")
        if kept:
            order = log(errors[kept - 1] / errors[kept]) / log(RATIO) if errors[kept] else inf
            between = keeps * (MARGIN * self.wanted / errors[kept]) ** (1 / order)
            factors.insert(0, self.rounded(min(max(between, keeps), keeps * RATIO)))
        found = inf
        for s in (*factors, keeps / RATIO):
            run = self.run(s, self.rtol)
            found = self.off(run)
            if found <= self.wanted:
                return self.recommendation(run, found, order)
        return self.give_up(
            f"with rtol = {self.rtol:g} the run at {self.shown(keeps)} is off by {found:.2g}, "
            f"without the integrator's part by {errors[kept]:.2g}; tighten rtol"
        )

    def soften(self) -> None:
        """Widen while the error is kept, as far as the law allows."""
        for _ in range(SOFTEST):
            s = self.runs[0].s * RATIO
            try:
                self.runs.insert(0, self.run(s, self.fine))
            except (SolveError, ValueError):
                return  # beyond a bound of the law or of what can be simulated
            if self.off(self.runs[0]) > self.wanted:
                return

    def rounded(self, s: float) -> float:
        """Return a factor at which the first parameter has two digits, on the dry side."""
        name = self.knob.names[0]
        value = self.knob.values(s)[name]
        size = 10.0 ** (floor(log10(value)) - 1)
        digits = value / size
        grows = self.knob.values(0.5)[name] > self.knob.values(1.0)[name]
        return self.knob.factor((-floor(-digits) if grows else floor(digits)) * size)

    def shown(self, s: float) -> str:
        """Return the parameters at a factor."""
        return ", ".join(f"{name} = {value:.3g}" for name, value in self.knob.values(s).items())

    def recommendation(self, run: Sample, error: float, order: float) -> Recommendation:
        """Return the result, with the curve."""
        return Recommendation(
            self.knob.at(run.s), run.values, error, self.wanted, self.uncertain, order, self.about,
            self.rtol, run.steps, run.attempts, run.time_s, self.curve(),
        )  # fmt: skip

    def curve(self) -> FigureData:
        """Error, steps and time of the runs so far; without a reference, against the last."""
        if self.reference is None and self.runs:
            self.reference, self.uncertain = self.runs[-1], 0.0
        name = self.knob.names[0]
        seen = [run for run in self.runs if run is not self.reference]
        columns = {
            name: [run.values[name] for run in seen],
            "error": [self.off(run) for run in seen],
            "steps": [run.steps for run in seen],
            "time": [run.time_s for run in seen],
        }
        curve = Curve(
            type(self.knob.law).__name__, "", {k: np.array(v) for k, v in columns.items()}
        )
        unit = parameters(self.knob.law)[name].unit
        return FigureData(
            "recommended",
            f"{self.machine.name}, {self.machine.t_end:g} s: error against dry friction",
            {name: unit, "error": "1", "steps": "1", "time": "s"},
            ((name, "error"), (name, "steps"), (name, "time")),
            (curve,),
            log=tuple(columns),
            dots=True,
        )

    def give_up(self, why: str, cause: BaseException | None = None) -> Recommendation:
        """Say what was reached.

        Raises:
            SolveError: always.
        """
        last = self.runs[-1]
        curve = self.curve()
        errors = curve.curves[0]["error"]
        best = f"{errors.min():.2g}" if errors.size else "unknown"
        law = type(self.knob.law).__name__
        message = (
            f"recommended: {law} does not keep an error of {self.wanted:g} in {self.machine.name}: "
            f"tried to {self.shown(last.s)}, the smallest error is {best}; {why}"
        )
        raise SolveError(message, Status.SOLVER_FAILED, curve) from cause
