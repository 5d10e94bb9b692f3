"""Friction in joints that cannot act, because no reaction loads their bearings."""

from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from symfric.foundation.variable import stacked
from symfric.laws import Law
from symfric.multibody.constraints import Constraint
from symfric.multibody.contact import JointContact, depends_on_load
from symfric.multibody.couplings import Coupling
from symfric.multibody.equations import Equations

ROUNDING = 1e-12
"""Largest load of a bearing by rounding, relative to the largest reaction."""


def idle(eq: Equations, constraints: Sequence[Constraint]) -> Iterator[str]:
    """Yield messages about joints whose friction is zero in every motion.

    The normal force of such a joint is zero for random coordinates, rates, accelerations,
    multipliers, friction forces, inputs and parameters, and its law does not act without load.
    """
    joints = [c for c in eq.contacts if isinstance(c, JointContact) and c.friction.normal is None]
    if not joints:
        return
    loads = stacked(N for c, N in zip(eq.contacts, eq.normals, strict=True) if c in joints)
    reactions = stacked(ca.vertcat(*eq.pressing[c.part]) for c in joints)
    symbols = stacked(ca.symvar(ca.vertcat(loads, reactions)))
    at = np.random.default_rng(0).standard_normal(symbols.numel())
    found, largest = ca.Function("loads", [symbols], [ca.densify(loads), ca.densify(reactions)])(at)
    least = ROUNDING * max(1.0, float(ca.norm_inf(largest)))
    unloaded = [c for c, load in zip(joints, found.nonzeros(), strict=True) if abs(load) <= least]
    for part in dict.fromkeys(c.part for c in unloaded if not acts_without_load(c.friction.law)):
        yield f"joint '{part}' > friction: {_advice(part, constraints)}"


def acts_without_load(law: Law) -> bool:
    """Return True unless the friction force is known to be zero without a normal force."""
    if not depends_on_load(law):
        return True
    try:
        return not ca.SX(law.outside(ca.SX.sym("v"), ca.SX(0.0))).is_zero()
    except ValueError:
        return True


def _advice(joint: str, constraints: Sequence[Constraint]) -> str:
    """Return what is wrong with the friction of a joint, what carries the load, and the remedy."""
    expected = "expected a reaction that loads the bearing, got none in any motion"
    for c in constraints:
        if isinstance(c, Coupling) and joint in (name for name, _ in c.joints()):
            kind, friction = type(c).__name__, c.accepts[0].__name__
            return (
                f"{expected}, because coupling '{c.name}' carries the load; write "
                f"{kind}('{c.name}', ..., friction={friction}(law, ...)) and omit this friction, "
                "or give the bearing a preload"
            )
    return f"{expected}; write preload=... or normal=... [N], or omit the friction"
