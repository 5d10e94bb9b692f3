"""Columns held in Python: arrays by name, a dict of them, a frame of pandas or the like."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from identification.data.raw import Array, Column, Raw, label, only_gaps
from symfric.foundation import checks

ASSUMED = {"t": "s", "x": "m", "v": "m/s", "a": "m/s^2", "force": "N", "F": "N", "N": "N"}
"""Units of arrays about which nobody says anything: numbers in Python are SI everywhere here."""


def columns_of(name: str, frame: object, arrays: Mapping[str, object]) -> tuple[Raw, bool]:
    """The columns of `frame` and `arrays`, and whether they come from a frame.

    A frame is what has `columns` and gives one by its name: pandas, polars. A mapping holds
    arrays. Times with a date become seconds from the first one.

    Raises:
        ValueError: neither, columns that are no vectors or of different lengths.
    """
    where = f"data '{name}'"
    given: dict[str, object] = {}
    framed = hasattr(frame, "columns") and hasattr(frame, "__getitem__")
    if framed:
        held: Any = frame
        given = {str(key): held[key] for key in held.columns}
        index = getattr(held, "index", None)
        if getattr(index, "name", None) is not None:
            given = {str(getattr(index, "name", "")): index, **given}
    elif isinstance(frame, Mapping):
        given = dict(checks.named(where, frame))
    elif frame is not None:
        raise checks.refused(
            where, "arrays by name or a frame", frame, "write Dataset.of(t=t, x=x, force=force)"
        )
    twice = [key for key in arrays if key in given]
    if twice:
        raise ValueError(f"{where}: expected every column once, got {', '.join(twice)} twice")
    columns = tuple(_column(where, key, v) for key, v in (given | dict(arrays)).items())
    if not columns:
        raise ValueError(f"{where}: expected columns such as t=..., x=..., force=..., got none")
    labels = [c.label for c in columns]
    if len(set(labels)) < len(labels):
        raise ValueError(f"{where}: expected every column once, got {', '.join(labels)}")
    sizes = {c.label: c.values.size for c in columns}
    if len(set(sizes.values())) > 1:
        got = ", ".join(f"{key}: {size}" for key, size in sizes.items())
        raise ValueError(f"{where}: expected columns of one length, got {got}")
    return Raw(name, columns, verb="data"), framed


def _column(where: str, key: str, values: object) -> Column:
    name, said = label(key)
    if isinstance(values, np.ma.MaskedArray):  # what is masked was not measured
        masked: Any = values  # pyright: ignore[reportUnknownVariableType]
        values = masked.astype(float).filled(np.nan) if masked.dtype.kind in "iuf" else masked
    try:
        found = np.asarray(values)
    except (ValueError, TypeError):
        raise checks.refused(f"{where}: {key}", "a vector of numbers", values) from None
    if found.ndim == 2 and min(found.shape) == 1:  # a vector as MATLAB has them
        found = found.ravel()
    if found.dtype.kind in "mM" and found.ndim == 1 and found.size:
        seconds = (found - found[0]).astype("timedelta64[ns]").astype(np.int64) * 1e-9
        return Column(name, "s", seconds, _problem(seconds))
    if found.ndim != 1:
        raise checks.refused(f"{where}: {key}", "a vector of numbers", values)
    numbers, problem = np.full(found.size, np.nan), ""
    if found.dtype.kind in "iufb":
        numbers = found.astype(float)
    elif found.dtype.kind == "O":
        for k, item in enumerate(found):
            number = checks.as_number(item)
            if number is None:
                problem = f"sample {k}: expected a number, got {checks.shown(item)}"
                break
            numbers[k] = number
    else:
        problem = f"sample 0: expected a number, got {checks.shown(found[0])}" if found.size else ""
    return Column(
        name, said, numbers, problem or _problem(numbers), not problem and only_gaps(numbers)
    )


def _problem(values: Array) -> str:
    bad = np.flatnonzero(~np.isfinite(values))
    if not bad.size:
        return ""
    return f"sample {bad[0]}: expected a finite number, got {values[bad[0]]} ({bad.size} such)"
