"""What shows the nature of a law beside its steady curve: which of its behaviours to draw."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.dwell import dwell
from symfric.figures.hysteresis import hysteresis
from symfric.figures.lag import lag
from symfric.figures.requirements import phenomena
from symfric.figures.scales import Scales, scales
from symfric.figures.stiction import stiction
from symfric.figures.transition import transition
from symfric.figures.velocity_step import velocity_step
from symfric.foundation.status import SolveError
from symfric.laws import AnyLaw, Law, Population, law_name
from symfric.laws.base.law import FORCE

Make = Callable[[AnyLaw, float, Scales], FigureData]

ACCELERATION = "dv"
"""The further input of a law that any motion offers."""


def natures(laws: Mapping[str, AnyLaw], N: float) -> list[FigureData]:
    """The behaviours that set `laws` (legend entry -> law) apart, each with all laws that have it.

    All get the amplitudes of the first that has it. A law with pre-sliding shows its hysteresis,
    and its lag or its reversals; one that needs the applied force how it sticks; one whose static
    friction grows with time the dwell; one that needs other inputs how they change it; a law of the
    velocity alone nothing: its steady curve says all. A law that fails in one of them is left out
    there, and the figure says why.
    """
    shown = {label: behaviours(law) for label, law in laws.items()}
    found: list[FigureData] = []
    for name in dict.fromkeys(name for own in shown.values() for name in own):
        able = {label: law for label, law in laws.items() if name in shown[label]}
        given = scales(next(iter(able.values())), N)
        parts: list[FigureData] = []
        failed: list[str] = []
        for label, law in able.items():
            try:
                parts.append(shown[label][name](law, N, given).named(label))
            except (SolveError, ValueError) as error:
                failed.append(f"{label} is left out: {error}")
        if parts:
            curves = tuple(curve for part in parts for curve in part.curves)
            found.append(replace(parts[0], curves=curves, note="; ".join(failed)))
    return found


def behaviours(law: AnyLaw) -> dict[str, Make]:
    """Name -> what makes the figure of a behaviour, for those that `law` is drawn with."""
    codes, needs = phenomena(law), () if isinstance(law, Population) else law.inputs
    own = [i for i in needs if i.name not in (FORCE, ACCELERATION)]
    if own:
        return {f"input_{i.name}": partial(over_input, name=i.name) for i in own}
    if FORCE in (i.name for i in needs):
        return {"stiction": stiction}
    found: dict[str, Make] = {}
    if "P" in codes:
        found["hysteresis"] = partial(hysteresis, speeds=(1.0,))
    if "L" in codes and "P" not in codes and "T" in codes:
        found["velocity_step"] = velocity_step
    elif "L" in codes:
        found["lag"] = partial(
            lag, frequencies=(50.0,) if isinstance(law, Population) else (5.0, 50.0)
        )
    elif "P" in codes:
        found["transition"] = partial(transition, frequencies=(2.0,))
    if "T" in codes and isinstance(law, Law):
        found["dwell"] = dwell
    return found


def over_input(law: AnyLaw, N: float, given: Scales, name: str) -> FigureData:
    """Force in steady sliding at the Stribeck velocity over one of the further inputs of a law.

    Over twice its nominal magnitude to both sides, the others as in pictures of steady sliding.
    """
    if not isinstance(law, Law):
        raise ValueError(f"over_input of {law_name(law)}: expected a law, got a population")
    own = {i.name: i for i in law.inputs}
    V, u = given.velocity, np.linspace(-2.0, 2.0, 401) * own[name].nominal
    others = {i.name: i.steady for i in law.inputs if i.name != name}
    v = np.full(u.shape, V)
    F = law.force(v, N, law.steady_state(v, N), **others, **{name: u})
    return FigureData(
        f"input_{name}",
        f"sliding at {V:.3g} m/s over {name}, N = {N:g} N",
        {name: own[name].unit, "F": "N"},
        ((name, "F"),),
        (Curve(law_name(law), "", {name: u, "F": np.asarray(F, dtype=float)}),),
    )
