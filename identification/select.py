"""Comparison of several laws on one data set: accuracy, significance and cost.

    validation   root mean square error on data left out of the fit, relative to their spread
    AICc         n ln(mean square) + 2 k n / (n - k - 1)
    BIC          n ln(mean square) + k ln n

n is the effective number of samples, from the autocorrelation of the residuals of the best law in
each signal, and is the same for all laws. With the number of rows, autocorrelated residuals would
make any additional parameter appear significant. All laws are compared at their common times.
Source: Burnham and Anderson, Model Selection and Multimodel Inference, 2002.
"""

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields
from math import inf, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np

from identification.cross import (
    DIVERGED,
    Left,
    by_signal,
    cross_validate,
    excess,
    left_of,
    percent,
    relative,
    shared,
    uncertainty,
)  # fmt: skip
from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.result.fitted import Fitted
from identification.result.parts import Kind
from identification.solving.descent import Progress
from symfric.foundation import checks
from symfric.foundation.files import json_data
from symfric.foundation.shown import Shown, TextTable, columns
from symfric.foundation.status import SolveError, Status
from symfric.laws import Law
from symfric.laws.composed.populations import cost

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INTERRUPTED = "interrupted by the user"
HEADER = ("law", "validation", "fit", "AICc", "BIC", "par.", "op.", "status", "")
NUMBERS = (1, 2, 3, 4, 5, 6)
"""Header of the table of laws, and its numeric columns."""
TITLES = {
    "validation": "validation [%]", "uncertainty": "validation +- [%]", "fitted": "fit [%]",
    "aicc": "AICc", "bic": "BIC",
}  # fmt: skip
"""Titles of fields in plain data that differ from their names."""
LOST = "not fitted"
OWN = ("kind", "what", "data")
"""Arguments of a fit that `select` sets."""


@final
@dataclass(frozen=True, eq=False)
class RankedFit:
    """Result of one law in a ranking.

    Attributes:
        law: name as given.
        status: status of its fit; "" if it could not be fitted.
        validation: error on data left out of the fit [%]; NaN without validation, infinite if the
            prediction diverged (`DIVERGED`); None in plain data.
        uncertainty: standard error of the validation [%].
        fitted: error on the data of the fit [%].
        aicc, bic: difference from the best law.
        parameters: number of fitted parameters, without start values.
        operations: instructions of force and rate; None for a model without a law.
        seconds: duration of the fit.
        sentence: main objection to the fit, or reason why the law could not be fitted.
        fit: result of the fit; None if it failed.
    """

    law: str
    status: str = ""
    validation: float = nan
    uncertainty: float = nan
    fitted: float = nan
    aicc: float = nan
    bic: float = nan
    parameters: int = 0
    operations: int | None = None
    seconds: float = 0.0
    sentence: str = ""
    fit: Fitted | None = None

    @property
    def cells(self) -> tuple[str, ...]:
        """Cells of the row as text, in the order of `HEADER`."""
        known = isfinite(self.validation) and isfinite(self.uncertainty)
        error = f"{self.validation:.3g} +- {self.uncertainty:.1g} %"
        numbers = (
            error if known else percent(self.validation), percent(self.fitted),
            *(f"{x:.1f}" if isfinite(x) else "-" for x in (self.aicc, self.bic)),
            str(self.parameters), "-" if self.operations is None else str(self.operations),
        )  # fmt: skip
        if self.fit is None:
            numbers = ("-",) * len(numbers)
        return self.law, *numbers, self.status or LOST, self.sentence

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, with None for non-finite numbers."""
        named = {TITLES.get(f.name, f.name): getattr(self, f.name) for f in fields(self)[:-1]}
        return json_data(named)


@final
@dataclass(frozen=True, eq=False)
class FitRanking:
    """Laws in order of their prediction error; laws that could not be fitted come last.

    The first law is the simplest one whose squared error exceeds the smallest by at most the
    standard error of the difference (one-standard-error rule, L. Breiman et al., 1984).

    Attributes:
        rows: one row for each law.
        data: name of the data.
        how: method of the validation.
        effective: effective number of samples of all signals together.
    """

    rows: tuple[RankedFit, ...]
    data: str
    how: str
    effective: float

    @property
    def best(self) -> Fitted:
        """Fit of the first law.

        Raises:
            ValueError: no law could be fitted.
        """
        if not self.rows or self.rows[0].fit is None:
            raise ValueError(f"select: no law could be fitted to data '{self.data}'")
        return self.rows[0].fit

    def __getitem__(self, law: str) -> RankedFit:
        """Return the row of a law by its name."""
        checks.choice("select: law", law, [row.law for row in self.rows])
        return next(row for row in self.rows if row.law == law)

    @property
    def title(self) -> str:
        """Data and validation method in one line."""
        return f"laws on {self.data}: {self.how}; {self.effective:.0f} effective samples"

    def __str__(self) -> str:
        lines = [HEADER[:-1], *(row.cells[:-1] for row in self.rows if row.fit is not None)]
        width = max(len(name) for name in (HEADER[0], *(row.law for row in self.rows)))
        texts = columns([(f"{law:{width}}", *cells) for law, *cells in lines], NUMBERS)
        lost = [f"{r.law:{width}}  {LOST}: {r.sentence}" for r in self.rows if r.fit is None]
        return "\n".join([self.title, *texts, *lost])

    def _repr_html_(self) -> str:  # pyright: ignore[reportUnusedFunction]
        """Return the notebook view: the table and its figure."""
        drawn = any(row.fit is not None for row in self.rows)
        table = TextTable(HEADER, tuple(row.cells for row in self.rows), NUMBERS)
        return Shown(self.title, table=table).html(self.plot() if drawn else None)

    def to_dict(self) -> dict[str, Any]:
        """Return the ranking without the fits as plain data."""
        plain = {name: getattr(self, name) for name in ("data", "how", "effective")}
        return plain | {"rows": [row.to_dict() for row in self.rows]}

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot errors on fitted and other data and information criteria as bars for each law.

        Args:
            path: image file to write.
        """
        from identification.result.picture import plot_ranking  # noqa: PLC0415 (Matplotlib is slow)

        return plot_ranking(self.to_dict(), path)


