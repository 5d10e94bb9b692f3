"""Whether the motion asks enough of the drive: accelerations for the mass, speeds for the law."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough
from identification.data.view import View

UNSURE = 3.0
"""Rough mass over its standard error below which the accelerations are too small."""
SPREAD = 1.7
"""Speed that 90 % of the way stay below, over that which 10 % do: less is one speed."""
MOST = 0.97
"""Share of the time at rest beyond which hardly anything moved."""


def of_excitation(view: View, model: Rough | None) -> Iterator[Finding]:
    """Too small accelerations, one speed only, hardly any motion."""
    if model is None or not model.clean:
        if model is not None:
            yield view.finding(
                "excitation",
                view.name("x"),
                f"The accelerations do not stand above the noise of {view.name('x')}: a mass "
                "cannot be told from these data.",
                "warning",
            )
        return
    if abs(model.sure(0)) < UNSURE:
        unit = "kg m^2" if view.record.units[view.name("x")] == "rad" else "kg"
        yield view.finding(
            "excitation",
            view.name("x"),
            f"The accelerations are too small to tell a mass: a rough one is {model.values[0]:.2g} "
            f"+- {model.errors[0]:.1g} {unit}; give it as fixed.",
            "warning",
        )
    moving = model.moving
    if moving.mean() < 1 - MOST:
        yield view.finding(
            "excitation",
            view.name("x"),
            f"The drive moves in {moving.mean():.1%} of the time only.",
            "warning",
        )
    speed = np.abs(model.v[moving])
    if speed.size > 20:
        low, high = np.quantile(speed, (0.1, 0.9))
        if high < SPREAD * low:
            yield view.finding(
                "speeds",
                view.name("x"),
                f"Most of the motion is at one speed, {low:.3g} to {high:.3g} "
                f"{view.record.units[view.name('x')]}/s: how friction depends on velocity cannot "
                "be told.",
                "warning",
            )
