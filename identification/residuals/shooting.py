"""Residuals of simulated motions, over whole records or windows of records.

    r_s(t_i) = y_s(t_i; p, x0, tau) - measured_s(t_i),    x' = f(x, u(t - tau), p),  x(t_0) = x0

The derivatives by parameters p, start values x0 of every record and window, and the dead time tau
of the inputs are those of the steps of the simulation. Any model is supported: laws with states,
several bodies, friction from reactions, laws by modes.

Short windows limit the effect of slow model errors; long windows expose them. `choose` compares
candidate lengths:

    for each quarter of every record: fit to the other quarters in windows of that length,
    simulate the quarter freely, from the start that the data determine;
    error^2 = mean over signals and quarters of  mean r^2 / variance of the signal

It selects the length with the smallest error. The procedure is deterministic.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from identification.data.dataset import Dataset
from identification.data.record import Record
from identification.residuals.evaluation import DEAD_TIME
from identification.residuals.initial import FEWEST
from identification.residuals.preparation import Preparation
from identification.residuals.shots import Shots
from identification.unknowns.subject import Subject
from symfric.foundation import checks

Solve = Callable[["Shooting", Dataset], Mapping[str, float] | None]
"""Function that fits parameters to data by windows; it returns None on failure."""
BLOCKS = 4
RTOL = 1e-6
"""Default tolerance of simulations."""
LENGTHS, LEAST = 5, 2.5
"""Number of lengths tried in addition to whole records, each half the previous one; and least
samples of a window, relative to the fewest, because short ones determine starts poorly.
"""


def choose(kind: "Shooting", subject: Subject, data: Dataset, solve: Solve) -> "Shooting":
    """Return `kind` with the window length that best predicts left-out quarters.

    Args:
        kind: residuals whose windows are chosen.
        subject: law, machine or model to fit.
        data: records; each is divided in time.
        solve: function that fits the parameters to a part of the data.

    Raises:
        ValueError: for no length can the fits be simulated.
    """
    # parts of a record have unknown starts; a tolerance sufficient for usual data saves a search
    x0 = "data" if kind.x0 == "data" else "estimate"
    fixed = replace(kind, x0=x0, rtol=kind.rtol or RTOL)
    span = max(float(r.time[-1] - r.time[0]) for r in data)
    least = LEAST * FEWEST * max(r.median_step for r in data)
    shorter = (span / 2 ** (k + 1) for k in range(LENGTHS))
    tried = [None, *(s for s in shorter if s >= least)]
    errors = {s: _left_out(replace(fixed, windows=s), subject, data, solve) for s in tried}
    best = min(errors, key=lambda s: errors[s])
    if not np.isfinite(errors[best]):
        raise ValueError(
            "Shooting: windows: expected a length whose fits can be simulated over a quarter of "
            "the data, found none; give a length [s], or better start values"
        )
    return replace(kind, windows=best)


def _left_out(kind: "Shooting", subject: Subject, data: Dataset, solve: Solve) -> float:
    """Return the mean square error of predicted quarters, relative to the signal variances."""
    found = list[float]()
    for block in range(BLOCKS):
        rest, other = list[Record](), list[Record]()
        for record in data:
            a, b = (record.size * k // BLOCKS for k in (block, block + 1))
            other.append(record.at(slice(a, b)))
            rest += [record.at(s) for s in (slice(0, a), slice(b, record.size)) if s.stop > s.start]
        try:
            values = solve(kind, Dataset(tuple(rest), data.name))
            quarters = Dataset(tuple(other), data.name)
            found.append(np.inf if values is None else _free_run(kind, subject, quarters, values))
        except ValueError:  # the remaining data have short windows or no motion
            found.append(np.inf)
    return float(np.mean(found))


def _free_run(
    kind: "Shooting", subject: Subject, data: Dataset, values: Mapping[str, float]
) -> float:
    """Return the mean square error of simulated records, relative to the signal variances."""
    shots = replace(kind, windows=None, x0="data").prepare(subject, data, values)
    own = {u.name: values[u.name] if u.name == DEAD_TIME else u.start for u in shots.own}
    predicted = shots.predicted(np.array([{**values, **own}[name] for name in shots.names]))
    if isinstance(predicted, str):
        return np.inf
    errors = [
        float(np.mean((predicted[c.rows] - c.measured) ** 2)) / size
        for c in shots.channels
        if (size := float(np.var(c.measured))) > 0
    ]
    return float(np.mean(errors)) if errors else np.inf


INTERPOLATIONS = ("linear", "hold")
ENGINES = ("auto", "simulate", "sampled")


@final
@dataclass(frozen=True, eq=False)
class Shooting:
    """Residuals of the simulated motion in named signals.

    Attributes:
        signals: compared states and outputs of the model: names, or signal -> channel of the data;
            None: all signals in the data. A record may lack some of them.
        windows: None: each record is simulated from its start; a length [s]: each record is cut
            into windows of about that length with separate start values, so that motions do not
            drift away from the measured ones; "choose": the length that predicts best on the given
            data (`choose`).
        x0: "estimate": start values of measured states and of their rates are unknowns, "x0.v[2]"
            for record 2, "x0.v[2,3]" for its window 3. So is a bristle if the law has only one;
            several bristles start in steady sliding or, if the contact sticks, unstrained. Other
            states start as in the model at the start of a record, and are unknown at the start of
            later windows. "data": start values determined by the data are held there. "given":
            records start as in the model. Or a mapping for records: state -> number, numbers (one
            per record) or "estimate"; other states as with "estimate".
        inputs: input of the model -> channel, or an input of `simulate` (a number, samples, a
            function of time); by default the channel of the same name.
        interpolation: interpolation of sampled inputs: "linear" for a measured input, "hold" for
            an input that a controller holds from each sample to the next.
        dead_time: delay of sampled inputs [s]; (low, high): estimated between these bounds as
            "dead_time". Requires linear inputs; a held input is approximately a linear input
            delayed by half a sample.
        every: compare every n-th sample; inputs use all samples.
        engine: "simulate" supports any model; "sampled" steps one mass under friction without
            states, such as a `Drive` with a static law, from sample to sample (`stepper`), about a
            hundred times faster and accurate to 1e-5 of the signals or to their noise; "auto":
            "sampled" if it supports the model and has the accuracy required of `simulate` (`rtol`).
        rtol: tolerance of the simulation; None: the largest of 1e-6, 1e-7, 1e-8 whose error shifts
            no estimate by more than a tenth of its standard error.

    Raises:
        ValueError: invalid arguments.

    Limits: over a long record, the motion from a wrong start may diverge from the measured motion
    (chaos, a contact that sticks in one motion and slides in the other): use windows or many
    starts. The dead time is common to all inputs and records.
    """

    signals: Sequence[str] | Mapping[str, str] | None = None
    windows: float | str | None = None
    x0: str | Mapping[str, Any] = "estimate"
    inputs: Mapping[str, Any] | None = None
    interpolation: str = "linear"
    dead_time: float | tuple[float, float] = 0.0
    every: int = 1
    rtol: float | None = None
    engine: str = "auto"

    def __post_init__(self) -> None:
        where = "Shooting"
        windows = self.windows
        if isinstance(windows, str):
            checks.choice(f"{where}: windows", windows, ("choose",))
        elif windows is not None:
            seconds = checks.number(f"{where}: windows", windows, unit="s", above=0.0)
            object.__setattr__(self, "windows", seconds)
        if isinstance(self.signals, Mapping):
            for channel in checks.named(f"{where}: signals", self.signals).values():
                checks.text(f"{where}: signals", channel, "signal -> name of a channel")
        elif self.signals is not None:
            checks.names(f"{where}: signals", self.signals)
        checks.named(f"{where}: inputs", self.inputs)
        if isinstance(self.x0, str):
            checks.choice(f"{where}: x0", self.x0, ("estimate", "data", "given"))
        elif self.x0 is None:  # pyright: ignore[reportUnnecessaryComparison]
            such = "'estimate', 'given', or values by state"
            raise checks.refused(f"{where}: x0", such, self.x0)
        else:
            object.__setattr__(self, "x0", checks.named(f"{where}: x0", self.x0))
        checks.choice(f"{where}: interpolation", self.interpolation, INTERPOLATIONS)
        object.__setattr__(self, "every", checks.count(f"{where}: every", self.every))
        checks.choice(f"{where}: engine", self.engine, ENGINES)
        if self.rtol is not None:
            checks.number(f"{where}: rtol", self.rtol, above=0.0, upper=0.1)
        object.__setattr__(self, "dead_time", self._checked_dead_time())

    def _checked_dead_time(self) -> float | tuple[float, float]:
        where, given = "Shooting: dead_time", self.dead_time
        if not isinstance(given, tuple):
            return checks.number(where, given, unit="s", lower=0.0)
        if len(given) != 2:
            raise checks.refused(where, "seconds, or (low, high) to estimate it between", given)
        low, high = (checks.number(where, x, unit="s", lower=0.0) for x in given)
        if low >= high:
            raise checks.refused(where, "(low, high) with low < high", given)
        if self.interpolation == "hold":
            raise ValueError(
                f"{where}: expected interpolation='linear' where it is estimated, got 'hold', "
                "whose motion has no derivative by it; a held input is about a linear one that "
                "comes half a sample later"
            )
        return low, high

    @property
    def seconds(self) -> float | None:
        """Length of windows [s]; None: whole records.

        Raises:
            ValueError: the length has not been chosen yet.
        """
        if isinstance(self.windows, str):
            raise ValueError(
                "Shooting: windows: expected a length [s] at this point, got 'choose'; use Fit"
            )
        return self.windows

    def prepare(self, subject: Subject, data: Dataset, start: Mapping[str, float]) -> Shots:
        """Return the residuals of `data`; simulations that select the tolerance run at `start`.

        Raises:
            ValueError: names that the model or the data do not have, or windows too short.
        """
        preparation = Preparation(self, subject.model, data, start)
        shots, easier = preparation.shots(), preparation.easier()
        if easier is None:
            return shots
        length, every = easier
        kind = replace(self, windows=length, rtol=shots.rtol)
        other = Preparation(kind, subject.model, data, start, every).shots()
        return replace(shots, easier=(other,))
