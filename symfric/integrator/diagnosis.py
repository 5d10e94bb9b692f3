"""Why an integration could not go on, in one sentence."""

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.integrator import Integrator
from symfric.integrator.step import blocks
from symfric.status import Status

Array = NDArray[np.float64]


def explain(integrator: Integrator, t: float, y: Array, d: Array, h: float) -> tuple[Status, str]:
    """Status and sentence for a step that shrank to nothing at time `t`."""
    system, name = integrator.system, integrator.model.name
    f = integrator.f(y, d).full().ravel()
    where = f"simulate '{name}': stopped at t = {t:.9g} s"
    broken = [system.names[i] for i in np.flatnonzero(~np.isfinite(f))]
    if broken:
        return (
            Status.NOT_FINITE,
            f"{where}: the equation of {', '.join(broken)} returned NaN or infinity; "
            "look for a division by zero or a root of a negative number there",
        )
    large = np.flatnonzero(np.abs(y[: system.nx]) > 1e10 * system.nominal)
    if large.size:
        grown = ", ".join(f"{system.names[i]} = {y[i]:.3g}" for i in large)
        return (
            Status.STEP_TOO_SMALL,
            f"{where}: {grown} grows without bound; check signs and parameters",
        )
    factors = blocks(system, integrator.tableau).factor(y, max(h, 1e-12), d).full()
    if not np.isfinite(factors).all():
        _, unknowns = system.algebraic
        names = ", ".join(system.names[i] for i in unknowns) or "the states"
        return (
            Status.SINGULAR,
            f"{where}: the iteration matrix is singular in {names}; the constraints may be "
            "redundant or the configuration singular",
        )
    fastest = system.names[int(np.argmax(np.abs(f[: system.nx]) / system.nominal))]
    return (
        Status.STEP_TOO_SMALL,
        f"{where}: the step fell to {h:.1e} s, fastest equation {fastest}; a discontinuity is "
        "near, give the law a smooth form or the model an event there",
    )
