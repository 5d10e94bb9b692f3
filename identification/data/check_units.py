"""Numbers that no machine has: units that were forgotten or taken for others."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough
from identification.data.view import View

LIMITS = {
    "m": (1e-9, 50.0, 1e5),
    "rad": (1e-9, 1e5, 1e9),
    "N": (1e-9, 1e6, 1e10),
    "N m": (1e-12, 1e6, 1e10),
    "m/s": (1e-9, 100.0, 1e5),
    "rad/s": (1e-9, 1e4, 1e8),
}
"""Ranges: smaller than the first or larger than the last is an error, than the second a doubt."""
FASTEST = {"m": (50.0, 1e5), "rad": (1e4, 1e8)}
"""Speeds of a position: doubt, error."""
TOGETHER = (("m", "N"), ("rad", "N m"))


def of_units(view: View, model: Rough | None) -> Iterator[Finding]:
    """Units that do not belong together, and ranges that no machine has."""
    record = view.record
    mixed = [record.units[view.roles[r]] for r in ("x", "force") if r in view.roles]
    if len(mixed) == 2 and "" not in mixed and tuple(mixed) not in TOGETHER:
        yield view.finding(
            "units",
            view.name("force"),
            f"{view.name('x')} is in {mixed[0]} and {view.name('force')} in {mixed[1]}: a slide "
            "needs m and N, a shaft rad and N m.",
            "error",
        )
    for signal in view.roles.values():
        low, doubt, high = LIMITS.get(record.units[signal], (0.0, np.inf, np.inf))
        range_ = float(np.ptp(record.signals[signal]))
        if 0 < range_ < low or range_ > doubt:
            yield view.finding(
                "units",
                signal,
                f"{signal} has a range of {range_:.3g} {record.units[signal]}: check its unit.",
                "error" if range_ < low or range_ > high else "warning",
            )
    if model is not None and model.clean:
        unit = record.units[view.roles["x"]]
        fastest = float(np.quantile(np.abs(model.v), 0.99))
        doubt, high = FASTEST.get(unit, (np.inf, np.inf))
        if fastest > doubt:
            yield view.finding(
                "units",
                view.roles["x"],
                f"{view.roles['x']} moves at {fastest:.3g} {unit}/s: check its unit and that of "
                "the times.",
                "error" if fastest > high else "warning",
            )
