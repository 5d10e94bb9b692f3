"""Report of a fit as one self-contained HTML page with tables and charts."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import Any, Protocol

import numpy as np

from identification.data.findings import grouped
from identification.data.record import first_of
from identification.result.outcome import (
    DRIVING,
    MANY,
    SAME,
    FitFields,
    best_starts,
    correlated,
    count_of,
    interval,
    machine_units,
    number,
    parted,
    percent,
    remark,
    rounded,
    sentences,
    unit_of,
    with_unit,
)
from identification.result.parts import Errors, Estimate, FrictionCurve, Series, limits
from identification.result.stored import source_of
from identification.verdict.judge import Test
from symfric.foundation.status import Status
from symfric.page import html
from symfric.page.svg import Axis, Band, Dots, Level, Mark, Polyline, Stems, around, chart

WINDOWS = 60
"""Largest number of window starts that are drawn."""
FLOOR = 1e-3
"""Smallest difference shown in the chart of the starts."""


def signal_charts(one: Series) -> str:
    """Return the chart of the measured and fitted signal, and that of the residuals."""
    shape = Polyline if one.ordered else Dots
    name, _, unit = one.abscissa.rstrip("]").partition(" [")
    low, high = float(one.residual.t.min()), float(one.residual.t.max())
    x = around(name, unit, [one.residual.t])
    if low < high and one.ordered:
        x = Axis(name, unit, low, high)
    starts = one.breaks if one.breaks.size <= WINDOWS else np.zeros(0)
    windows = [Level("window", float(t), upright=True) for t in starts]
    both = [
        shape("measured", one.measured.t, one.measured.y, "measured"),
        shape("predicted", one.predicted.t, one.predicted.y, "fitted"),
    ]
    y = around(one.signal, one.unit, [one.measured.y, one.predicted.y])
    says = f"{one.signal} of {one.record} over {one.abscissa}, measured and fitted"
    above = chart(f"{one.record}: {one.signal}", x, y, [*windows, *both], says=says)
    y = around("difference", one.unit, [one.residual.y, np.zeros(1)])
    marks = [*windows, Level("zero", 0.0), shape("residual", one.residual.t, one.residual.y)]
    size = float(np.abs(one.residual.y).max(initial=0.0))
    says = f"fitted minus measured {one.signal}, at most {number(size, 3)} {one.unit}"
    title = f"{one.record}: residuals of {one.signal}"
    return above + chart(title, x, y, marks, height=170.0, says=says)


def lags(one: Series) -> str:
    """Return the chart of the autocorrelation with the limits of white noise; "" if unordered."""
    if not one.correlation.size:
        return ""
    x = Axis("lag", "samples", 0.0, float(one.lags.max()) + 0.5, whole=True)
    y = around("autocorrelation", "", [one.correlation, one.low, one.high, np.array([0.0, 1.0])])
    marks = [
        Band("band", float(np.min(one.low)), float(np.max(one.high))),
        Level("zero", 0.0),
        Stems("residual", one.lags, one.correlation),
        Dots("residual", one.lags, one.correlation),
    ]
    outside = int(((one.correlation > one.high) | (one.correlation < one.low)).sum())
    says = f"{outside} of {one.lags.size} autocorrelations lie outside the limits of white noise"
    title = f"{one.record}: autocorrelation of the residuals of {one.signal}"
    return chart(title, x, y, marks, height=190.0, says=says)


def friction(curve: FrictionCurve, name: str) -> str:
    """Return the chart of friction over velocity, with dots for the data and a line for the law."""
    dots = [Dots("measured sample", line.t, line.y) for line in curve.measured.values()]
    low, high = limits(curve)
    x = around("v", curve.v_unit, [curve.law.t, *(line.t for line in curve.measured.values())])
    sides = (-1.0, 1.0) if curve.half.size else ()
    marks: list[Mark] = [
        *dots,
        Polyline("law", curve.law.t, curve.law.y, name),
        *(
            Polyline("limit", curve.law.t, curve.law.y + side * curve.half, "95 %")
            for side in sides
        ),
        Dots("measured", np.zeros(0), np.zeros(0), curve.says),
    ]
    says = f"friction of {name} over velocity, {float(curve.law.y.min()):.4g} to "
    says += f"{float(curve.law.y.max()):.4g} {curve.F_unit}"
    y = Axis("friction", curve.F_unit, low, high)
    return chart("Friction over velocity", x, y, marks, height=300.0, says=says)


def waterfall(fit: FitFields) -> str:
    """Return the chart of the starts' costs above the best one; "" for a single start."""
    above = np.sort([s.above for s in fit.starts if isfinite(s.above)])
    if above.size < 2:
        return ""
    same = above < SAME
    shown = np.maximum(above, FLOOR)
    numbers = np.arange(1.0, above.size + 1)
    x = Axis("start, best first", "", 0.5, above.size + 0.5, whole=True)
    name = "-2 ln L above the best"
    y = around(name, "", [shown, np.array([FLOOR, 10.0])], logarithmic=True)
    marks: list[Mark] = [
        Level("bound", SAME),
        Polyline("zero", numbers, shown),
        Dots("good", numbers[same], shown[same], "the same minimum"),
        Dots("bad", numbers[~same], shown[~same], "another minimum, or none"),
    ]
    says = f"{int(same.sum())} of {len(fit.starts)} starts ended at the best minimum"
    return chart("Waterfall of the starts", x, y, marks, height=210.0, says=says)


