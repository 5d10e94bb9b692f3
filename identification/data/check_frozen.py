"""Signals that stand still while they should not: a lost encoder, a recorder that repeats."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.data.findings import Finding
from identification.data.view import Array, View, constant_runs, count_of

Counts = NDArray[np.intp]

RUN = 8
"""Equal values in a row that a signal with noise does not have."""
REPEATED = 0.02
"""Share of equal neighbours up to which a signal counts as one that never repeats."""
LOST = 0.2
"""Share of a record that may be frozen before nothing can come of it."""
JUMP = 8.0
"""Step after a frozen stretch, over the usual largest one, that betrays it."""


def of_frozen(view: View) -> Iterator[Finding]:
    """Stretches of equal values in signals that do not repeat elsewhere, or that end in a jump."""
    for signal, y in view.known():
        if y.size < 50 or np.ptp(y) == 0:
            continue
        steps = np.abs(np.diff(y))
        first, length = constant_runs(y)
        inner = (y[first] < y.max()) & (y[first] > y.min()) | (signal == view.name("x"))
        long = (length >= RUN) & inner
        if not long.any():
            continue
        k, jumped = _longest_that_jumps(y, steps, first, length, long)
        outside = np.ones(y.size, dtype=bool)
        for f, n in zip(first[long].tolist(), length[long].tolist(), strict=True):
            outside[f : f + n] = False
        repeats = float(np.mean(steps[outside[1:]] == 0)) if outside[1:].any() else 1.0
        noisy = repeats < REPEATED and count_of(y) == 0
        if not jumped and not noisy:
            continue
        if not jumped:
            k = int(np.argmax(np.where(long, length, 0)))
        begin, end = int(first[k]), int(first[k] + length[k] - 1)
        after = f", then jumps by {steps[end]:.3g} {view.record.units[signal]}" if jumped else ""
        lost = length[k] > LOST * y.size and noisy
        fatal = (jumped and signal == view.name("x")) or (lost and signal in view.roles.values())
        elsewhere = ", while it never repeats elsewhere" if noisy else ""
        yield view.finding(
            "frozen",
            signal,
            f"{signal} keeps the value {y[begin]:.6g} for {length[k]} samples from "
            f"{view.at(begin)} on{after}{elsewhere}: the sensor or the recorder stood still.",
            "error" if fatal else "warning",
            begin,
            end,
        )


def _longest_that_jumps(
    y: Array, steps: Array, first: Counts, length: Counts, long: NDArray[np.bool_]
) -> tuple[int, bool]:
    """The longest run of equal values after which the signal is somewhere else."""
    usual = float(np.quantile(steps, 0.995))
    best, found = 0, False
    for k in np.flatnonzero(long).tolist():
        end = int(first[k] + length[k] - 1)
        if end < steps.size and steps[end] > JUMP * max(usual, count_of(y)):
            if not found or length[k] > length[best]:
                best = k
            found = True
    return best, found
