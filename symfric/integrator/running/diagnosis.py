"""Diagnosis of a failed integration, in one sentence."""

from collections.abc import Iterator

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed
from symfric.foundation.numeric import Array, evaluate_all
from symfric.foundation.status import Status
from symfric.integrator.equations.blocks import blocks
from symfric.integrator.equations.initial import FLOOR, consistent
from symfric.integrator.equations.manifold import grows, pulls, singular
from symfric.integrator.equations.matrices import regular
from symfric.integrator.equations.system import System
from symfric.integrator.running.integrator import Integrator
from symfric.model import Model
from symfric.model.contact import APPLIED

NEARLY = 0.1
"""Value of det(I - dN/dN) below which a mechanism whose step shrinks to nothing has jammed."""
STILL = 1e-9
"""Sliding velocity per velocity of a mechanism below which a contact is in a dead centre."""
COARSE = 1e-10
"""Resolution of time [s] above which rounding of t may be the cause of a failed step."""


def explain(integrator: Integrator, t: float, y: Array, d: Array, h: float) -> tuple[Status, str]:
    """Return status and message for a step that shrank to nothing at time `t`."""
    system, model = integrator.system, integrator.model
    where = f"simulate '{model.name}': stopped at t = {t:.9g} s"
    f = integrator.f(y, d).full().ravel()
    advice = "" if model.holonomic is None else model.holonomic.advice
    for status, cause in _causes(integrator, y, d, h, f, advice):
        if cause:
            jammed = status is Status.JAMMED and advice
            return status, f"{where}: {cause}; {advice}" if jammed else f"{where}: {cause}"
    fastest = system.names[int(np.argmax(np.abs(f[: system.nx]) / system.nominal))]
    guess = "a discontinuity is near, give the law a smooth form or the model an event there"
    coarse = (
        f"; at this t, steps below {FLOOR * abs(t):.1e} s are lost to rounding; "
        "shift the time origin"
    )
    return (
        Status.STEP_TOO_SMALL,
        f"{where}: the step fell to {h:.1e} s, fastest equation {fastest}; "
        f"{advice or guess}{coarse if FLOOR * abs(t) >= COARSE else ''}",
    )


def _causes(
    integrator: Integrator, y: Array, d: Array, h: float, f: Array, advice: str
) -> Iterator[tuple[Status, str]]:
    """Yield status and message of each possible cause; an empty message rules the cause out."""
    system, manifold = integrator.system, integrator.system.manifold
    if manifold is not None:
        yield Status.SINGULAR, singular(manifold, system.names, y, d)
        cause = grows(manifold, system.names, y, d, NEARLY)
        for variable in integrator.model.z:  # name joint and law
            cause = cause.replace(f"through {variable.name}:", f"through the {variable.doc}:")
        yield Status.JAMMED, cause
        yield Status.STEP_TOO_SMALL, dead_centre(integrator, y, d)
    yield Status.STEP_TOO_SMALL, _unbounded(system, y, f, h)
    yield Status.NOT_FINITE, _not_finite(integrator, y, d, h, f)
    yield Status.NOT_FINITE, _steep(system, y, d)
    if manifold is not None:
        yield Status.JAMMED, pulls(manifold, y, d, NEARLY)
    yield Status.SINGULAR, _singular(system, y, d, h, advice)


def dead_centre(integrator: Integrator, y: Array, d: Array) -> str:
    """Return a message if a sticking contact cannot slide in any motion of the mechanism at y."""
    model, system = integrator.model, integrator.system
    mechanics, contacts = model.holonomic, [c for c in model.contacts if APPLIED in c.given]
    if mechanics is None or not mechanics.phi.numel() or not contacts:
        return ""
    q, qd = system.y[: mechanics.n], system.y[mechanics.n : 2 * mechanics.n]
    slopes = [ca.jacobian(mechanics.phi, q), *(ca.jacobian(c.slip, qd) for c in contacts)]
    columns = integrator.of_time("slopes", ca.densify(ca.vertcat(*slopes)))
    rows = evaluate_all(columns, np.zeros(1), y, d)[0]
    m = mechanics.phi.numel()
    motions = np.linalg.svd(rows[:m])[2][m:]
    for c, row in zip(contacts, rows[m:], strict=True):
        if np.abs(motions @ row).max(initial=0.0) < STILL * np.abs(row).max():
            return (
                f"contact '{c.name}' is in a dead centre, where its sliding direction, and thus "
                "the mode of its law, is undetermined; start elsewhere, or use a smooth law"
            )
    return ""