def select(
    laws: Iterable[Any] | Mapping[str, Any],
    data: Dataset,
    kind: Kind | None = None,
    validate: Dataset | None = None,
    *,
    folds: int = 4,
    executor: Executor | None = None,
    progress: Progress | None = None,
    **fit: Any,
) -> FitRanking:
    """Fit several laws to the same data and rank them by their errors on other data.

    Args:
        laws: texts, laws, scenes or models, or name -> one of these.
        data: data of the fits.
        kind: type of residuals; None: `InverseDynamics()`.
        validate: data for validation; None: cross-validation.
        folds: number of folds of the cross-validation; 0: none, and the ranking is by BIC.
        executor: executor for the starts of each law.
        progress: called with a text and the completed fraction.
        fit: further arguments of `Fit`, the same for all laws.

    A law that cannot be fitted has a row with the reason. After Ctrl-C the laws fitted so far are
    ranked; the rows of the other laws are marked as interrupted.

    Raises:
        ValueError: no laws, or invalid arguments.
    """
    named = _named(laws)
    checks.kind("select: data", data, Dataset, "data, such as Dataset.read('run.csv')")
    folds = checks.count("select: folds", folds, least=0)
    checks.check_names("select", fit, [f.name for f in fields(Fit) if f.name not in OWN])
    residuals: Any = InverseDynamics() if kind is None else kind
    tried, stopped = list[_Tried | RankedFit](), False
    for number, (name, what) in enumerate(named.items()):
        if stopped:
            tried.append(RankedFit(name, sentence=INTERRUPTED))
            continue
        if progress is not None:
            progress(name, number / len(named))
        one = Fit(residuals, what, data, **fit)
        try:
            tried.append(last := _try(name, one, validate, folds, executor))
            stopped = isinstance(last, _Tried) and last.fit.status is Status.INTERRUPTED
        except KeyboardInterrupt:  # rank the laws fitted so far
            if not tried:
                raise
            tried.append(RankedFit(name, sentence=INTERRUPTED))
            stopped = True
    if progress is not None:
        progress("ranked", 1.0)
    good = [t for t in tried if isinstance(t, _Tried)]
    by = next((t.by for t in good if t.by), "")
    how = f"validation by {folds} folds ({by})" if by else "no validation"
    if validate is not None:
        how = f"validation on {validate.name}"
    elif not by and folds > 1:
        how = f"no validation, although {folds} folds were requested"
    rows, n = _ranked(good)
    return FitRanking((*rows, *(t for t in tried if isinstance(t, RankedFit))), data.name, how, n)


class _Tried(NamedTuple):
    """Fitted law: residuals on the fitted and on other data, and the kind of folds.

    Its `parameters` are the number of fitted parameters that are not nuisance parameters.
    """

    name: str
    fit: Fitted
    parameters: int
    inside: Sequence[Left]
    outside: Sequence[Left] = ()
    by: str = ""
    why: str = ""


def _named(laws: Iterable[Any] | Mapping[str, Any]) -> dict[str, Any]:
    if isinstance(laws, Mapping):
        return {str(name): what for name, what in laws.items()}
    if isinstance(laws, str):
        raise checks.refused("select: laws", "a list of laws", laws, "['stribeck', 'lugre']")
    found: dict[str, Any] = {}
    for what in laws:
        name = what if isinstance(what, str) else getattr(what, "name", type(what).__name__)
        found[name if name not in found else f"{name} {len(found) + 1}"] = what
    if not found:
        raise checks.refused("select: laws", "at least one law", laws)
    return found


