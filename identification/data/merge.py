"""Two recorders of one experiment as one record."""

from dataclasses import replace
from typing import Literal

import numpy as np

from identification.data.delay import Delay, estimated_delay
from identification.data.record import Record
from identification.data.resample import GAP, SHORTEST, interpolated
from symfric.foundation import checks


def merged(
    first: Record,
    second: Record,
    on: tuple[str, str],
    shift: float | Literal["estimate"] = "estimate",
    drift: float | Literal["estimate"] = 0.0,
) -> list[Record]:
    """The signals of both at the times of the first, one record for each piece without a gap.

    Args:
        first: gives the times.
        second: is interpolated; where it has a gap, the record is split.
        on: a quantity that both hold, by its name in each; of the second it is dropped, unless
            it has a name of its own.
        shift: what is added to the times of the second [s].
        drift: how much faster the first clock runs, relative.

    Raises:
        ValueError: signals of one name in both, no common time, or see `estimated_delay`.
    """
    where = f"data '{first.name}': merged with '{second.name}'"
    names = checks.names(f"{where}: on", on) if len({*on}) == 2 else tuple(on)
    if len(names) != 2:
        raise checks.refused(f"{where}: on", "two names", on)
    pair = (first.channel(names[0]), second.channel(names[1]))
    if shift == "estimate":
        delay = estimated_delay(first, second, pair, drift == "estimate")
        if drift != "estimate" and drift != 0:
            raise ValueError(f"{where}: expected drift='estimate' with an estimated shift")
    else:
        moved = checks.number(f"{where}: shift", shift, unit="s")
        rate = checks.number(f"{where}: drift", drift)
        delay = Delay(moved, rate, float(first.time.mean()), 0.0, 0.0, 1.0)
    taken = [key for key in second.signals if key != pair[1] or key not in first.signals]
    twice = [key for key in taken if key in first.signals]
    if twice:
        raise ValueError(
            f"{where}: expected signals of different names, got {', '.join(twice)} in both; "
            "use renamed()"
        )
    return _joined(where, first, second, taken, delay)


def _joined(
    where: str, first: Record, second: Record, taken: list[str], delay: Delay
) -> list[Record]:
    t, at = second.time, delay.second(first.time)
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 2)
    there = (at >= t[0]) & (at <= t[-1]) & (t[k + 1] - t[k] <= GAP * second.median_step)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]])))
    runs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    kept = [slice(a, b) for a, b in runs if b - a >= SHORTEST]
    if not kept:
        raise ValueError(
            f"{where}: expected a time that both have in common, got {first.time[0]:g} ... "
            f"{first.time[-1]:g} s and {t[0] + delay.shift:g} ... {t[-1] + delay.shift:g} s"
        )
    error = f" +- {delay.shift_error:.1g}" if delay.shift_error else ""
    name = f"{first.name} + {second.name} (shifted by {delay.shift:.6g}{error} s)"
    found: list[Record] = []
    for part in kept:
        cut = first.at(part)
        signals = {**cut.signals, **{key: interpolated(second, key, at[part]) for key in taken}}
        units = {**first.units, **{key: second.units[key] for key in taken}}
        found.append(replace(cut, name=name, signals=signals, units=units))
    return found
