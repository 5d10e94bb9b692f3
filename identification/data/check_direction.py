"""Force against motion: a flipped sign, exchanged columns, a force that has no part in it."""

from collections.abc import Iterator

import numpy as np

from identification.data.findings import Finding
from identification.data.rough import Rough, one_way, rough_model
from identification.data.view import View

SURE = 5.0
"""Standard errors that make a statement."""
LITTLE, MUCH = 0.5, 0.8
"""Shares of the force that the rough model explains: of a wrong and of a right pair of columns."""
NOTHING = 0.05
"""Share of the force below which it has no part in the motion."""


def of_direction(view: View, model: Rough | None) -> Iterator[Finding]:
    """A drive whose friction puts power in, and pairs of columns that make sense the other way."""
    if model is None:
        return
    names = view.name("force"), view.name("x")
    swapped = rough_model(view, exchanged=True)
    if (
        swapped is not None
        and model.explained < LITTLE
        and swapped.explained > MUCH
        and swapped.explained > model.explained + 0.4
    ):
        yield view.finding(
            "swapped",
            names[0],
            f"{names[0]} moves as a position and {names[1]} as a force (a rough drive explains "
            f"{swapped.explained:.0%} of it that way, {model.explained:.0%} as it is): the columns "
            "are exchanged.",
            "error",
        )
        return
    both = not one_way(model)
    _, level, viscous, *_ = model.values
    moved = np.sum(np.abs(model.v[model.moving]))
    put_in = level * moved + viscous * np.sum(model.v**2)
    sure = max(-model.sure(1) if level < 0 else 0.0, -model.sure(2) if viscous < 0 else 0.0)
    if both and put_in < 0 and sure > SURE and model.explained > LITTLE:
        against = " and accelerates against it" if model.sure(0) < -SURE else ""
        yield view.finding(
            "sign",
            names[0],
            f"{names[0]} brakes the motion that it drives{against}: the sign of {names[0]} or of "
            f"{names[1]} is wrong: data.scaled({{'{names[0]}': -1}}).",
            "error",
        )
    elif both and model.clean and model.explained < NOTHING and model.independent > 100:
        yield view.finding(
            "unrelated",
            names[0],
            f"A rough drive explains {max(model.explained, 0.0):.0%} of {names[0]}: it has nothing "
            f"to do with the motion of {names[1]}, or there is more at work than one mass.",
            "error" if _white(view) else "warning",
        )
    if both and model.sure(0) < -SURE and put_in > 0 and model.explained > LITTLE:
        yield view.finding(
            "sign",
            names[0],
            f"{names[0]} accelerates against the motion (a rough mass is {model.values[0]:.3g} +- "
            f"{model.errors[0]:.1g}): it is late, or something else drives, too.",
            "warning",
        )


def _white(view: View) -> bool:
    """Whether the force is noise: neighbours have nothing to do with each other."""
    force = view.signal("force")
    return force is not None and abs(float(np.corrcoef(force[1:], force[:-1])[0, 1])) < 0.2
