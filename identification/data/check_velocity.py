"""A measured velocity against the position, an acceleration against the velocity."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import smoothed
from identification.data.view import View

WIDTH = 12.0
"""Standard deviation of the window under which both are compared, in samples."""
ALIKE = 0.7
"""Correlation that both must have."""
OFF = 0.2
"""Relative error of the scale from which on it is told."""
KNOWN = {
    57.2958: "deg/s taken as rad/s",
    0.0174533: "rad/s taken as deg/s",
    9.5493: "rpm taken as rad/s",
    0.10472: "rad/s taken as rpm",
    6.28319: "rad/s taken as rev/s",
    0.159155: "rev/s taken as rad/s",
    1000.0: "mm/s taken as m/s",
    0.001: "m/s taken as mm/s",
    1e6: "um/s taken as m/s",
    100.0: "cm/s taken as m/s",
    60.0: "per minute taken as per second",
}


def of_velocity(view: View) -> Iterator[Finding]:
    """A velocity of another sign or scale than the position has, likewise an acceleration."""
    record = view.steady
    if record is None or record.size < 100:
        return
    for of, rate in (("x", "v"), ("v", "a")):
        if of not in view.roles or rate not in view.roles:
            continue
        name, other = view.roles[rate], view.roles[of]
        if np.ptp(record[name]) == 0 or np.ptp(record[other]) == 0:
            continue
        edge = int(3 * WIDTH)
        derived = (smoothed(record[other], WIDTH, 1) / record.step)[edge:-edge]
        given = smoothed(record[name], WIDTH)[edge:-edge]
        if derived.std() == 0 or given.std() == 0:
            continue
        alike = float(np.corrcoef(derived, given)[0, 1])
        scale = float(given.std() / derived.std())
        if alike < -ALIKE:
            yield view.finding(
                "sign",
                name,
                f"{name} is opposite to the slope of {other} (correlation {alike:.2f}): the sign "
                "of one is wrong.",
                "error",
            )
        elif alike < ALIKE:
            yield view.finding(
                "velocity",
                name,
                f"{name} is not the slope of {other} (correlation {alike:.2f}).",
                "warning",
            )
        elif abs(scale - 1) > OFF:
            near = [text for known, text in KNOWN.items() if abs(scale / known - 1) < 0.1]
            yield view.finding(
                "units",
                name,
                f"{name} is {scale:.4g} times the slope of {other}: "
                f"{near[0] if near else 'a wrong unit or scale'}.",
                "error" if near or scale > 5 or scale < 0.2 else "warning",
            )
