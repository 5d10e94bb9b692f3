"""Figures of steady sliding: profile, Stribeck curve, factors of the self-tuning law."""

from collections.abc import Sequence

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.magnitudes import NORMAL_FORCE, Scales, finite, scales
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import AnyLaw, Law, RuiWang, SelfTuning, law_name, steady_force, steady_inputs


def profile(law: AnyLaw, N: float = NORMAL_FORCE, given: Scales | None = None) -> FigureData:
    """Force-velocity profile over +-5 Stribeck velocities.

    Columns v [m/s], F [N]. Every law has one. Further inputs of a law, such as the applied force,
    have the values that the title says, with the sign of v.

    Args:
        law: with numbers for parameters.
        N: normal force [N].
        given: magnitudes to take the range from, instead of those of the law.
    """
    V = (given or scales(law, N)).velocity
    fine = np.geomspace(1e-4 * V, 5 * V, 600)
    v = np.concatenate([-fine[::-1], [0.0], fine])
    F = finite("profile", law, steady_force(law, v, N))
    title = f"force in steady sliding, N = {N:g} N{steady_inputs(law)}"
    return _over_velocity("profile", title, [Curve(law_name(law), "", {"v": v, "F": F})])


def steady_state(
    law: AnyLaw,
    N: float = NORMAL_FORCE,
    given: Scales | None = None,
    shares: Sequence[float] = (0.0, 0.25, 0.5, 1.0),
) -> FigureData:
    """Force in steady sliding up to 10 Stribeck velocities V (thesis, Lund 2015).

    Columns v [m/s], F [N]. A law with the viscous coefficient sigma_2 is shown with that of its
    own and, dashed, with those that add `shares` of the kinetic level at 10 V; the first, none,
    is its dry part. Every other law is shown as it is.
    """
    magnitudes = given or scales(law, N)
    v = np.geomspace(1e-3, 10.0, 601) * magnitudes.velocity
    F = finite("steady_state", law, steady_force(law, v, N))
    curves = [Curve(law_name(law), "", {"v": v, "F": F})]
    if isinstance(law, Law) and "sigma_2" in parameters(law):
        unit = parameters(law)["sigma_2"].unit
        load = N if unit == "s/m" else 1.0
        for share in shares:
            sigma_2 = share * magnitudes.kinetic / (10 * magnitudes.velocity * load)
            other = with_values(law, {"sigma_2": sigma_2})
            columns = {"v": v, "F": steady_force(other, v, N)}
            case = f"sigma_2 = {sigma_2:.4g} {unit}"
            curves.append(Curve(law_name(law), case, columns, reference=True))
    title = f"steady sliding, N = {N:g} N{steady_inputs(law)}"
    return _over_velocity("steady_state", title, curves)


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
    return _sweep("C", law, N, given, values)


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
    return _sweep("B", law, N, given, values)


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
    return _sweep("E", law, N, given, values)


def _sweep(
    factor: str, law: AnyLaw, N: float, given: Scales | None, values: Sequence[float]
) -> FigureData:
    """Profiles of the magic formula of `law`, its shape factor free, for `values` of a factor."""
    name = f"sweep_{factor.lower()}"
    if isinstance(law, RuiWang):
        base = law
    elif isinstance(law, SelfTuning):
        base = RuiWang(D=law.mu_s * N, C=law.C, B=law.B, E=law.E)
    else:
        raise ValueError(
            f"{name} of {law_name(law)}: expected a law with the factors B, C and E, self_tuning "
            "or rui_wang, got one without them"
        )
    v = np.linspace(-2.0, 2.0, 1201) * (given or scales(law, N)).velocity
    curves: list[Curve] = []
    for value in [x * float(base.B) for x in values] if factor == "B" else values:
        factors = {"B": base.B, "C": base.C, "E": base.E} | {factor: value}
        case = f"{factor} = {value:g}" + (" s/m" if factor == "B" else "")
        F = steady_force(RuiWang(D=base.D, **factors), v, N)
        curves.append(Curve(law_name(law), case, {"v": v, "F": F}))
    kind, does = SWEPT[factor]
    title = f"profiles for values of the {kind} {factor}, N = {N:g} N"
    return _over_velocity(name, title, curves, f"{factor} {does}")


def _over_velocity(name: str, title: str, curves: Sequence[Curve], note: str = "") -> FigureData:
    units = {"v": "m/s", "F": "N"}
    return FigureData(name, title, units, (("v", "F"),), tuple(curves), note=note)
