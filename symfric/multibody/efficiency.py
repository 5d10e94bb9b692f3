"""Efficiency of machine elements with friction over a run."""

import casadi as ca

from symfric.foundation.checks import listed, refused
from symfric.laws.base import smooth
from symfric.results.signals import integrals
from symfric.results.trajectory import Trajectory

ENDS = ("power_a", "power_b")
CLOSE = 1e-6
"""Largest relative difference of the energies of an element that moves as one piece."""
REST = 1e-9
"""Largest sliding distance [m] of an element at rest."""


def efficiency(run: Trajectory, element: str) -> float:
    """Return the energy that an element delivered over a run, relative to the energy it received.

        efficiency = sum of integrals of max(P, 0) / sum of integrals of max(-P, 0)

    with the powers P = `<element>_power_a`, `<element>_power_b` [W] of the element on both coupled
    joints, by quadrature over the dense output. Between 0 and 1: the difference to 1 is lost in
    friction. If the element slid by less than 1 nm, the efficiency is 1 if it moved as one piece,
    such as a clutch that sticks, and NaN at rest.

    Args:
        run: result of a simulation of a mechanism.
        element: name of a `Gear`, `Rolling`, `Screw` or `Cam` with friction, or of a brake, clutch
            or belt. A brake of one joint delivers nothing: 0.

    Raises:
        ValueError: the mechanism has no element of this name with friction.
    """
    if getattr(run, "details", None) is None:  # an `Ensemble`, for example
        raise refused("efficiency: run", "one run, such as simulate(...)", run)
    known = [name.removesuffix(f"_{ENDS[0]}") for name in run.details if name.endswith(ENDS[0])]
    if element not in known:
        raise ValueError(
            f"efficiency: expected an element with friction, got {element!r}; there are "
            f"{listed(known) or 'none'}"
        )
    ends = [name for end in ENDS if (name := f"{element}_{end}") in run.details]
    powers = ca.vertcat(*(run.model.expression(name) for name in ends))
    delivered, received = (ca.sum1(smooth.positive(x, 0.0)) for x in (powers, -powers))
    speed = smooth.magnitude(run.model.expression(f"{element}_slip"), 0.0)
    whole = ca.vertcat(delivered, received, speed)
    out, into, path = integrals(run.step_times, run.of, whole, run.step_times[-1:])[:, 0]
    if path > REST:
        return float(out / into)
    return 1.0 if abs(out - into) < CLOSE * into else float("nan")
