"""Checks that `simulate` and `simulate_many` have in common."""

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.foundation.parameters import check_names
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS
from symfric.model import finite

Array = NDArray[np.float64]
LOOSE = 1e-5
"""Above this relative tolerance whole stick phases may be lost without a sign of it."""


def check_span(where: str, t_start: float, t_end: float, rtol: float) -> None:
    """Refuse an empty span and tolerances out of range; warn of a loose one."""
    t_start, t_end = finite(f"{where}: t_start", t_start), finite(f"{where}: t_end", t_end)
    if t_end <= t_start:
        raise ValueError(f"{where}: expected t_end > t_start = {t_start:g} s, got {t_end:g} s")
    if not 1e-13 <= rtol <= 0.1:
        raise ValueError(f"{where}: expected 1e-13 <= rtol <= 0.1, got {rtol:g}")
    if rtol > LOOSE:
        warnings.warn(
            f"{where}: rtol = {rtol:g} is above {LOOSE:g}; whole stick phases may be lost "
            "without a sign of it, compare with a tighter run",
            UserWarning,
            stacklevel=3,
        )


def check_times(where: str, t_start: float, t_end: float, t_eval: ArrayLike) -> Array:
    """`t_eval` as an array of increasing times inside the span."""
    times = np.asarray(t_eval, dtype=float)
    if (
        times.ndim != 1
        or not times.size
        or not (t_start <= times[0] and times[-1] <= t_end and (np.diff(times) > 0).all())
    ):
        raise ValueError(
            f"{where}: t_eval: expected increasing times in [{t_start:g}, {t_end:g}] s, "
            f"got an array of shape {times.shape}"
        )
    return times


def chosen(where: str, name: str, rtol: float) -> Method:
    """The adaptive method of this name; "auto" is Rodas5P, and Radau5 at loose tolerances.

    Raises:
        ValueError: unknown name, or a method of fixed steps.
    """
    if name in METHODS and name not in ADAPTIVE:
        raise ValueError(
            f"{where}: method: expected one with error control, one of {', '.join(ADAPTIVE)}, got "
            f"{name}, which has fixed steps; it is for flow and for the C of plants"
        )
    check_names(f"{where}: method", [name], ["auto", *ADAPTIVE])
    automatic = "radau5" if rtol > LOOSE else "rodas5p"
    return ADAPTIVE[automatic if name == "auto" else name]
