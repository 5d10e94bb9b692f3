"""Values that the data determine, and intervals of values on which residuals depend nonlinearly.

The linear interval of a value is valid if the residuals are linear up to its ends, with the other
values adapting. Otherwise its ends follow from the profile likelihood. A value is identifiable if

    rise >= 10 at both ends of its range,   rise = min over the others [cost - least cost] / s^2

An example is a Stribeck velocity far below all measured speeds, where the peak vanishes: if it fits
as well, neither the velocity nor the static level is identifiable. Such values have no interval.
The intervals of the other values are extended to include both fits.
Sources: Raue et al., Bioinformatics 25(15), 2009; Davies, Biometrika 64(2), 1977 (a parameter that
exists only under the alternative); the limit is that of Kass and Raftery, J. Am. Stat. Assoc. 90,
1995, for -2 log of a likelihood ratio.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identification.residuals.evaluation import Array
from identification.solving.task import Point, Task
from identification.verdict.covariance import LINEAR, Covariance, bend, without
from identification.verdict.profile import Walk

BENT = 0.1
"""Deviation from linearity (`bend`) above which an interval follows from its profile."""
SHOWN = 10.0
"""Rise of the cost at the ends of the range of a value that shows the value."""
DECADES = 3.0
"""Distance of these ends for a logarithmic value without bounds [decades]."""
POINTS = 3
"""Approximate number of points of a profile to each side."""


Solved = tuple[Task, Point]
"""A solved problem and its minimum."""


def assured(
    whole: Solved, part: Solved, linear: Covariance, steps: Mapping[str, Array]
) -> Covariance:
    """Return the covariance with intervals for nonlinear models, without those that are not shown.

    Args:
        whole: solved task and its minimum.
        part: the same on part of the rows of long records, which suffices for the linearity and to
            show a value.
        linear: linear covariance and intervals.
        steps: changes of the coordinates to the ends of the linear intervals, see `steps_of`.
    """
    names = [*steps]
    bent = {n: [bend(*part, side * steps[n]) for side in (-1.0, 1.0)] for n in names}
    walks = {n: Walk(*whole, linear, n) for n in names if max(bent[n]) > LINEAR}
    found = linear
    for name, walk in walks.items():
        there = None
        if name not in found.notes:
            there = _elsewhere(walk, walk if part is whole else Walk(*part, linear, name))
        found = found if there is None else _without(found, name, there, walk.unknown.unit)
    if found is not linear:
        return found
    for name, walk in walks.items():
        found = _profiled(found, walk, name, bent[name])
    return found


def _elsewhere(whole: Walk, part: Walk) -> Point | None:
    """Return a fit with the value at an end of its range that is as good, None without one.

    A value that part of the rows show is not tested on all of them.
    """
    for c in whole.far(DECADES):
        there = _as_good(part, whole.point.w, c)
        if there is not None and part is not whole:
            there = _as_good(whole, there.w, c)
        if there is not None:
            return there
    return None


def _as_good(walk: Walk, w: Array, c: float) -> Point | None:
    """Return the fit with the value c, searched from w, if the data do not exclude it."""
    there = walk.held_at(w, c)
    if isinstance(there, str) or (there.cost - walk.point.cost) / walk.scale >= SHOWN:
        return None
    return there


def _profiled(found: Covariance, walk: Walk, name: str, bent: list[float]) -> Covariance:
    """Return `found` with the ends of a profile where the residuals are not linear."""
    low, high, i = found.low.copy(), found.high.copy(), found.names.index(name)
    for side, curved, ends in ((-1, bent[0], low), (1, bent[1], high)):
        if curved > BENT:
            _, end, why = walk.side(side, POINTS)
            if end is None:
                return _none(found, [name], why)
            ends[i] = end
    return replace(found, low=low, high=high)


def _without(found: Covariance, name: str, there: Point, unit: str) -> Covariance:
    """Return intervals that include another fit `there`, none for `name` and values like it.

    Values without influence in the other fit have no interval either.
    """
    names = found.names
    value = dict(zip(names, there.values.tolist(), strict=True))[name]
    J = there.evaluation.J / there.sigma[:, None]
    effect = np.linalg.norm(J, axis=0) * np.abs(there.values)
    lost = [n for n, e in zip(names, effect, strict=True) if n == name or e < 1.0]
    half = (found.high - found.low) / 2
    low, high = np.fmin(found.low, there.values - half), np.fmax(found.high, there.values + half)
    verb = "is" if len(lost) == 1 else "are"
    why = f"{name} = {value:.3g}{'' if unit == '1' else ' ' + unit} fits as well"
    text = f"{' and '.join(lost)} {verb} not identifiable: {why}; the other intervals include both."
    return _none(replace(found, low=low, high=high), lost, text)


def _none(found: Covariance, lost: list[str], text: str) -> Covariance:
    """Return `found` without intervals and errors of the values in `lost`."""
    out = np.array([n in lost for n in found.names])
    return replace(
        found,
        matrix=without(found.matrix, out),
        white=without(found.white, out),
        low=np.where(out, np.nan, found.low),
        high=np.where(out, np.nan, found.high),
        sentences=(*found.sentences, text),
        notes={**found.notes, **dict.fromkeys(lost, "not identifiable")},
    )
