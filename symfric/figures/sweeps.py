"""What the factors B, C and E of the self-tuning law do to its profile."""

from collections.abc import Sequence

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.laws import AnyLaw, RuiWang, SelfTuning, law_name, steady_force

SHAPES = (0.0, 0.5, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0)
STIFFNESSES = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0)
CURVATURES = (-1.0, 0.0, 0.25, 0.5, 0.75, 0.95)

SWEPT = {
    "B": ("stiffness factor", "sets how steeply the force rises at rest, not how high the peak is"),
    "C": ("shape factor", "up to 1 gives a plateau, above 1 a peak from which the force falls"),
    "E": ("curvature factor", "moves the peak to another velocity and leaves height and slope"),
}
"""Factor -> what it is called, and what a figure says that it does."""


def sweep_c(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    values: Sequence[float] = SHAPES,
) -> FigureData:
    """Profiles for the shape factors `values` in [0, 2] (doi 10.1177/14644193231169325, fig. 7).

    Columns v [m/s], F [N]. `SelfTuning` computes C >= 1 from mu_d / mu_s; here C is set, as in
    `RuiWang` with D = mu_s N. C = 0 is no friction, C <= 1 monotone, C > 1 has a peak.

    Raises:
        ValueError: neither of these laws.
    """
    return _sweep(_formula("sweep_c", law, N), law, N, given, "C", values)


def sweep_b(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    values: Sequence[float] = STIFFNESSES,
) -> FigureData:
    """Profiles for the stiffness factors `values` as shares of B (same source, fig. 8).

    Columns v [m/s], F [N]. B scales the velocity and leaves the peak as high as it is.

    Raises:
        ValueError: neither `SelfTuning` nor `RuiWang`.
    """
    base = _formula("sweep_b", law, N)
    return _sweep(base, law, N, given, "B", [share * float(base.B) for share in values])


def sweep_e(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    values: Sequence[float] = CURVATURES,
) -> FigureData:
    """Profiles for the curvature factors `values` below 1 (same source, fig. 9).

    Columns v [m/s], F [N]. E moves the peak and leaves its height and the slope at rest.

    Raises:
        ValueError: neither `SelfTuning` nor `RuiWang`.
    """
    return _sweep(_formula("sweep_e", law, N), law, N, given, "E", values)


def _formula(where: str, law: AnyLaw, N: float) -> RuiWang:
    """The magic formula of `law`, its shape factor free."""
    if isinstance(law, RuiWang):
        return law
    if isinstance(law, SelfTuning):
        return RuiWang(D=law.mu_s * N, C=law.C, B=law.B, E=law.E)
    raise ValueError(
        f"{where} of {law_name(law)}: expected a law with the factors B, C and E, self_tuning or "
        "rui_wang, got one without them"
    )


def _sweep(
    base: RuiWang,
    law: AnyLaw,
    N: float,
    given: Scales | None,
    factor: str,
    values: Sequence[float],
) -> FigureData:
    v = np.linspace(-2.0, 2.0, 1201) * (given or scales(law, N)).velocity
    curves = [
        Curve(
            law_name(law),
            f"{factor} = {value:g}" + (" s/m" if factor == "B" else ""),
            {"v": v, "F": steady_force(_with(base, factor, value), v, N)},
        )
        for value in values
    ]
    kind, does = SWEPT[factor]
    return FigureData(
        f"sweep_{factor.lower()}",
        f"profiles for values of the {kind} {factor}, N = {N:g} N",
        {"v": "m/s", "F": "N"},
        (("v", "F"),),
        tuple(curves),
        note=f"{factor} {does}",
    )


def _with(base: RuiWang, factor: str, value: float) -> RuiWang:
    factors = {"B": base.B, "C": base.C, "E": base.E} | {factor: value}
    return RuiWang(D=base.D, **factors)
