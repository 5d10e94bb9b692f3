"""Doubts about the sample times: gaps, irregular intervals, a unit that cannot be."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.record import JITTER
from identification.data.resample import GAP
from identification.data.view import View

FEWEST, FEW = 20, 50
"""Samples without which nothing can be said, and little."""
SLOW = 0.5
"""Sample interval [s] from which on times may be in ms."""


def of_times(view: View) -> Iterator[Finding]:
    """Gaps, irregular intervals, too few samples, times that may be in another unit."""
    record = view.record
    if record.size < FEW:
        yield view.finding(
            "short",
            "t",
            f"There are {record.size} samples only.",
            "error" if record.size < FEWEST else "warning",
        )
    if record.t is None or record.size < 3:
        return
    intervals = np.diff(record.t)
    usual = float(np.median(intervals))
    gaps = np.flatnonzero(intervals > GAP * usual)
    if gaps.size:
        k = int(gaps[np.argmax(intervals[gaps])])
        yield view.finding(
            "gap",
            "t",
            f"The times have {gaps.size} gap(s), the longest of {intervals[k]:.3g} s at "
            f"{view.at(k)}: data.resampled() makes a record of each piece.",
            "warning",
            k,
            k + 1,
        )
    off = np.abs(intervals - usual)
    off[gaps] = 0.0
    k = int(np.argmax(off))
    if off[k] > 2 * JITTER * usual:
        uneven = float(np.mean(off > 2 * JITTER * usual))
        yield view.finding(
            "irregular",
            "t",
            f"The sample intervals are not equal: {uneven:.1%} are off {usual:.4g} s by more than "
            f"{2 * JITTER:.0%}, most {intervals[k]:.4g} s at {view.at(k)}: use data.resampled().",
            "warning",
            k,
            k + 1,
        )
    whole = bool(np.all(np.abs(record.t - np.rint(record.t)) < 1e-9))
    if usual >= SLOW and whole and record.size >= 200:
        yield view.finding(
            "units",
            "t",
            f"The samples are {usual:g} s apart over {np.ptp(record.t) / 3600:.2g} hours, at whole "
            "seconds: are the times in ms, or row numbers?",
            "warning",
        )