class ShownRanking(Protocol):
    """Result of `select`, restricted to what the page shows."""

    def to_dict(self) -> dict[str, Any]:
        """Return a dictionary with "rows", a list with a dictionary of results for each law."""
        ...


def page_of(fit: FitFields, ranking: ShownRanking | None = None) -> str:
    """Return the page as HTML text."""
    sections = [
        ("parameters", "Parameters", "Parameters", _parameters(fit)),
        ("data", "Data and fit", "Data and fit", _data(fit)),
        ("friction", "Friction", "Force against velocity", _friction(fit)),
        ("residuals", "Residuals", "Residuals", _residuals(fit)),
        ("starts", "Starts", "Starts", _starts(fit)),
        ("ranking", "Ranking", "Ranking of laws", _ranking(ranking)),
        ("findings", "Data warnings", "Data warnings", _findings(fit)),
        ("made", "How it was made", "How it was made", _made(fit)),
    ]
    if any(f.severity == "error" for f in fit.findings):
        sections.sort(key=lambda section: section[0] != "findings")
    parts = [(at, name, html.section(at, head, *body)) for at, name, head, body in sections]
    verdict = ("bad", "No result")
    if fit.status.ok:
        solved = fit.status is Status.SOLVED
        verdict = ("good", "Good") if solved else ("doubtful", "Doubtful")
        if solved and (unknown := sorted({name for some in fit.undetermined for name in some})):
            verdict = ("doubtful", f"Good fit; not identifiable: {', '.join(unknown)}")
    top = [
        f"<header>{html.title(fit.name)}",
        html.paragraph(f"fitted to {', '.join(fit.records)} by {fit.kind}", "soft"),
        html.verdict(*verdict, sentences(fit)),
        html.contents([(at, name) for at, name, part in parts if part]),
        "</header>",
    ]
    body = "\n".join([*top, *(part for *_, part in parts if part)])
    return html.page(f"{fit.name}: fit", "en", body)


def _parameters(fit: FitFields) -> Iterator[str]:
    requested, held, nuisance = parted(fit)
    yield _estimates("Fitted, with 95 % intervals", requested)
    rows = [(n, number(e.value), _unit(e.unit), e.note) for n, e in held.items()]
    header = ("parameter", "value", "unit", "why")
    yield html.table("Held", header, rows, (1,), ["note"] * len(held))
    some = dict(list(nuisance.items())[:MANY])
    more = f", the first {MANY} of {len(nuisance)}" if len(nuisance) > MANY else ""
    yield _estimates(f"Of single records: start values, dead times{more}", some)
    if fit.sides:
        header = ("parameter", "at the load", "at the motor", "current")
        caption = f"In the units of the drive; {DRIVING}"
        yield html.table(caption, header, machine_units(fit), (1, 2, 3))
    shown = [i for i, n in enumerate(fit.names) if not fit.parameters[n].nuisance]
    names, rows = [fit.names[i] for i in shown], fit.correlation[np.ix_(shown, shown)].tolist()
    values = [[c if isfinite(c) else None for c in row] for row in rows]
    yield html.triangle("Correlation of the estimates", names, values)
    close = correlated(fit)
    if close:
        pairs = ", ".join(f"{a} and {b} ({c:+.3f})" for a, b, c in close[:8])
        yield html.paragraph(f"Strongly correlated: {pairs}.", "soft")


def _estimates(caption: str, estimates: dict[str, Estimate]) -> str:
    header = ["parameter", "value", "unit", "standard error", "", "95 % interval", "if white"]
    rows = [
        [n, rounded(e.value, e.standard_error), _unit(e.unit), number(e.standard_error, 2),
         percent(e.relative_error), interval(e), number(e.white_error, 2)]
        for n, e in estimates.items()
    ]  # fmt: skip
    notes = [remark(e) for e in estimates.values()]
    if any(notes):
        header.append("note")
        rows = [[*row, note] for row, note in zip(rows, notes, strict=True)]
    return html.table(caption, header, rows, (1, 3, 4, 5, 6), ["note"] * len(rows) * any(notes))


def _unit(unit: str) -> str:
    """Return a unit as text that stays on one line."""
    return unit_of(unit).replace(" ", "\N{NO-BREAK SPACE}")


