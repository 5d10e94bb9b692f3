"""Friction that adds energy to the motion, as by a law whose force has the wrong sign.

    F(v, N, z_ss(v, N)) v < 0  at a slip v of the run,  and  integral F v dt < 0

A look at the steady force over decades of speed and load, once for each set of its parameters,
finds nothing against most laws, and then no run is looked at. Bristles give back what they stored,
and laws with an offset push within their smoothing velocity, so that one of the two conditions
alone is no doubt. The integral is the trapezoidal rule over steps: only its sign matters.
Limits: a wrong sign in equations written by hand, outside the law, is not seen; nor is any member
of an ensemble looked at.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.memory import remember
from symfric.foundation.symbols import strays
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.record import Run
from symfric.model import Model
from symfric.model.contact import Contact
from symfric.model.forces import by_laws

Array = NDArray[np.float64]
SPEEDS = np.array([1e-6, 1e-3, 1.0, 1e3])
"""Slips [m/s] of the first look, to both sides."""
LOADS = (1.0, 1e3)
"""Loads [N] of the first look."""
SHARE = 1e-3
"""Share of the turnover of energy by which friction may gain: rounding, and the rule."""
REMEMBERED = 16
"""Sets of parameters whose first look is remembered."""


@final
@dataclass(frozen=True, eq=False)
class Sliding:
    """Friction of one contact, as it is and in steady sliding.

    Attributes:
        contact: where.
        power: (v, N, p) -> power [W] that steady friction takes.
        needs: parameters that the power depends on.
        rows: slip, friction and steady friction of the model.
    """

    contact: Contact
    power: ca.Function
    needs: list[int]
    rows: ca.SX

    def suspect(self, p: Array) -> bool:
        """Return True if steady friction adds energy at some speed and load."""
        slips, loads = np.meshgrid(np.concatenate([-SPEEDS, SPEEDS]), LOADS)
        every = np.tile(p[:, None], (1, slips.size))
        power = self.power(slips.reshape(1, -1), loads.reshape(1, -1), every)
        return bool(np.any(power.full() < 0))


def gains(integrator: Integrator, inputs: InputData, run: Run, p: Array) -> Iterator[str]:
    """Sentences about contacts whose friction adds energy to the motion."""
    memory = integrator.model.memory
    known: dict[Hashable, bool] = memory.setdefault("active", {})
    for k, sliding in enumerate(places(integrator.model)):
        key = k, p[sliding.needs].tobytes()
        if key not in known:
            remember(known, key, sliding.suspect(p), REMEMBERED)
        if not known[key]:
            continue
        t, y = run.seen
        d = np.hstack([np.tile(p, (t.size, 1)), inputs.values[:, inputs.interval(t)].T])
        (values,) = Columns(integrator.of_time("sliding", sliding.rows))([t, y, d], backend="vm")
        slip, force, steady = values.T
        power, worst = force * slip, int(np.argmin(steady * slip))
        work, turnover = (np.diff(t) @ (w[1:] + w[:-1]) / 2 for w in (power, np.abs(power)))
        if steady[worst] * slip[worst] < 0 and work < -SHARE * turnover:
            contact, unit = sliding.contact, sliding.contact.unit
            yield (
                f"In contact '{contact.name}' friction by {type(contact.law).__name__} adds "
                f"{-work:.3g} J to the motion: at a slip of {slip[worst]:.3g} {unit('m/s')} its "
                f"steady force is {steady[worst]:.3g} {unit('N')}, along the slip; check its sign."
            )


def places(model: Model) -> tuple[Sliding, ...]:
    """Return the contacts of a model whose steady friction is known."""
    if "sliding" not in model.memory:
        found = (_sliding(model, contact) for contact in model.contacts)
        model.memory["sliding"] = tuple(s for s in found if s is not None)
    return model.memory["sliding"]


def _sliding(model: Model, contact: Contact) -> Sliding | None:
    """The friction of a contact; None where it is not known from the unknowns of the model."""
    law, v, N, p = contact.law, ca.SX.sym("v"), ca.SX.sym("N"), model.vector("p")
    try:
        still = dict.fromkeys(contact.given, 0.0)
        alone = ca.SX(law.force(v, N, law.steady_state(v, N), **still)) * v
        z = law.steady_state(contact.slip, contact.N)
        steady = ca.SX(law.force(contact.slip, contact.N, z, **contact.given))
        rows = by_laws(model, ca.vertcat(contact.slip, contact.friction, steady))
    except (ValueError, TypeError, NotImplementedError):
        return None
    known = ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))
    if strays(rows, known) or strays(alone, ca.vertcat(v, N, p)):
        return None
    needs = [i for i in range(p.numel()) if ca.depends_on(alone, p[i])]
    return Sliding(contact, ca.Function("power", [v, N, p], [alone]), needs, rows)
