"""Units of measured signals in channels, headers and calls.

The grammar is that of `symfric.foundation.units`. In addition, recorders use words (`sec`,
`newton`), letters of either case, and speeds as `1/min`.
"""

from collections.abc import Mapping
from functools import cache
from math import isfinite
from re import findall
from typing import NamedTuple

from symfric.foundation.units import WORDS, Unit, nearest, parsed, per_second, written

SPEEDS = ("1/min", "min^-1")
"""Spellings of revolutions per minute used by recorders."""
PURE = ("1", "%")
"""Dimensionless units; counts of a recorder have no size in SI units."""
PREFIXED = {"s": "num", "m": "numck", "N": "umckM", "rad": "um", "V": "umk", "A": "um", "W": "mk"}
COMMON = {
    *WORDS, *PREFIXED, *(p + s for s, prefixes in PREFIXED.items() for p in prefixes), "1", "%",
    "min", "h", "deg", "rev", "arcmin", "arcsec", "in", "ft", "g", "kg", "kgf", "lbf", "K", "rpm",
}  # fmt: skip
"""Symbols that denote units in a header even without brackets, as in `x_mm` but not in `tau_d`."""


class Channel(NamedTuple):
    """Canonical channel.

    Attributes:
        units: SI units; the first one is for linear drives.
        aliases: names of its column; those of several letters are case-insensitive.
        examples: examples of accepted units, for messages.
    """

    units: tuple[str, ...]
    aliases: tuple[str, ...]
    examples: str


FORCES = "N, mN, kN, N m, N mm, mN m"
CHANNELS: Mapping[str, Channel] = {
    "t": Channel(("s",), ("t", "time", "timestamp"), "s, ms, us, min"),
    "x": Channel(
        ("m", "rad"),
        ("x", "q", "qm", "pos", "position", "displacement", "angle", "theta", "phi"),
        "m, cm, mm, um, rad, mrad, deg, rev",
    ),
    "v": Channel(
        ("m/s", "rad/s"),
        ("v", "qd", "dq", "vel", "velocity", "speed", "omega"),
        "m/s, mm/s, rad/s, deg/s, rpm",
    ),
    "a": Channel(
        ("m/s^2", "rad/s^2"),
        ("a", "qdd", "ddq", "acc", "acceleration"),
        "m/s^2, mm/s^2, rad/s^2, deg/s^2",
    ),
    "force": Channel(("N", "N m"), ("force", "F", "f", "torque", "tau"), FORCES),
    "F": Channel(("N", "N m"), ("F", "f", "force", "friction", "torque", "tau"), FORCES),
    "N": Channel(("N",), ("N", "normal", "normal_force"), "N, mN, kN"),
}
"""Canonical channels of records over time, and F and N of points."""
_OF_COUNTS = ("counts", "count", "encoder", "encoder_counts")
OF_DRIVE: Mapping[str, Channel] = {
    **{key: CHANNELS[key] for key in ("t", "a")},
    "x": CHANNELS["x"]._replace(
        units=("m", "rad", "1"), aliases=(*CHANNELS["x"].aliases, *_OF_COUNTS),
        examples="counts, rad, deg, rev, m, mm",
    ),
    "v": CHANNELS["v"]._replace(units=("m/s", "rad/s", "1/s")),
    "current": Channel(
        ("A",),
        ("current", "motor_current", "current_actual", "i", "I", "iq", "i_q", "i_a", "i_motor"),
        "A, mA",
    ),
}  # fmt: skip
"""Canonical channels of the log of a `Drive`, before its conversion to the load."""


@cache
def unit(text: str) -> Unit | None:
    """Return the unit denoted by `text`; None if it is not a unit of a signal."""
    plain = written(text)
    if plain.lower() in SPEEDS:
        plain = "rpm"
    found = parsed(plain) or parsed(nearest(plain) or "?")
    if found is None or not all(isfinite(power) for _, power in found.powers):
        return None
    known = found.powers or plain in (*PURE, "")
    return found if known and "degF" not in dict(found.powers) else None


def is_common(text: str) -> bool:
    """Return True if `text` denotes a unit even without brackets."""
    symbols = findall(r"[A-Za-z]+|[%1]", written(text))
    return unit(text) is not None and all(s in COMMON or s.lower() in WORDS for s in symbols)


def by_channel(where: str, text: str, known: Mapping[str, Channel] = CHANNELS) -> dict[str, str]:
    """Return the units of the canonical channels from the short form `rad, N m`.

    Each unit applies to the channels that can have it. Velocity and acceleration follow the
    position unless their units are given: `mm, N` implies mm/s.

    Raises:
        ValueError: not a unit, a unit of no canonical channel, or two units for one channel.
    """
    found: dict[str, str] = {}
    for part in (p.strip() for p in text.split(",")):
        meant = unit(part) if part else None
        channels = [
            name for name, c in known.items() if meant and meant.si in c.units and name != "N"
        ]
        if not channels:
            raise ValueError(
                f"{where}: expected units of position and force such as 'rad, N m', got '{part}'; "
                "other signals take units={'name': 'unit'}"
            )
        if channels[0] in found:
            raise ValueError(
                f"{where}: expected one unit for {channels[0]}, got '{found[channels[0]]}' and "
                f"'{part}'"
            )
        found.update(dict.fromkeys(channels, part))
    if "x" in found:
        found.setdefault("v", per_second(found["x"]))
        found.setdefault("a", per_second(per_second(found["x"])))
    elif "v" in found:
        given = unit(found["v"])
        turning = given is not None and given.si.startswith("rad")
        found["x"] = "rad" if turning else "m"
        found.setdefault("a", f"{found['x']}/s^2")
    return found