def _try(
    name: str, asked: Fit, validate: Dataset | None, folds: int, executor: Executor | None
) -> _Tried | RankedFit:
    """Fit and validate one law; return a row with the reason if it cannot be fitted."""
    try:
        found = asked.solve(executor=executor, throw=False)
        live = found.alive("select")
    except (ValueError, SolveError) as error:
        return RankedFit(name, sentence=str(error))
    count = sum(not u.nuisance for u in live.task.unknowns.unknowns)
    tried = _Tried(name, found, count, left_of(found, asked.data))
    try:
        if validate is not None:
            tried = tried._replace(outside=left_of(found, validate))
        elif folds and found.status is not Status.INTERRUPTED:
            start = {n: v for n, v in live.values.items() if n in live.subject.names}
            crossed = cross_validate(asked, folds, start)
            tried = tried._replace(
                outside=crossed.left, by=crossed.by, why=" ".join(crossed.failed)
            )
    except ValueError as error:
        tried = tried._replace(why=str(error))
    return tried


def _ranked(good: Sequence[_Tried]) -> tuple[list[RankedFit], float]:
    """Return the rows of the fitted laws in order, and the effective number of samples."""
    inside, outside = shared([t.inside for t in good]), shared([t.outside for t in good])
    effective = _effective(good, inside)
    n = sum(effective.values())
    aicc, bic = list[float](), list[float]()
    for t, left in zip(good, inside, strict=True):
        k = t.parameters
        fits = sum(effective[s] * np.log(max(ms, 1e-300)) for s, ms in _mean_squares(left).items())
        aicc.append(float(fits) + (2 * k * n / (n - k - 1) if n > k + 1 else inf))
        bic.append(float(fits) + k * float(np.log(n)))
    least = min(aicc, default=0.0), min(bic, default=0.0)
    over = ([x - m if isfinite(m) else nan for x in some]
            for some, m in zip((aicc, bic), least, strict=True))  # fmt: skip
    errors = ([relative(left) for left in some] for some in (outside, inside))
    sure = map(uncertainty, outside)
    rows = [_row(t, *numbers) for t, *numbers in zip(good, *errors, *over, sure, strict=True)]
    order = sorted(range(len(rows)), key=lambda i: _rank(rows[i]))
    if order and outside[order[0]]:
        best = outside[order[0]]
        close = [i for i in order if _close(outside[i], best)]
        order.sort(key=lambda i: i != min(close, key=lambda i: _complexity(rows[i])))
    return [rows[i] for i in order], n


def _close(left: Sequence[Left], best: Sequence[Left]) -> bool:
    """Return True if errors exceed the best ones by at most the standard error."""
    if [(part.signal, part.r.size) for part in left] != [(p.signal, p.r.size) for p in best]:
        return False
    more, error = excess(left, best)
    return more <= error or left is best


def _rank(row: RankedFit) -> tuple[float, float]:
    return row.validation if isfinite(row.validation) else inf, row.bic


def _complexity(row: RankedFit) -> tuple[float, ...]:
    return row.parameters, inf if row.operations is None else row.operations, *_rank(row)


def _row(
    t: _Tried, validation: float, fitted: float, aicc: float, bic: float, uncertainty: float
) -> RankedFit:
    fit, away = t.fit, validation > DIVERGED
    operations = cost(fit.law).value if isinstance(fit.law, Law) else None
    far = f"On data that were not fitted its error exceeds {DIVERGED:g} %." if away else ""
    sentence = " ".join(s for s in (*fit.verdict.sentences[:1], far, t.why) if s)
    return RankedFit(
        t.name, fit.status.name, inf if away else validation, uncertainty, fitted, aicc, bic,
        t.parameters, operations, fit.seconds, sentence, fit,
    )  # fmt: skip


def _mean_squares(left: Sequence[Left]) -> dict[str, float]:
    return {
        signal: float(np.mean(np.concatenate([part.r for part in some]) ** 2))
        for signal, some in by_signal(left).items()
    }


def _effective(good: Sequence[_Tried], inside: Sequence[Sequence[Left]]) -> dict[str, float]:
    """Return the effective sample count of each signal under the law that fits the signal best."""
    found: dict[str, tuple[float, float]] = {}
    for t, left in zip(good, inside, strict=True):
        counts: dict[str, float] = {}
        for label, n in t.fit.verdict.effective.items():
            signal = label.split("[")[0]
            counts[signal] = counts.get(signal, 0.0) + n
        for signal, ms in _mean_squares(left).items():
            if ms < found.get(signal, (inf, 0.0))[0]:
                found[signal] = (ms, counts.get(signal, 1.0))
    return {signal: n for signal, (_, n) in found.items()}
