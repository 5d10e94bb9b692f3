"""Fields of a fit and their report as text, with estimates also in the units of a drive."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import floor, isfinite, log10
from textwrap import wrap
from typing import final

from identification.data.dataset import Dataset
from identification.data.findings import Finding, texts
from identification.residuals.evaluation import Array
from identification.result.parts import Asked, Errors, Estimate, FrictionCurve, Live, Series, Tried
from identification.verdict.judge import Verdict
from symfric.foundation.parameters import Parametric
from symfric.foundation.shown import columns
from symfric.foundation.status import Status
from symfric.foundation.storable import agree
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.scenes import Drive

WIDTH = 80
CLOSE = 0.9
"""Magnitude of the correlation of two estimates above which it is listed."""
SAME = 1.0
"""Difference of -2 log-likelihood below which two starts have reached the same minimum."""
NOTHING = 1e8
"""Ratio of the interval ends above which a value is not identifiable."""
MANY = 12
"""Largest number of start values, dead times and pairs that are listed."""
ALONE = "m without rotor"
"""Name of the mass or inertia of the load alone."""
AT_MOTOR = {
    "N m": ("N m", "A", -1),
    "N m s/rad": ("N m s/rad", "A s/rad", -2),
    "N m/rad": ("N m/rad", "A/rad", -2),
    "kg m^2": ("kg m^2", "A s^2/rad", -2),
    "rad/s": ("rad/s", "", 1),
    "rad": ("rad", "", 1),
}
"""Unit of a rotary load -> unit at the motor, unit of the current, and exponent of the ratio."""


@final
@dataclass(frozen=True)
class Sides:
    """Value of a parameter on both sides of a drive.

    The current and the torque of the motor are those for driving the load at efficiency eta_f:

        torque at the motor = force / (ratio eta_f),   current = torque / torque_constant

    An inertia at the motor is m / ratio^2. Coefficients of the velocity, deflection or acceleration
    refer to those of the motor.

    Attributes:
        name: name of the parameter.
        load, motor, current: values; a reversed axis or current changes the sign of an offset only.
        units: their units; "" without a current.
        error: standard error relative to the value; None if unknown.
    """

    name: str
    load: float
    motor: float
    current: float
    units: tuple[str, ...]
    error: float | None = None


def sides_of(data: Dataset, estimates: Mapping[str, Estimate]) -> Iterator[Sides]:
    """Yield the values of a fit to logs of one drive in all units; none without a drive.

    A mass is that of load and rotor; "m without rotor" is that of the load.
    """
    drives = {id(record.drive): record.drive for record in data}
    drive = next(iter(drives.values()))
    if len(drives) > 1 or drive is None:
        return
    ratio, K, rotor = (float(x) for x in (drive.ratio, drive.torque_constant, drive.rotor))
    driving = 1 - drive.losses[0]
    every = {n: e for n, e in estimates.items() if not (e.nuisance or e.fixed)}
    if "m" in every and rotor > 0:
        m = every["m"]
        every[ALONE] = Estimate(m.value - rotor, m.unit, m.standard_error)
    for name, e in every.items():
        if (found := AT_MOTOR.get(e.unit) or AT_MOTOR.get(turned(e.unit))) is None:
            continue
        motor, current, power = found
        signed = name == "offset"  # others are levels in both directions
        scale = (ratio if signed else abs(ratio)) ** power
        at_motor = e.value * scale / (driving if motor.startswith("N") else 1.0)
        amperes = e.value * scale / (driving * (K if signed else abs(K))) if current else 0.0
        error = abs(e.standard_error / e.value) if e.standard_error and e.value else None
        yield Sides(name, e.value, at_motor, amperes, (e.unit, motor, current), error)


@dataclass(frozen=True, eq=False, repr=False)
class FitFields:
    """Fields of a fit, described in `Fitted`, and their text."""

    name: str
    kind: str
    records: tuple[str, ...]
    parameters: dict[str, Estimate]
    names: tuple[str, ...]
    correlation: Array
    undetermined: tuple[tuple[str, ...], ...]
    directions: tuple[str, ...]
    status: Status
    message: str
    verdict: Verdict
    errors: Errors
    validation: Errors | None
    noise: dict[str, float]
    starts: tuple[Tried, ...]
    findings: tuple[Finding, ...]
    series: tuple[Series, ...]
    curve: FrictionCurve | None
    law: Law | None
    machine: Parametric | None
    seconds: float
    evaluations: int
    made: dict[str, str] = field(default_factory=dict[str, str])
    live: Live | None = None
    asked: Asked | None = None
    sides: tuple[Sides, ...] = ()

    def __str__(self) -> str:
        return text_of(self)

    @property
    def values(self) -> dict[str, float]:
        """Values of the fitted and held parameters by name."""
        return {name: e.value for name, e in self.parameters.items()}

    @property
    def drive(self) -> Drive | None:
        """The machine if it is a `Drive`, otherwise None."""
        return self.machine if isinstance(self.machine, Drive) else None

    def check_fields(self) -> None:
        """Raise an error if the estimates do not match the names, for example from a file."""
        n = len(self.names)
        agree("Fitted", self.correlation.shape == (n, n), {*self.names} <= self.parameters.keys())


def text_of(fit: FitFields) -> str:
    """Return the text of `print(fit)` within 80 columns."""
    blocks = [
        [f"{fit.name} fitted by {fit.kind}: {fit.status.name}", *_indented(sentences(fit))],
        [*_head(fit)],
        [*_parameters(fit)],
        [*_sides(fit)],
        [*_correlations(fit)],
        [*errors_table("residuals", fit.errors)],
        [*errors_table("on other data", fit.validation or {})],
        [*_data(fit)],
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block)


def sentences(fit: FitFields) -> list[str]:
    """Return the messages on the whole fit in order of importance, without repetition."""
    messages = [*fit.verdict.sentences, *fit.directions]
    message = fit.message
    for sentence in messages:  # the message repeats the sentences of the verdict
        message = message.replace(sentence, "")
    return [text for text in dict.fromkeys([" ".join(message.split()), *messages]) if text]


def number(value: float | None, digits: int = 6) -> str:
    """Return a value with significant digits; a dash for None."""
    return "-" if value is None or not isfinite(value) else f"{value:.{digits}g}"


def count_of(value: float) -> str:
    """Return a rounded count; a dash if unknown."""
    return f"{value:.0f}" if value >= 10.0 else number(value, 2)


def rounded(value: float, error: float | None) -> str:
    """Return `value` with the digits that its standard error permits, two of them uncertain."""
    if error is None or not isfinite(error) or error <= 0.0 or value == 0.0:
        return number(value)
    digits = floor(log10(abs(value))) - floor(log10(error)) + 2
    return f"{value:.{min(max(digits, 2), 10)}g}"


def interval(e: Estimate) -> str:
    """Return the 95 % interval with the digits of the value; "" if there is none."""
    if e.low is None or e.high is None:
        return ""
    if e.high > NOTHING * e.low > 0.0:
        return "not identifiable"
    return f"{_end(e.low, e)} ... {_end(e.high, e)}"


def _end(value: float, e: Estimate) -> str:
    """Return an interval end, with few digits if its magnitude differs from that of the value."""
    far = not 1e-2 * abs(e.value) < abs(value) < 1e2 * abs(e.value)
    return number(value, 3) if far and e.value else rounded(value, e.standard_error)


def percent(value: float | None, digits: int = 2) -> str:
    """Return a share in percent without an exponent; "" for None."""
    if value is None or not isfinite(value):
        return ""
    if value > 1e4:
        return "> 10000 %"
    return f"{value:.{digits}g} %" if value < 10.0**digits else f"{value:.0f} %"


def unit_of(unit: str) -> str:
    """Return a unit as text; "" for dimensionless numbers."""
    return "" if unit == "1" else unit


def with_unit(text: str, unit: str) -> str:
    """Return a number with its unit, if there is one."""
    return f"{text} {unit_of(unit)}".rstrip()


def remark(e: Estimate) -> str:
    """Return the reason why a parameter is held or has no interval."""
    return f"held: {e.note}" if e.fixed and e.note else ("held" if e.fixed else e.note)


def best_starts(fit: FitFields) -> int:
    """Return the number of starts that ended at the lowest cost."""
    return sum(s.above < SAME for s in fit.starts)


def correlated(fit: FitFields) -> list[tuple[str, str, float]]:
    """Return the pairs of estimates with a correlation above `CLOSE`, the largest first."""
    n = len(fit.names)
    pairs = [
        (fit.names[i], fit.names[j], float(fit.correlation[i, j]))
        for i in range(n)
        for j in range(i)
        if isfinite(fit.correlation[i, j]) and abs(fit.correlation[i, j]) > CLOSE
    ]
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def _indented(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        yield from wrap(text, WIDTH, initial_indent="  ", subsequent_indent="  ")


def _head(fit: FitFields) -> Iterator[str]:
    """Yield the lines on data, effort and noise."""
    rows = sum(e.rows for e in fit.errors.values())
    named = fit.records[:4]
    more = f" and {len(fit.records) - 4} more" if len(fit.records) > 4 else ""
    count = sum(not e.fixed for e in fit.parameters.values())
    text = f"{', '.join(named)}{more}; {rows} rows, {count} fitted"
    yield from wrap(f"data    {text}", WIDTH, subsequent_indent=" " * 8)
    if fit.starts:
        n = len(fit.starts)
        reached = f"{best_starts(fit)} of {n} starts at the lowest cost" if n > 1 else "one start"
        yield f"effort  {reached}, {fit.evaluations} evaluations, {fit.seconds:.3g} s"
    units = {signal: e.unit for (_, signal), e in fit.errors.items()}
    noise = [
        f"{name} {with_unit(number(s, 3), units.get(name, ''))}" for name, s in fit.noise.items()
    ]
    if noise:
        yield from wrap(f"noise   {', '.join(noise)}", WIDTH, subsequent_indent=" " * 8)


def parted(fit: FitFields) -> tuple[dict[str, Estimate], dict[str, Estimate], dict[str, Estimate]]:
    """Return requested parameters, held parameters, and start values and dead times of records."""
    every = fit.parameters.items()
    fitted = {n: e for n, e in every if not e.fixed}
    requested = {n: e for n, e in fitted.items() if not e.nuisance}
    nuisance = {n: e for n, e in fitted.items() if e.nuisance}
    return requested, {n: e for n, e in every if e.fixed}, nuisance


def _parameters(fit: FitFields) -> Iterator[str]:
    requested, held, nuisance = parted(fit)
    if requested:
        yield from _table("parameter", requested)
    if held:
        yield ""
        rows = [(n, with_unit(number(e.value), e.unit), e.note) for n, e in held.items()]
        yield from columns([("held", "value", "why"), *rows])
    if nuisance:
        yield ""
        yield from _table("of a record", dict(list(nuisance.items())[:MANY]))
        if len(nuisance) > MANY:
            yield f"and {len(nuisance) - MANY} more in fit.parameters"


def _table(name: str, estimates: dict[str, Estimate]) -> Iterator[str]:
    rows = [(name, "value", "unit", "std error", "95 % interval")]
    for n, e in estimates.items():
        share = f" ({percent(e.relative_error)})" if percent(e.relative_error) else ""
        error = "" if e.standard_error is None else f"{e.standard_error:.2g}{share}"
        value = rounded(e.value, e.standard_error)
        rows.append((n, value, unit_of(e.unit), error, interval(e) or e.note))
    return columns(rows)


DRIVING = "at motor and current: to drive the load, per speed and angle of the motor"


def machine_units(fit: FitFields) -> list[tuple[str, ...]]:
    """Return rows of name and value at the load, at the motor and as a current."""
    rows: list[tuple[str, ...]] = []
    for s in fit.sides:
        values = (s.load, s.motor, s.current)
        texts = (rounded(x, None if s.error is None else s.error * abs(x)) for x in values)
        pairs = zip(texts, s.units, strict=True)
        rows.append((s.name, *(with_unit(x, unit) if unit else "" for x, unit in pairs)))
    return rows


def _sides(fit: FitFields) -> Iterator[str]:
    if fit.sides:
        header = ("of the drive", "at the load", "at the motor", "current")
        yield from columns([header, *machine_units(fit)])
        yield DRIVING
        if any(s.name == ALONE and s.load < 0 for s in fit.sides):
            yield "m is below the inertia of the rotor: check gear_ratio, the turns of the motor"
            yield "per turn of the output, rotor_inertia and torque_constant"


def _correlations(fit: FitFields) -> Iterator[str]:
    pairs = correlated(fit)
    if pairs:
        yield f"correlation above {CLOSE:g}"
        yield from columns([(f"  {a}, {b}", f"{c:+.3f}") for a, b, c in pairs[:MANY]])
        if len(pairs) > MANY:
            yield f"  and {len(pairs) - MANY} more pairs"


def errors_table(title: str, errors: Errors) -> Iterator[str]:
    """Yield a header, and a line for each signal of each record."""
    if errors:
        rows = [(title, "signal", "rms", "of the signal", "largest")]
        for (record, signal), e in errors.items():
            rms, most = with_unit(number(e.rms, 3), e.unit), with_unit(number(e.largest, 3), e.unit)
            rows.append((record, signal, rms, percent(e.relative, 3), most))
        yield from columns(rows)


def _data(fit: FitFields) -> Iterator[str]:
    if fit.findings:
        yield "doubtful in the data"
        yield from _indented([*texts(fit.findings, fit.records)])
