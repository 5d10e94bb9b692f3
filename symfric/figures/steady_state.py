"""The Stribeck curve: steady sliding, and what viscous friction adds."""

from collections.abc import Sequence

import numpy as np

from symfric.figures.data import Curve, FigureData
from symfric.figures.requirements import finite
from symfric.figures.scales import NORMAL_FORCE, Scales, scales
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import AnyLaw, Law, law_name, steady_force, steady_inputs


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
    return FigureData(
        "steady_state",
        f"steady sliding, N = {N:g} N{steady_inputs(law)}",
        {"v": "m/s", "F": "N"},
        (("v", "F"),),
        tuple(curves),
    )
