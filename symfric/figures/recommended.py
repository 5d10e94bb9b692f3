"""Largest smoothing of a law that a required error allows in a given machine."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import floor, inf, isfinite, log, log10, nan
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
from symfric.laws.base.law import require_law

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATIO = 4.0
"""Ratio of successive widths."""
SLOWEST = 0.2
"""Smallest order of convergence that is accepted."""
SHARE = 0.2
"""Largest uncertainty of the reference, as a share of the required error."""
MARGIN = 0.8
"""Share of the required error for which a width between two runs is chosen."""
DRIEST, SOFTEST = 20, 5
"""Largest numbers of narrower widths and of wider widths."""
MOST_STEPS = 400_000
"""Largest number of attempts of a run."""
FINEST = 1e-11
"""Smallest relative tolerance of a run."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Recommendation(Showing):
    """Law that is as smooth as a required error allows.

    Attributes:
        law: the law with the recommended width or stiffness.
        values: the parameters that were set.
        error: error of a run of `law` at `rtol`, the largest difference from dry friction relative
            to the motion plus the uncertainty of the reference.
        wanted: the required error.
        uncertain: uncertainty of the reference, which is included in `error`.
        order: order of the error in the width at the recommended width; NaN if it was not needed.
        reference: description of the reference.
        rtol: relative tolerance of the run.
        steps, attempts: accepted steps and attempted steps of the run.
        time_s: CPU time of the run [s].
        curve: error, steps and CPU time against the parameter, for runs with a negligible error of
            the integrator.
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
        """Return the result as a sentence."""
        values = ", ".join(f"{name} = {value:g}" for name, value in self.values.items())
        return (
            f"{type(self.law).__name__}: {values} is off {self.reference} by {self.error:.2g} "
            f"({self.wanted:g} wanted) at rtol = {self.rtol:g}, in {self.steps} steps"
        )

    def shown(self) -> Shown:
        """Describe the result in a sentence."""
        return Shown("recommended", tuple(wrap(str(self), WIDTH)))

    def thumbnail(self) -> "Figure":
        """Return the figure of `curve`."""
        return self.plot()

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw `curve`; save the figure to `path` if given."""
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
    """Return `law` with the largest smoothing for which the error from dry friction is `error`.

        error = max |x - x_dry| / (largest - smallest value of x_dry)     over signals and times

    The widths of the law are reduced in steps of 4 until successive differences of the runs follow
    a power of the width. Then the distance of the last run from the limit is known (Richardson),
    and this run is x_dry. The result is the largest width below which all runs satisfy `error`,
    verified by a run at `rtol`.

    Args:
        law: law at which the search starts.
        scene: a machine (`FourMass`, `FourMass(law, k=3.0)`) or a function law -> Model. The width
            for a given error depends on the machine and on the length of its motion.
        error: required error relative to the size of the motion, between 0 and 1.
        t_end: end of the motion [s]; by default that of the scene.
        parameter: names of the scaled parameters, by default those of certain roles, see
            `regularisation`: stiffnesses of bristles, v_t, widths. Several parameters are scaled
            together, stiffnesses inversely.
        exact: a law without regularisation, such as `ExactCoulomb`, used as the reference instead
            of the limit of `law`. Then different levels of friction cause errors at any width.
        of: names of the compared signals, by default the positions, which are the states of the
            machine that are not rates of other states; or a function of a trajectory, such as the
            period of a cycle, if phase errors would grow with time.
        u: inputs, as for `simulate`.
        rtol: relative tolerance at which the law will be used.

    Raises:
        ValueError: bad input.
        SolveError: the error is not reached; the message states the smallest error, and `partial`
            is the curve.

    Limits: a motion that does not converge, such as a long chaotic motion, has no reference;
    shorten it or compare other numbers. Runs are compared at 2001 times.
    """
    where = "recommended"
    require_law(f"{where}: law", law)
    wanted = checks.number(f"{where}: error", error, above=0.0, upper=1.0)
    rtol = checks.number(f"{where}: rtol", rtol, lower=1e-12, upper=1e-3)
    machine = machine_of(where, scene, t_end, of, u, law)
    search = _Search(machine, regularisation(where, law, parameter), wanted, rtol)
    if exact is None:
        search.settle()
    else:
        require_law(f"{where}: exact", exact)
        search.compare(exact)
    return search.choose()


