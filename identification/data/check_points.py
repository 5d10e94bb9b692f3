"""Doubts about points of a friction curve."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.view import View

FEWEST = 4
WRONG = 0.2
"""Share of points whose force goes with the motion below which the sign is wrong."""


def of_points(view: View) -> Iterator[Finding]:
    """Too few points, one direction, one speed, a force that drives instead of braking."""
    record = view.record
    if "v" not in record or "F" not in record:
        return
    v, force = record["v"], record["F"]
    if record.size < FEWEST:
        yield view.finding("short", "v", f"There are {record.size} points only.", "warning")
    if np.ptp(v) == 0 or np.ptp(force) == 0:
        name = "v" if np.ptp(v) == 0 else "F"
        yield view.finding("constant", name, f"{name} is {record[name][0]:g} throughout.", "error")
        return
    moving = np.abs(v) > 0.01 * np.abs(v).max()
    both = min(np.mean(v > 0), np.mean(v < 0)) > 0.1
    around = float(np.median(force)) if both else 0.0
    if np.mean(v[moving] * (force[moving] - around) > 0) < WRONG:
        yield view.finding(
            "sign",
            "F",
            "F is opposite to v in most points: friction is counted as what the drive needs, so "
            "F v > 0; turn one sign round.",
            "error",
        )
    if not both:
        yield view.finding(
            "one-way", "v", "All points are of one direction: friction cannot be told from a "
            "constant force.", "warning",
        )  # fmt: skip
