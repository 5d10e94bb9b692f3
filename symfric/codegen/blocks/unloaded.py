"""The step of a law without load, where its formulas divide by the load or forget it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from symfric.foundation.parameters import Variable
from symfric.laws import Law

LEAST_LOAD = 1e-9
"""Times the nominal load: a contact under less carries none."""

NO_LOAD = (
    "Without load (N below {least:g} N) there is no dry friction, and what the contact remembers "
    "of its deflection is forgotten; when the load returns, it begins anew."
)


@final
@dataclass(frozen=True, eq=False)
class Held:
    """A step with v and N held, as expressions.

    Attributes:
        following: states after the step.
        force: of `z` and the `rates`, which are symbols.
        at: name of an output -> states and rates that the force is taken at.
    """

    following: ca.SX
    force: ca.SX
    z: ca.SX
    rates: ca.SX
    at: Mapping[str, tuple[ca.SX, ca.SX]]

    @property
    def outputs(self) -> dict[str, ca.SX]:
        """The force at each of `at`."""
        own = ca.vertcat(self.z, self.rates)
        return {n: ca.substitute(self.force, own, ca.vertcat(*x)) for n, x in self.at.items()}


def with_words(held: Held, N: Variable) -> tuple[ca.SX, dict[str, ca.SX]]:
    """States and outputs of a step that is told what it is without load.

    A state whose step depends on the load becomes 0, as that of a contact that has just closed; the
    others (a lag, a temperature) go on. What is left of the force is viscous friction.
    """
    least = LEAST_LOAD * N.nominal
    loaded = N.symbol > least
    rows = [(row, ca.depends_on(row, N.symbol)) for row in ca.vertsplit(held.following)]
    kept = ca.vertcat(*(ca.SX(float(not loads)) for _, loads in rows))
    ends = [ca.if_else(loaded, row, 0.0) if loads else row for row, loads in rows]
    own = ca.vertcat(held.z, held.rates, N.symbol)
    found: dict[str, ca.SX] = {}
    for (name, (z, rates)), force in zip(held.at.items(), held.outputs.values(), strict=True):
        left = ca.SX()
        for load in (0.0, least):  # not zero where that is 0/0: a corner as wide as a share of it
            left = ca.substitute(
                held.force, own, ca.densify(ca.vertcat(kept * z, kept * rates, load))
            )
            if _is_finite(left):
                break
        found[name] = ca.if_else(loaded, force, left)
    return ca.vertcat(*ends), found


def needs_words(law: Law, own: ca.Function, told: ca.Function) -> bool:
    """Whether the formulas of `law` are not finite at N = 0, or hold a force at rest there.

    Elements of event forms let go at once. A law that has a level of its own there, such as by a
    preload, keeps its formulas.

    Args:
        law: with numbers.
        own, told: (v, N, z, further inputs) -> states, outputs by the law and `with_words`.
    """
    if _level(law) != 0.0:
        return False
    nominal = np.array([s.nominal for s in law.states])
    for share in (0.0, 1.0, -1.0):
        for v in (0.0, 1e-3, -1.0):
            given = v, 0.0, share * nominal, np.zeros(len(law.inputs))
            (states, outputs), (_, expected) = own(*given), told(*given)
            if not (states.is_regular() and outputs.is_regular()):
                return True
            if v == 0.0 and float(ca.norm_inf(outputs - expected)) > 1e-9:
                return True
    return False


def _level(law: Law) -> float:
    """The dry friction [N] that the law holds without load; 0 where it does not say."""
    try:
        return max(abs(float(law.static_level(0.0, side))) for side in (1, -1))
    except ValueError:
        return 0.0


def _is_finite(expression: ca.SX) -> bool:
    """Whether no 0/0 is in an expression, at numbers that no formula treats specially."""
    symbols = ca.vertcat(ca.SX(0, 1), *ca.symvar(expression))
    value = ca.evalf(ca.substitute(expression, symbols, 0.7 * ca.SX.ones(symbols.numel())))
    return bool(np.isfinite(float(value)))