@final
class _Search:
    """Runs of the search in the order of their widths, with the narrowest last."""

    def __init__(self, machine: Machine, knob: Regularisation, wanted: float, rtol: float) -> None:
        self.machine, self.knob, self.wanted, self.rtol = machine, knob, wanted, rtol
        self.fine = max(FINEST, min(0.1 * rtol, 1e-3 * wanted))
        self.runs: list[Sample] = []
        self.reference: Sample | None = None
        self.about, self.uncertain = "", inf

    def run(self, s: float, rtol: float) -> Sample:
        """Return a run of the machine with the widths scaled by the factor `s`."""
        law, values = self.knob.at(s), self.knob.values(s)
        return sample(self.machine, law, rtol, s, values, max_steps=MOST_STEPS)

    def narrow(self) -> None:
        """Add a run with a quarter of the last widths."""
        s = self.runs[-1].s / RATIO if self.runs else 1.0
        if len(self.runs) > DRIEST:
            self.give_up("the curve has not settled by then")
        try:
            self.runs.append(self.run(s, self.fine))
        except (SolveError, ValueError) as problem:
            if self.runs:
                self.give_up(f"beyond: {problem}", problem)
            if isinstance(problem, ValueError):
                raise
            start = f"recommended: {self.shown(s)}, where the search starts: {problem}"
            raise SolveError(start, problem.status, problem.partial) from problem

    def settle(self) -> None:
        """Run until the limit is known accurately, and use the last run as the reference."""
        while self.uncertain > SHARE * self.wanted:
            self.narrow()
            self.uncertain = self.remaining()
        self.reference, self.about = self.runs[-1], self.shown(self.runs[-1].s)

    def compare(self, exact: Law) -> None:
        """Use the motion with `exact` as the reference; run until two runs satisfy the error."""
        self.reference = sample(replace(self.machine, free=False), exact, self.fine)
        self.about, self.uncertain = type(exact).__name__, self.fine
        while len(self.runs) < 2 or max(map(self.off, self.runs[-2:])) > self.wanted:
            self.narrow()
            last = [self.off(run) for run in self.runs[-4:]]
            if len(last) > 3 and min(last[1:]) >= last[0]:
                self.give_up(f"it does not tend to {self.about}: do their levels differ?")

    def remaining(self) -> float:
        """Return the distance of the last run from the limit, based on the last four runs.

        If the last difference is d and the previous one D = 4^q d, the sum of all further
        differences is d / (4^q - 1).
        """
        if len(self.runs) < 3:
            return inf
        gaps = [distance(a, b) for a, b in pairwise(self.runs[-4:])]
        if max(gaps[-2:]) < 1e-2 * self.wanted:
            return max(gaps[-2:])
        if len(gaps) < 3 or not all(isfinite(gap) and gap > 0 for gap in gaps):
            return inf
        slowest = min(log(a / b) / log(RATIO) for a, b in pairwise(gaps))
        return gaps[-1] / (RATIO**slowest - 1.0) if slowest > SLOWEST else inf

    def off(self, run: Sample) -> float:
        """Return the error of a run plus the uncertainty of the reference; inf if unknown."""
        return inf if self.reference is None else distance(run, self.reference) + self.uncertain

    def choose(self) -> Recommendation:
        """Return the largest width below which all runs satisfy the error, verified by a run."""
        if self.off(self.runs[0]) <= self.wanted:
            self.widen()
        errors = [self.off(run) for run in self.runs]
        kept = len(errors)
        while kept and errors[kept - 1] <= self.wanted:
            kept -= 1
        # runs[kept] is the widest one within the error, runs[kept - 1] the narrowest one outside
        keeps = self.runs[kept].s
        factors, order = [keeps], nan
        if kept:
            order = log(errors[kept - 1] / errors[kept]) / log(RATIO) if errors[kept] else inf
            between = keeps * (MARGIN * self.wanted / errors[kept]) ** (1 / order)
            factors.insert(0, self.rounded(min(max(between, keeps), keeps * RATIO)))
        error = inf
        for s in (*factors, keeps / RATIO):
            run = self.run(s, self.rtol)
            error = self.off(run)
            if error <= self.wanted:
                return Recommendation(
                    self.knob.at(run.s), run.values, error, self.wanted, self.uncertain, order,
                    self.about, self.rtol, run.steps, run.attempts, run.time_s, self.curve(),
                )  # fmt: skip
        return self.give_up(
            f"with rtol = {self.rtol:g} the run at {self.shown(keeps)} is off by {error:.2g}, "
            f"without the integrator's part by {errors[kept]:.2g}; tighten rtol"
        )

    def widen(self) -> None:
        """Add runs with larger widths while they satisfy the error and the law allows them."""
        for _ in range(SOFTEST):
            s = self.runs[0].s * RATIO
            try:
                self.runs.insert(0, self.run(s, self.fine))
            except (SolveError, ValueError):
                return  # out of the bounds of the law, or the simulation failed
            if self.off(self.runs[0]) > self.wanted:
                return

    def rounded(self, s: float) -> float:
        """Return a factor with two digits in the first parameter, rounded to narrower widths."""
        name, power = next(iter(self.knob.powers.items()))
        value = self.knob.values(s)[name]
        size = 10.0 ** (floor(log10(value)) - 1)
        digits = -floor(-value / size) if power < 0 else floor(value / size)
        return (digits * size / float(parameters(self.knob.law)[name].value)) ** (1 / power)

    def shown(self, s: float) -> str:
        """Return the parameters at the factor `s` as text."""
        return ", ".join(f"{name} = {value:.3g}" for name, value in self.knob.values(s).items())

    def curve(self) -> FigureData:
        """Return error, steps and time of the runs; the default reference is the last run."""
        if self.reference is None and self.runs:
            self.reference, self.uncertain = self.runs[-1], 0.0
        name, law = next(iter(self.knob.powers)), self.knob.law
        seen = [run for run in self.runs if run is not self.reference]
        columns = {
            name: [run.values[name] for run in seen],
            "error": [self.off(run) for run in seen],
            "steps": [run.steps for run in seen],
            "time": [run.time_s for run in seen],
        }
        arrays = {column: np.array(values) for column, values in columns.items()}
        return FigureData(
            "recommended",
            f"{self.machine.name}, {self.machine.t_end:g} s: error against dry friction",
            {name: parameters(law)[name].unit, "error": "1", "steps": "1", "time": "s"},
            tuple((name, column) for column in ("error", "steps", "time")),
            (Curve(type(law).__name__, "", arrays),),
            log=tuple(columns),
            dots=True,
        )

    def give_up(self, why: str, cause: BaseException | None = None) -> Recommendation:
        """Raise a `SolveError` with the smallest error and the curve of the runs so far."""
        curve, law = self.curve(), type(self.knob.law).__name__
        errors = curve.curves[0]["error"]
        best = f"{errors.min():.2g}" if errors.size else "unknown"
        message = (
            f"recommended: {law} does not keep an error of {self.wanted:g} in {self.machine.name}: "
            f"tried to {self.shown(self.runs[-1].s)}, the smallest error is {best}; {why}"
        )
        raise SolveError(message, Status.SOLVER_FAILED, curve) from cause