def _errors(caption: str, errors: Errors, records: Sequence[str]) -> str:
    several = len(records) > 1
    rows = [
        (f"[{records.index(record)}] {record}" if several and record in records else record,
         signal, with_unit(number(e.rms, 3), e.unit), percent(e.relative, 3),
         with_unit(number(e.largest, 3), e.unit), f"{e.rows}", count_of(e.effective))
        for (record, signal), e in errors.items()
    ]  # fmt: skip
    header = ("record", "signal", "rms", "of the signal", "largest", "rows", "independent rows")
    return html.table(caption, header, rows, (2, 3, 4, 5, 6))


def _data(fit: FitFields) -> Iterator[str]:
    yield _errors("Residuals of each signal", fit.errors, fit.records)
    yield _errors("The same parameters on other data", fit.validation or {}, ())
    for one in fit.series:
        yield html.figure(signal_charts(one))


def _friction(fit: FitFields) -> Iterator[str]:
    if fit.curve is not None:
        yield html.figure(
            friction(fit.curve, fit.name),
            f"Line: the law in steady sliding. Dots: {fit.curve.says}.",
        )


def _residuals(fit: FitFields) -> Iterator[str]:
    tests = fit.verdict.tests
    missed = [t for t in tests if not t.passed]
    if missed:
        yield _tests("Tests that were not passed", missed)
    else:
        yield html.paragraph(f"All {len(tests)} tests were passed.")
    yield html.details(f"All {len(tests)} tests", _tests("Tests of the residuals", tests))
    if fit.noise:
        units = {signal: e.unit for (_, signal), e in fit.errors.items()}
        noise = [(n, with_unit(number(s, 4), units.get(n, ""))) for n, s in fit.noise.items()]
        caption = "Noise by which the signals were weighted"
        yield html.table(caption, ("signal", "standard deviation"), noise, (1,))
    for one in fit.series:
        drawing = lags(one)
        if drawing:
            yield html.figure(drawing)


def _tests(caption: str, tests: Sequence[Test]) -> str:
    def outcome(test: Test) -> str:
        if test.passed:
            return "passed" if test.p >= test.limit else "too small to count"
        return "failed" if test.decides else "no, allowed for"

    rows = [
        (t.channel, t.name, number(t.statistic, 3), f"{t.p:.2g}", f"{t.limit:.2g}", outcome(t))
        for t in tests
    ]
    kinds = ["good" if t.passed else "doubtful" * t.decides for t in tests]
    header = ("channel", "test", "statistic", "p", "limit", "result")
    return html.table(caption, header, rows, (2, 3, 4), kinds)


def _starts(fit: FitFields) -> Iterator[str]:
    if len(fit.starts) < 2:
        return
    yield html.paragraph(
        f"{best_starts(fit)} of {len(fit.starts)} starts ended at the best minimum."
    )
    yield html.figure(waterfall(fit))
    names = [n for n in fit.starts[0].values if not fit.parameters[n].nuisance]
    rows = [
        (f"{s.number}", above(s.above), number(s.cost, 6), f"{s.evaluations}",
         *(number(s.values.get(n), 4) for n in names),
         f"{s.status.name} {s.message}".strip())
        for s in fit.starts
    ]  # fmt: skip
    header = ("number", "above the best", "cost", "evaluations", *names, "ended")
    yield html.table("Starts, best first", header, rows, range(1, 4 + len(names)))


def above(value: float) -> str:
    """Return as text how far a start ended above the best one; rounding errors count as 0."""
    return "0" if abs(value) < 1e-6 else number(value, 3)


def _ranking(ranking: ShownRanking | None) -> Iterator[str]:
    rows = [] if ranking is None else list(ranking.to_dict()["rows"])
    if rows:
        names = [name for name in rows[0] if name != "sentence"]
        cells = [[_cell(row.get(name)) for name in names] for row in rows]
        texts = [n for n in names if any(isinstance(row.get(n), str) for row in rows)]
        numbers = [j for j, n in enumerate(names) if n not in texts]
        yield html.table("Laws fitted to the same data, best first", names, cells, numbers)
        messages = [(row["law"], row.get("sentence")) for row in rows]
        yield html.bullets(f"{law}: {sentence}" for law, sentence in messages if sentence)


def _cell(value: object) -> str:
    if value is None:
        return "–"
    return number(float(value), 4) if isinstance(value, int | float) else str(value)


def _findings(fit: FitFields) -> Iterator[str]:
    rows = [
        (first_of(names), f.signal, f.kind, f.severity, f.sentence)
        for names, f in grouped(fit.findings, fit.records)
    ]
    header = ("record", "signal", "kind", "severity", "what and where")
    yield html.table("Findings of the checks", header, rows, (), ["note"] * len(rows))


def _made(fit: FitFields) -> Iterator[str]:
    made = [(name, text) for name, text in fit.made.items() if text]
    yield html.table("Call and versions", ("what", ""), made)
    if fit.law is not None:
        yield html.heading("The law as Python")
        yield html.code(source_of(fit.law))