def chattering(model: Model) -> str:
    """Return advice for user equations that contain a sign; an empty text for others.

    Runs with such equations never end: during sticking the sign changes from step to step, although
    the true friction is between -1 and 1.
    """
    if model.contacts or model.holonomic is not None:
        return ""
    written = ca.Function("equations", ca.symvar(model.residual), [model.residual])
    if ca.OP_SIGN not in map(written.instruction_id, range(written.n_instructions())):
        return ""
    return " The equations contain sign(...): use contact(...) and a law, which can stick."


def _unbounded(system: System, y: Array, f: Array, h: float) -> str:
    """Return a message if states are huge, or if they are large and grow ever faster."""
    x, rate = y[: system.nx], np.nan_to_num(f[: system.nx], posinf=0.0, neginf=0.0)
    huge = np.abs(x) > 1e10 * system.nominal
    alike, soon = np.sign(x) == np.sign(rate), np.abs(x) / 1e3 < h * abs(rate)
    runaway = (np.abs(x) > 1e3 * system.nominal) & alike & soon
    grown = listed(f"{system.names[i]} = {x[i]:.3g}" for i in np.flatnonzero(huge | runaway))
    return f"{grown} grows without bound; check signs and parameters" if grown else ""


def _not_finite(integrator: Integrator, y: Array, d: Array, h: float, f: Array) -> str:
    """Return a message if equations are not finite here, or a few steps ahead along the slope."""
    system = integrator.system
    rates = np.linalg.pinv(system.M) @ np.nan_to_num(f, posinf=0.0, neginf=0.0)
    watched = ca.Function("watched", [system.y, system.d], [system.monitors])
    for ahead in (0.0, *(10.0**k * h for k in range(5))):
        f = integrator.f(y + ahead * rates, d).full().ravel()
        broken = _named(system, np.flatnonzero(~np.isfinite(f)))
        what = f"the equation of {broken}" if broken else ""
        if not np.isfinite(watched(y + ahead * rates, d).full()).all():
            what = what or "an expression that error control watches"
        if what:
            when = "returned" if ahead == 0.0 else "is about to return"
            return (
                f"{what} {when} NaN or infinity; "
                "look for a division by zero or a root of a negative number there"
            )
    return ""


def _steep(system: System, y: Array, d: Array) -> str:
    """Return a message if derivatives of the equations are not finite."""
    J = ca.Function("J", [system.y, system.d], [ca.jacobian(system.f, system.y)])(y, d).full()
    rows, columns = np.nonzero(~np.isfinite(J))
    if not rows.size:
        return ""
    return (
        f"the derivative of the equation of {_named(system, rows[:1])} with respect to "
        f"{_named(system, columns[:1])} is NaN or infinite; give the root or power there a "
        "smooth form"
    )


def _singular(system: System, y: Array, d: Array, h: float, advice: str) -> str:
    """Return a message if algebraic equations are singular, or have no solution nearby."""
    names = _named(system, np.array(system.algebraic[1], dtype=int))
    matrix = blocks(system, 1.0).factors.at(y, max(h, 1e-12), d)
    if np.isfinite(matrix).all() and not regular(matrix):
        return (
            f"the iteration matrix is singular in {names or 'the states'}; the constraints may be "
            "redundant or the configuration singular"
        )
    try:
        consistent(system, "", y, d)
    except ValueError:
        guess = "the configuration is singular or jams there"
        return (
            f"the algebraic equations for {names} have no solution near their last one; "
            f"{advice or guess}"
        )
    return ""


def _named(system: System, rows: NDArray[np.intp]) -> str:
    return listed(system.names[i] for i in rows)
