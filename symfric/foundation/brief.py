"""What data say of themselves in a few lines: sizes and ranges of arrays, not their numbers.

A frozen dataclass with arrays takes it by `__repr__ = brief`.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import is_casadi
from symfric.foundation.shown import HEIGHT, WIDTH, among, cut

SHORT = 8
"""Numbers that are written out."""


def brief(self: Any) -> str:
    """Class and fields of a dataclass, a line each, within a screen."""
    lines = [f"  {item.name}: {told(getattr(self, item.name))}" for item in fields(self)]
    if len(lines) > HEIGHT - 2:
        lines = [*lines[: HEIGHT - 2], f"  ... {len(lines) - HEIGHT + 2} more"]
    return "\n".join([f"<{type(self).__name__}", *(cut(line, WIDTH - 1) for line in lines)]) + ">"


def told(value: Any) -> str:
    """A value in a line."""
    if isinstance(value, np.ndarray):
        return _array(cast(NDArray[Any], value))
    if is_casadi(value):
        return f"expression of shape {value.shape}"
    if isinstance(value, Mapping):
        inside = cast(Mapping[object, object], value)
        return among(f"{name}: {told(held)}" for name, held in inside.items()) or "none"
    if isinstance(value, tuple | list):
        parts = [told(one) for one in cast(tuple[object, ...], value)]
        return f"({among(parts)})"
    if isinstance(value, float):
        return f"{value:.6g}"
    return " ".join(repr(value).split())


def _array(value: NDArray[Any]) -> str:
    if value.size <= SHORT and value.ndim == 1:
        return f"[{', '.join(told(x.item()) for x in value)}]"
    shape = " x ".join(map(str, value.shape))
    finite = value[np.isfinite(value)] if value.dtype.kind in "iuf" else value[:0]
    reach = f" from {finite.min():.6g} to {finite.max():.6g}" if finite.size else ""
    return f"{shape} values{reach}"
