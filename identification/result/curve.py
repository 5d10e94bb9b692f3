"""Friction over velocity: what the data say and what the law says."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from identification.data.record import Record
from identification.result.series import Line
from identification.signals.differentiate import differentiate
from symfric.foundation.units import turned
from symfric.laws import Law
from symfric.laws.steady import steady_force
from symfric.scenes import Drive

Array = NDArray[np.float64]

SIDE = 300
"""Points of the law's curve each way, the nearest to rest a millionth of the largest speed."""
DOTS = 4000
"""Measured points that are drawn, over all records."""


@final
@dataclass(frozen=True, eq=False)
class Curve:
    """Friction over velocity.

    Attributes:
        v_unit, F_unit: units.
        law: force of the fitted law in steady sliding, a point for each velocity.
        measured: record -> points (velocity, friction).
        says: how the points come about.
    """

    v_unit: str
    F_unit: str
    law: Line
    measured: dict[str, Line]
    says: str


def of_points(law: Law, N: float, points: dict[str, tuple[Array, Array]], turning: bool) -> Curve:
    """The curve beside measured points (v, F) of each record."""
    measured = _thinned({name: Line(v, F) for name, (v, F) in points.items()})
    return _curve(law, N, measured, turning, "measured points")


def of_drive(drive: Drive, records: Sequence[Record]) -> Curve:
    """The curve of a drive's law beside force - m a - offset of its records.

    Records without position, force or equal intervals have no points.
    """
    measured = _thinned(dict(_frictions(drive, records)))
    says = "measured: force - m a - offset" if measured else "no record has force and position"
    return _curve(drive.law, float(drive.N), measured, drive.turning, says)


def _frictions(drive: Drive, records: Sequence[Record]) -> Iterator[tuple[str, Line]]:
    for record in records:
        if record.t is None or "force" not in record or "x" not in record:
            continue
        try:
            signals = differentiate(record)
        except ValueError:  # unequal intervals, too short: there is no acceleration
            continue
        friction = signals.force - float(drive.m) * signals.a - float(drive.offset)
        yield record.name, Line(signals.equations(signals.v), signals.equations(friction))


def _thinned(lines: dict[str, Line]) -> dict[str, Line]:
    """Every so many points, so that there are not more than `DOTS`."""
    total = sum(line.t.size for line in lines.values())
    every = max(1, -(-total // DOTS))
    return {name: Line(line.t[::every], line.y[::every]) for name, line in lines.items()}


def _curve(law: Law, N: float, measured: dict[str, Line], turning: bool, says: str) -> Curve:
    top = max([float(np.abs(line.t).max(initial=0.0)) for line in measured.values()], default=0.0)
    if top == 0.0:
        scale = law.velocity_scale
        top = 10.0 * float(scale) if np.isfinite(float(scale)) else 1.0
    side = np.geomspace(1e-6 * top, top, SIDE)
    v = np.concatenate([-side[::-1], [0.0], side])
    unit = turned if turning else str
    return Curve(unit("m/s"), unit("N"), Line(v, steady_force(law, v, N)), measured, says)
