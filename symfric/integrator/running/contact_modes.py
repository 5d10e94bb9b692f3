"""Modes of several contacts that change at one time, decided together.

The switches of a law change the mode of its contact while all others keep theirs. If a second
contact changes at the same time, the order of changes must not decide, so the modes of all contacts
without velocity are decided together. The same happens after events whose resets change sliding
velocities.

    A contact without velocity sticks if its force is within the static levels of both directions;
    otherwise it slips in the overloaded direction.
    A contact that starts to slip must accelerate in this direction, d slip/dt >= 0; otherwise it
    sticks.

All of them stick first. The most inconsistent contact changes, the equations are solved again,
because the forces in other contacts change with it, and so on until all modes are consistent. If
modes repeat, all combinations are tried, those with most contacts in stick first.

Compiled code repeats the decision, operation by operation, except for loops that have to be closed
and for the trials of all combinations (`decide.c`).

Limits: for mu_s > mu_d several combinations may be consistent, and one is chosen. If none is found,
the modes remain those of the switches. Contacts of a loop of one degree of freedom stick together
and keep their own events. A run records the events that led to the decision, not its result.
Source: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 5.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, evaluate
from symfric.foundation.variable import stacked
from symfric.model import Model
from symfric.model.contact import APPLIED, Switching, switching
from symfric.model.forces import by_laws
from symfric.model.start import rate_of

Solve = Callable[[Array], Array]
"""Unknowns y with new modes -> y with consistent algebraic unknowns; may raise ValueError."""
STILL = 1e-11
"""Sliding velocity that counts as zero, relative to the nominal values of its states."""
TURNING = 1e-8
"""Sliding acceleration, relative to the largest one, that counts as rounding error."""
MANY = 8
"""Largest number of contacts without velocity whose modes are tried in all combinations."""
UP, DOWN, CHANGE, SLIP = range(4)
"""Columns of a row of a contact: margins to both levels, rate of the slip, and the slip."""


@final
@dataclass(frozen=True, eq=False)
class ContactModes:
    """Decision of the modes of several contacts.

    Attributes:
        contacts: the contacts.
        look: (t, y, d) -> rows of the contacts, as in `UP`, row by row.
        still: sliding velocity of each contact that counts as zero, shape (n,).
    """

    contacts: tuple[Switching, ...]
    look: ca.Function
    still: Array

    @staticmethod
    def of(model: Model, of_time: Callable[[str, ca.SX], ca.Function]) -> "ContactModes":
        """Return the decision for a model; `of_time` makes Functions of (t, y, d)."""
        contacts = switching(model.contacts, model.x, model.events)
        rows, nominal, x = list[ca.SX](), model.nominal("x"), model.vector("x")
        still: list[float] = []
        for c in (one.contact for one in contacts):
            force, further = ca.SX(c.given[APPLIED]), c.further
            up, down = (
                ca.SX(c.law.static_level(c.N, side, **further)) - side * force for side in (1, -1)
            )
            rows.append(ca.vertcat(up, down, rate_of(ca.SX(c.slip), model), ca.SX(c.slip)))
            slope = ca.DM(ca.jacobian(ca.SX(c.slip), x).sparsity(), 1).full()[0] != 0
            still.append(STILL * max(nominal[slope], default=1.0))
        every = stacked(rows) if model.holonomic else by_laws(model, stacked(rows))
        look = of_time("symfric_contacts", ca.densify(every))
        return ContactModes(contacts, look, np.array(still))

    def decided(self, t: float, before: Array, y: Array, d: Array, solve: Solve) -> Array | None:
        """Return `y` with consistent modes, or None if there are none.

        `before` contains the unknowns before the events that led to `y`. Their resets may have
        changed sliding velocities, as an impact does.
        """
        at = [c.mode for c in self.contacts]
        modes, slips = np.round(y[at]), self._rows(t, y, d)[:, SLIP]
        kicked = np.abs(slips - self._rows(t, before, d)[:, SLIP]) > self.still
        free = (np.abs(slips) <= self.still) | ((modes == 0) & ~kicked)
        trial = np.where(free, 0.0, np.where(kicked, np.sign(slips), modes))
        for modes in self._trials(trial, free):
            moved = y.copy()
            moved[at] = modes
            try:
                moved = solve(moved)
            except ValueError:
                continue
            found = objection(modes, free, self._rows(t, moved, d))
            if found is None:
                return moved
            trial[:] = modes
            trial[found[0]] = found[1]
        return None

    def _trials(self, trial: Array, free: NDArray[np.bool_]) -> Iterator[Array]:
        """Yield modes: `trial`, which the caller improves, until it repeats; then all others."""
        seen: set[bytes] = set()
        while trial.tobytes() not in seen:
            seen.add(trial.tobytes())
            yield trial.copy()
        count = int(free.sum())
        every = product((0.0, 1.0, -1.0), repeat=count) if count <= MANY else ()
        for choice in sorted(every, key=lambda modes: sum(map(abs, modes))):
            other = trial.copy()
            other[free] = choice
            if other.tobytes() not in seen:
                yield other

    def _rows(self, t: float, y: Array, d: Array) -> Array:
        return evaluate(self.look, np.array([t]), y, d).reshape(-1, SLIP + 1)


def objection(modes: Array, free: NDArray[np.bool_], rows: Array) -> tuple[int, float] | None:
    """Return the most inconsistent contact and a better mode, or None if all are consistent."""
    largest = max(1e-300, float(np.abs(rows[:, CHANGE]).max()))
    found: list[tuple[float, int, float]] = []
    for i, (up, down, change, _) in enumerate(rows):
        if not modes[i] and min(up, down) < 0:
            level = max((up + down) / 2, 1e-300)
            found.append((2.0 - min(up, down) / level, i, 1.0 if up < down else -1.0))
        elif modes[i] and free[i] and modes[i] * change < -TURNING * largest:
            found.append((-modes[i] * change / largest, i, 0.0))
    worst = max(found, default=None)
    return None if worst is None else worst[1:]
