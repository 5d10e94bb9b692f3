"""What a user wrote, as Python again."""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from math import inf
from typing import Any

import numpy as np

from identification.data.dataset import Dataset
from identification.unknowns.spec import Above, Range, Tied
from symfric.foundation.parameters import Parametric
from symfric.model import Model

SHOWN = 6
"""Numbers of an array that are written out."""


def written(value: object) -> str:
    """Python that says `value`, without what is as by default; data and models by a name.

    Long arrays are three dots.
    Fields without a default stand first, without their names.
    """
    if isinstance(value, Dataset):
        return "data"
    if isinstance(value, Model):
        return value.name
    if isinstance(value, Range | Above | Tied):
        return _rule(value)
    if isinstance(value, np.ndarray) and value.size > SHOWN:
        return "..."
    if isinstance(value, Mapping):
        items: Mapping[Any, Any] = value  # pyright: ignore[reportUnknownVariableType]
        return f"{{{', '.join(f'{k!r}: {written(v)}' for k, v in items.items())}}}"
    if callable(value) and not is_dataclass(value):
        return getattr(value, "__name__", "function")
    if not is_dataclass(value) or isinstance(value, Parametric):
        return repr(value)
    given: list[str] = []
    for item in fields(value):
        own = getattr(value, item.name)
        if item.default is MISSING:
            given.append(written(own))
        elif own is not item.default and not _same(own, item.default):
            given.append(f"{item.name}={written(own)}")
    return f"{type(value).__name__}({', '.join(given)})"


def _same(value: object, default: object) -> bool:
    plain = (str, int, float, tuple)
    return isinstance(value, plain) and isinstance(default, plain) and value == default


def _rule(rule: Range | Above | Tied) -> str:
    """What `log`, `linear`, `above` or `tied` was called with."""
    if isinstance(rule, Tied):
        name, factor = (getattr(rule.rule, n, None) for n in ("name", "factor"))
        return f"tied({name!r}, {factor!r})" if name else f"tied({written(rule.rule)})"
    start = [] if rule.start is None else [f"start={rule.start!r}"]
    if isinstance(rule, Above):
        upper = [repr(rule.upper)] if rule.upper < inf else []
        return f"above({', '.join([repr(rule.name), *upper, *start])})"
    if rule.logarithmic is None and rule.start is not None and rule.lower == -inf:
        return repr(rule.start)
    kind = {True: "log", False: "linear", None: ""}[rule.logarithmic]
    return f"{kind}({', '.join([repr(rule.lower), repr(rule.upper), *start])})"
