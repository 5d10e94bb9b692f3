"""What a rough drive with any curve of friction leaves of the force: a hum, one side too large."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough, one_way, with_column
from identification.data.view import View

LINE = 0.45
"""Share of what is left that lies in one line of its spectrum: a hum."""
LOUD = 0.02
"""Its amplitude over the spread of the force from which on it is told."""
PERIODS, CLEAR, ANSWER = 8, 20.0, 0.01
"""A line of the velocity: periods in the record, power over that beside it, share of all power."""
HARMONICS = (1, 2)
"""Of an excitation, that friction may leave in the force."""
UNEQUAL, SURE = 0.04, 6.0
"""Difference of the mass between both directions, relative, and in standard errors."""


def of_residue(view: View, free: Rough | None) -> Iterator[Finding]:
    """A periodic force beside the drive; a mass that differs by the direction."""
    if free is None or not free.clean or free.explained < 0.5:
        return
    yield from _hum(view, free)
    if not one_way(free) and abs(free.sure(0)) > SURE:
        yield from _unequal(view, free)


def _hum(view: View, free: Rough) -> Iterator[Finding]:
    limit = 5 * float(np.median(np.abs(free.residual)))
    left, window = np.clip(free.residual, -limit, limit), np.hanning(free.residual.size)
    power = np.abs(np.fft.rfft(left * window)) ** 2
    k = int(np.argmax(power[2:])) + 2
    share = float(power[max(k - 2, 0) : k + 3].sum() / (power.sum() + 1e-300))
    size = 2 * float(np.sqrt(power[k])) / float(window.sum())
    loud = size > LOUD * float(np.ptp(np.quantile(free.force, (0.25, 0.75))))
    if share > LINE and loud and not any(_answered(free, round(k / n)) for n in HARMONICS):
        name = view.name("force")
        yield view.finding(
            "hum",
            name,
            f"{name} hums: beside what a rough drive needs there is a sine of {size:.2g} "
            f"{view.record.units[name]} and {k / left.size / free.step:.3g} Hz, {share:.0%} of "
            "what is left: the mains, or a motion that the position does not show.",
            "warning",
        )


def _answered(free: Rough, k: int) -> bool:
    """Whether the velocity has a line of its own at bin k: an excitation, no hum.

    Not asked of less than `PERIODS` periods, where a line cannot be told from a move; so a slow
    excitation that only bends bristles can still be called a hum.
    """
    if k < PERIODS:
        return False
    power = np.abs(np.fft.rfft((free.v - free.v.mean()) * np.hanning(free.v.size))) ** 2
    line = power[k - 2 : k + 3]
    beside = np.concatenate([power[k // 2 : k - 3], power[k + 4 : 2 * k]])
    out = float(line.max()) > CLEAR * float(np.median(beside))
    return out and float(line.sum()) > ANSWER * float(power.sum())


def _unequal(view: View, free: Rough) -> Iterator[Finding]:
    value, error = with_column(free, free.a * np.sign(free.v) * free.moving)
    ratio = value / free.values[0]
    if abs(ratio) > UNEQUAL and abs(value) > SURE * error:
        name = view.name("force")
        yield view.finding(
            "unequal",
            name,
            f"{name} asks for a mass {2 * abs(ratio):.0%} larger "
            f"{'forwards' if ratio > 0 else 'backwards'}: its gain differs by its sign, or it is "
            "clipped or filtered on one side.",
            "warning",
        )
