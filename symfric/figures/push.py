"""A block under a force of one's own: what it does on a law, or on a population of contacts."""

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.motion import pushed
from symfric.figures.requirements import check_any
from symfric.figures.scales import MASS, NORMAL_FORCE
from symfric.foundation import checks
from symfric.integrator.equations.inputs import Input
from symfric.laws import AnyLaw, law_name


def push(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    *,
    force: Input,
    t_end: float,
    mass: float = MASS,
    samples: int = 2001,
) -> FigureData:
    """Motion of a block of `mass` [kg] on `law`, at rest at first, under `force` [N] (t).

    Columns t [s], F_e [N], x [m], v [m/s], F [N]. `simulate` with the scene `Drive` is the same for
    a law, and tells more; a population of contacts, which no scene takes, moves by explicit steps.

    Args:
        law: any law that a scene takes, or a population.
        N: normal force [N].
        force: number, function of the time, or samples (`Linear`, `Hold`).
        t_end: end of the motion [s].
        mass: of the block [kg].
        samples: rows of the columns.

    Raises:
        ValueError: no law, numbers that are not positive.
        SolveError: the simulation failed.
    """
    check_any("push", law)
    checks.number("push: t_end", t_end, unit="s", above=0.0)
    checks.number("push: mass", mass, unit="kg", above=0.0)
    t = np.linspace(0.0, t_end, checks.count("push: samples", samples, least=2))
    seen = pushed(law, N, mass, force, t_end).at(t)
    names = {"F_e": "force", "x": "x", "v": "v", "F": "friction"}
    columns = {"t": t} | {name: seen[signal] for name, signal in names.items()}
    return FigureData(
        "push",
        f"block of {mass:g} kg under a force, N = {N:g} N",
        {"t": "s", "F_e": "N", "x": "m", "v": "m/s", "F": "N"},
        (("t", "F_e"), ("t", "F"), ("t", "x")),
        (Curve(law_name(law), "", columns),),
    )
