"""An identification as text: Markdown tables, readable as they stand."""

from collections.abc import Iterable, Sequence
from itertools import zip_longest
from math import isfinite

import numpy as np

from identification.old.errors import Errors
from identification.old.published import EMPS, Published
from identification.old.result import Estimate, Identification


def report(found: Identification) -> str:
    """Parameters with 95 % intervals, correlation, errors, and what the data cannot tell."""
    sections = [
        f"# Identification of `{found.law}` from {found.errors.data}",
        f"{found.message} ({found.iterations} iterations). Position filtered at "
        f"{found.filter.cutoff:g} Hz, {found.signals.kept.size} equations.",
        "## Parameters",
        _parameters(found),
        *_remarks(found),
        "## Correlation of the estimates",
        _correlation(found),
        "## Errors",
        _errors(found),
    ]
    if found.benchmark == "EMPS":
        sections += [
            "## Beside the published models (Janot et al. 2019)",
            *_emps(found),
        ]
    return "\n\n".join(sections) + "\n"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table with padded columns."""
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(map(len, column)) for column in zip_longest(*lines, fillvalue="")]
    text = [
        "| " + " | ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) + " |"
        for line in lines
    ]
    rule = "|" + "|".join("-" * (width + 2) for width in widths) + "|"
    return "\n".join([text[0], rule, *text[1:]])


def _number(value: float | None, digits: int = 5) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def _parameters(found: Identification) -> str:
    rows: list[list[str]] = []
    unit_load = float(found.drive.N) == 1.0
    for name, e in found.parameters.items():
        as_level = unit_load and name in found.levels
        shown = found.levels[name] if as_level else e
        interval = f"{_number(shown.lower95)} ... {_number(shown.upper95)}" if shown.lower95 else ""
        rows.append(
            [
                name,
                _number(shown.value, 6),
                shown.unit,
                _number(shown.standard_error, 3),
                _number(shown.block_error, 3),
                interval,
                f"fixed: {e.note}" if e.fixed else e.note,
            ]
        )
    return table(
        ["parameter", "value", "unit", "standard error", "block error", "95 % interval", "note"],
        rows,
    )


def _remarks(found: Identification) -> list[str]:
    remarks = [
        "The standard error assumes white residuals; the block error is their scatter over 24 "
        "pieces of the record. The interval takes the larger one."
    ]
    if float(found.drive.N) == 1.0 and found.levels:
        names = ", ".join(found.levels)
        remarks.append(
            f"The normal force is taken as 1 N, so {names} read as force levels in newtons."
        )
    for group in found.undetermined:
        what = (
            f"{group[0]} has no influence on the force in this record"
            if len(group) == 1
            else f"{', '.join(group)} cannot be told apart by this record"
        )
        remarks.append(f"**Not identifiable:** {what}; fix one with `fixed=`.")
    return remarks


def _correlation(found: Identification) -> str:
    rows = [
        [name, *(f"{c:+.2f}" if isfinite(c) else "" for c in found.correlation[i, : i + 1])]
        + [""] * (len(found.names) - i - 1)
        for i, name in enumerate(found.names)
    ]
    return table(["", *found.names], rows)


def _errors(found: Identification) -> str:
    records = [e for e in (found.errors, found.validation) if e is not None]
    rows = [_error_row("identified", e) for e in records]
    text = table(_error_header(), rows)
    if found.cross_validation:
        crossed = found.cross_validation
        text += (
            f"\n\nCross-validation inside the record: {crossed['force_relative']:.3g} % force "
            f"error on {crossed['folds']:.0f} pieces left out in turn, "
            f"{crossed['worst']:.3g} % on the worst."
        )
    return text


def _error_header() -> list[str]:
    return [
        "",
        "record",
        "force [%]",
        "force [N]",
        "position, no feedback [mm]",
        "closed loop x [%]",
        "v [%]",
        "a [%]",
        "force [%]",
    ]


def _error_row(name: str, e: Errors) -> list[str]:
    c = e.closed_loop
    closed = ["", "", "", ""] if c is None else [f"{y:.3g}" for y in (c.x, c.v, c.a, c.force)]
    force = [f"{e.force_relative:.3f}", f"{e.force_rms:.3g}"]
    return [name, e.data, *force, f"{1e3 * e.position_rms:.2f}", *closed]


def _emps(found: Identification) -> list[str]:
    """Parameters and errors beside the published ones."""
    ours = _in_published_names(found)
    names = list(dict.fromkeys([*ours, *(n for model in EMPS for n in model.parameters)]))
    rows = [["ours", *(_both(ours.get(name)) for name in names)]]
    rows += [
        [f"published, {model.name}", *(_pair(model.parameters.get(name)) for name in names)]
        for model in EMPS
    ]
    errors = [_error_row("ours", e) for e in (found.errors, found.validation) if e is not None]
    for model in EMPS:
        errors += _published_rows(model)
    return [
        table(["model", *names], rows),
        "Value (standard error); m in kg, F_v in N s/m, F_c and offset in N.",
        table(_error_header(), errors),
    ]


def _in_published_names(found: Identification) -> dict[str, Estimate]:
    """m, F_v, F_c and offset of a Coulomb and viscous law, also with two directions."""
    renamed = {"mu_d": "F_c", "sigma_2": "F_v"}
    ours: dict[str, Estimate] = {}
    for name in found.names:
        stem = next((s for s in renamed if name == s or name in (f"{s}_pos", f"{s}_neg")), None)
        if stem is not None:
            key = renamed[stem] + name.removeprefix(stem)
            ours[key] = found.levels.get(name, found.parameters[name])
        elif name in ("m", "offset"):
            ours[name] = found.parameters[name]
    return ours


def _both(e: Estimate | None) -> str:
    return "" if e is None else _pair((e.value, e.standard_error))


def _pair(pair: tuple[float, float | None] | None) -> str:
    if pair is None:
        return ""
    value, error = pair
    return f"{value:.4f}" + ("" if error is None or not np.isfinite(error) else f" ({error:.3f})")


def _published_rows(model: Published) -> list[list[str]]:
    rows: list[list[str]] = []
    for i, record in enumerate(("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")):
        force = model.force_relative[i]
        closed = ["", "", "", ""] if model.closed_loop is None else model.closed_loop[i]
        numbers = [c if isinstance(c, str) else f"{c:.3g}" for c in closed]
        position = f"{1e3 * model.position_rms[i]:.2f}"
        rows.append([f"published, {model.name}", record, f"{force:.3f}", "", position, *numbers])
    return rows
