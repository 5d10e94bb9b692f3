"""Units of multipliers, and of the constraints that they belong to."""

import casadi as ca

from symfric.multibody.closing import Distance
from symfric.multibody.equations import Equations

CONSTRAINT = {"N": "m", "N m": "rad", "N/m": "m^2"}
"""Unit of a multiplier -> that of its constraint: their product is an energy."""


def multiplier_units(eq: Equations) -> dict[str, str]:
    """Name of a multiplier -> its unit; "" where the user's expression has none that is known.

    A constraint on places is loaded by a force, one on directions by a moment; that of a rod, on
    the square of its length, by a force over length.
    """
    found: dict[str, str] = {}
    for loop in eq.loops:
        m = loop.phi.numel()
        for i in range(m):
            label = f"{loop.joint.name}_lambda" + (f"_{i + 1}" if m > 1 else "")
            found[label] = "N/m" if isinstance(loop.joint, Distance) else _of(loop.C_v[i, :])
    found |= {label: part.unit for part in eq.held for label in part.labels}
    found |= {f"{link.joint.name}_norm": "J" for link in eq.kin.topology.links}
    return found


def _of(along: ca.SX) -> str:
    """That of the multiplier of a constraint whose rate is `along` times a velocity, and so on."""
    return "N m" if along.nnz() == 0 or along.is_zero() else "N"


def constraint_units(units: list[str]) -> tuple[str, str, str]:
    """Those of the norms of the constraints on three levels; "" where they are of several kinds."""
    kinds = {CONSTRAINT.get(unit, "") for unit in units}
    unit = kinds.pop() if len(kinds) == 1 else ""
    return (unit, f"{unit}/s", f"{unit}/s^2") if unit else ("", "", "")
