"""All figures by name."""

from typing import Protocol

from symfric.figures.break_away import break_away
from symfric.figures.data import FigureData
from symfric.figures.drift import drift
from symfric.figures.dwell import dwell
from symfric.figures.hysteresis import hysteresis
from symfric.figures.lag import lag
from symfric.figures.profile import profile
from symfric.figures.requirements import check_any
from symfric.figures.scales import NORMAL_FORCE, Scales
from symfric.figures.steady_state import steady_state
from symfric.figures.stiction import stiction
from symfric.figures.sweeps import sweep_b, sweep_c, sweep_e
from symfric.figures.transition import transition
from symfric.figures.velocity_step import velocity_step
from symfric.foundation import checks
from symfric.laws import AnyLaw, Law, Population


class MakeFigure(Protocol):
    """A function that makes a figure of a law."""

    def __call__(self, law: AnyLaw, N: float = ..., given: Scales | None = None) -> FigureData:
        """The figure of `law` under `N` [N], with its own magnitudes or those `given`."""
        ...


FIGURES: dict[str, MakeFigure] = {
    "profile": profile,
    "sweep_b": sweep_b,
    "sweep_c": sweep_c,
    "sweep_e": sweep_e,
    "hysteresis": hysteresis,
    "lag": lag,
    "transition": transition,
    "velocity_step": velocity_step,
    "stiction": stiction,
    "dwell": dwell,
    "drift": drift,
    "break_away": break_away,
    "steady_state": steady_state,
}
"""Every figure by the name the command line uses."""


def figure(law: AnyLaw, name: str, N: float = NORMAL_FORCE) -> FigureData:
    """The figure `name` of `law` under the normal force `N` [N], with the excitation of the papers.

    The functions of the same names take more options.

    Raises:
        ValueError: unknown name (the closest one is offered), a law that cannot show it, something
            else than a law and a name.
        SolveError: a simulation behind it failed.
    """
    if isinstance(law, str) and isinstance(name, Law | Population):
        raise ValueError(
            f"figure: expected a law and then the name of a figure, got {law!r} and then a law; "
            f"write figure(law, {law!r})"
        )
    check_any("figure", law)
    checks.check_names("figure", [checks.text("figure: name", name)], FIGURES)
    return FIGURES[name](law, N)
