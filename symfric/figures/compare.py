"""Several laws under the same excitation."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca

from symfric.figures.catalogue import FIGURES
from symfric.figures.data import Curve, FigureData
from symfric.figures.scales import NORMAL_FORCE, scales
from symfric.integrator import simulate
from symfric.laws import Law, law_from_text, law_name
from symfric.laws.base import check_law
from symfric.parameters import check_names, distinct
from symfric.scenes import ALL_SCENES


def compare(
    laws: Sequence[Law | str] | Mapping[str, Law],
    scenario: str = "profile",
    N: float = NORMAL_FORCE,
) -> FigureData:
    """Overlay `laws` on the excitation of one `scenario`.

    Args:
        laws: laws or their names, or legend entry -> law.
        scenario: a figure (profile, hysteresis, lag, ...), or a scene (rabinowicz, drive). All laws
            get the amplitudes that the figure takes from the first one, so put the law whose
            scales matter first.
        N: normal force [N] of a figure; a scene has its own.

    Returns:
        One curve per law and case, each under the name of its law.

    Raises:
        ValueError: no law, unknown scenario, a law that cannot show it.
        SolveError: a simulation failed.
    """
    check_names("compare: scenario", [scenario], [*FIGURES, *ALL_SCENES])
    named = _named(laws)
    if scenario in ALL_SCENES:
        return _scene(named, scenario)
    given = scales(next(iter(named.values())), N)
    shown = [FIGURES[scenario](law, N, given).named(name) for name, law in named.items()]
    return replace(shown[0], curves=tuple(curve for one in shown for curve in one.curves))


def _named(laws: Sequence[Law | str] | Mapping[str, Law]) -> dict[str, Law]:
    """The laws by legend entry; laws of one kind are numbered."""
    if isinstance(laws, Mapping):
        found = dict(laws)
    else:
        each = [law_from_text(law) if isinstance(law, str) else law for law in laws]
        for law in each:
            check_law("compare", law)
        names = [name for (name,) in distinct([[law_name(law)] for law in each])]
        found = dict(zip(names, each, strict=True))
    if not found:
        raise ValueError("compare: expected at least one law, got none")
    for law in found.values():
        check_law("compare", law)
    return found


T_END = {"rabinowicz": 20.0, "drive": 4.0}
"""Times [s] that show what a scene is about: three stick-slip periods, two reversals."""


def sine(t: ca.SX) -> ca.SX:
    """Force 2 sin(pi t) N: beyond the default break-away force of 1.18 N in both directions."""
    return 2 * ca.sin(ca.pi * t)


INPUTS = {"rabinowicz": {}, "drive": {"force": sine}}
"""What drives a scene."""


def _scene(laws: Mapping[str, Law], name: str) -> FigureData:
    """Position, velocity and friction of a scene with each law, as `symfric run` shows it."""
    curves: list[Curve] = []
    for label, law in laws.items():
        model = ALL_SCENES[name](law).model()
        run = simulate(model, T_END[name], u=INPUTS[name])
        columns = {"t": run.t, "x": run["x"], "v": run["v"], "F": run["friction"]}
        curves.append(Curve(label, "", columns))
    return FigureData(
        name,
        name,
        {"t": "s", "x": "m", "v": "m/s", "F": "N"},
        (("t", "x"), ("t", "v"), ("t", "F")),
        tuple(curves),
    )
