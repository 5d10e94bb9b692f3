"""Warnings about successful runs: friction above its static level or that adds energy, limits.

Energy: a law whose force has the wrong sign adds energy to the motion. Two conditions are checked:

    F(v, N, z_ss(v, N)) v < 0  at a slip v of the run,  and  integral F v dt < 0

The steady force is first checked over decades of speed and load, once for each set of its
parameters. Most laws pass, and their runs need no further check. Bristles return stored energy, and
laws with an offset push within their smoothing velocity, so both conditions are required. The
integral uses the trapezoidal rule over steps, since only its sign matters.
Limits: a wrong sign in hand-written equations outside the law is not detected; ensembles are not
checked.

Limits: a state, an algebraic variable or an input leaves the bounds of its `Variable`, by more than
a thousandth of the larger bound.

Overload: the states of a law carry more than in any possible motion, usually its static level.

    |F(0, N, z)| > (1 + MARGIN) most_held(N)

A bristle that creeps below its smoothing velocity, or below the rounding of the velocities whose
difference is the slip, does not relax but stretches further. With a constant load, the check uses
only the extreme values of the states over all accepted steps. With a varying load, a state may
exceed the level because the load fell, and only a state that still grows is an overload.
Limits: laws that take the applied force, and laws without a static level, are not checked. Long
runs whose steps are not kept are checked at the times of the result if the load varies, ensembles
only if it is constant.
"""

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array
from symfric.foundation.status import EnergyWarning, LimitWarning, OverloadWarning
from symfric.foundation.variable import stacked, strays, symbols_of
from symfric.integrator.compiled.columns import Columns
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.running.integrator import Integrator, remember
from symfric.integrator.running.record import RunRecord
from symfric.model import Model
from symfric.model.contact import APPLIED, Contact
from symfric.model.forces import by_laws

SPEEDS = np.array([1e-6, 1e-3, 1.0, 1e3])
"""Slips [m/s] of the first check, in both directions."""
LOADS = (1.0, 1e3)
"""Loads [N] of the first check."""
SHARE = 1e-3
"""Allowed energy gain, as a fraction of the energy turnover, for rounding and quadrature errors."""
REMEMBERED = 16
"""Number of parameter sets whose first check is cached."""
CLEAR = 1e-3
"""Fraction of the larger bound, or of the nominal value for 0, beyond which it is exceeded."""
MARGIN = 0.05
"""Fraction by which integration errors may raise friction above its level."""
WIDE = 0.25
"""The same for a varying load, since laws that follow it with a delay exceed their level."""
LOOKS = 200
"""Maximum number of peaks checked in a run with a varying load."""


def doubts(
    integrator: Integrator, inputs: InputData, run: RunRecord, p: Array
) -> list[UserWarning]:
    """Return the warnings about a run that ended well; empty if there are none."""
    if not run.status.ok:
        return []
    found = list[UserWarning]()
    for carried in places(integrator.model):
        if (most := carried.bound(run, p)) > 1 + MARGIN:
            texts = _overloads(carried, most, integrator, inputs, run, p)
            found += [OverloadWarning(text) for text in texts]
    for sliding in sliding_places(integrator.model):
        if sliding.suspect(p):
            found += [EnergyWarning(text) for text in _gains(sliding, integrator, inputs, run, p)]
    if text := "; ".join(_exceeded(integrator, inputs, run, p)):
        found.append(LimitWarning(f"Bounds are exceeded: {text}."))
    return found


def _exceeded(integrator: Integrator, inputs: InputData, run: RunRecord, p: Array) -> Iterator[str]:
    """Yield each variable that leaves its bounds, with the time and the farthest value."""
    model = integrator.model
    every = (v for group in (model.x, model.z, model.u) for v in group)
    limited = [v for v in every if isfinite(v.lower) or isfinite(v.upper)]
    if not limited:
        return
    t, y = (np.repeat(seen, 2, axis=0) for seen in run.seen)
    t[2::2] = np.nextafter(t[2::2], t[0])  # before a sample of an input
    values = _over_time(integrator, inputs, "bounded", symbols_of(limited), t, y, p)
    for v, x in zip(limited, values, strict=True):
        beyond = np.maximum(v.lower - x, x - v.upper)
        size = max(abs(b) for b in (v.lower, v.upper) if isfinite(b)) or v.nominal
        if (outside := beyond > CLEAR * size).any():
            k = int(outside.argmax())
            first = np.interp(0.0, beyond[k - 1 : k + 1], t[k - 1 : k + 1]) if k else t[0]
            value, allowed = x[beyond.argmax()], f"{v.lower:.4g} ... {v.upper:.4g}"
            yield f"{v.name} from t = {first:.3g} s, up to {value:.4g} {v.unit} ({allowed})"


def _over_time(
    integrator: Integrator, inputs: InputData, name: str, rows: ca.SX, t: Array, y: Array, p: Array
) -> Array:
    """Return the values of `rows` at times `t` with unknowns `y` (times, n), row by row.

    The evaluation is cached under `name`.
    """
    if name not in integrator.memory:
        integrator.memory[name] = Columns(integrator.of_time("doubts", rows))
    d = np.hstack([np.tile(p, (t.size, 1)), inputs.values[:, inputs.interval(t)].T])
    return integrator.memory[name]([t, y, d], backend="vm")[0].T


def _determined(model: Model, write: Callable[[], list[Any]]) -> ca.SX | None:
    """Return the expressions of a law with the forces of all laws inserted; None if undetermined.

    The law or the unknowns of the model may not determine them.
    """
    try:
        found = ca.vertcat(*write())
        if ca.depends_on(found, stacked(c.force for c in model.contacts)):
            found = by_laws(model, found)
    except (ValueError, TypeError, NotImplementedError):
        return None
    known = ca.vertcat(model.t, *(model.vector(letter) for letter in "xzup"))
    return None if strays(found, known) else found


@final
@dataclass(frozen=True, eq=False)
class Sliding:
    """Friction of one contact in steady sliding.

    Attributes:
        contact: the contact.
        power: (v, N, p) -> power [W] dissipated by steady friction.
        needs: indices of the parameters on which the power depends.
    """

    contact: Contact
    power: ca.Function
    needs: list[int]
    _checked: dict[Hashable, bool] = field(default_factory=dict[Hashable, bool])

    def suspect(self, p: Array) -> bool:
        """Return True if steady friction adds energy at some speed and load; cached."""
        key = p[self.needs].tobytes()
        if key not in self._checked:
            slips, loads = np.meshgrid(np.concatenate([-SPEEDS, SPEEDS]), LOADS)
            every = np.tile(p[:, None], (1, slips.size))
            power = self.power(slips.reshape(1, -1), loads.reshape(1, -1), every)
            remember(self._checked, key, bool(np.any(power.full() < 0)), REMEMBERED)
        return self._checked[key]


def _gains(
    sliding: Sliding, integrator: Integrator, inputs: InputData, run: RunRecord, p: Array
) -> Iterator[str]:
    """Yield a message about a contact whose friction adds energy to the motion."""
    (t, y), contact, memory = run.seen, sliding.contact, integrator.model.memory
    name, unit = f"sliding '{contact.name}'", contact.unit

    def slip_and_forces() -> list[Any]:
        steady = _steady(contact, contact.slip, contact.N, contact.given)
        return [contact.slip, contact.friction, steady]

    if name not in memory:
        memory[name] = _determined(integrator.model, slip_and_forces)
    if memory[name] is None:
        return
    slip, force, steady = _over_time(integrator, inputs, name, memory[name], t, y, p)
    power, worst = force * slip, int(np.argmin(steady * slip))
    work, turnover = (np.diff(t) @ (w[1:] + w[:-1]) / 2 for w in (power, np.abs(power)))
    if steady[worst] * slip[worst] < 0 and work < -SHARE * turnover:
        yield (
            f"In contact '{contact.name}' friction by {type(contact.law).__name__} adds "
            f"{-work:.3g} J to the motion: at a slip of {slip[worst]:.3g} {unit('m/s')} its "
            f"steady force is {steady[worst]:.3g} {unit('N')}, along the slip; check its sign."
        )


def sliding_places(model: Model) -> tuple[Sliding, ...]:
    """Return the contacts of a model whose steady friction is known."""
    if "sliding" not in model.memory:
        model.memory["sliding"] = tuple(s for c in model.contacts if (s := _sliding(model, c)))
    return model.memory["sliding"]


def _steady(contact: Contact, slip: ca.SX, load: ca.SX, given: Mapping[str, Any]) -> ca.SX:
    """Return the force of a law in steady sliding."""
    law = contact.law
    return ca.SX(law.force(slip, load, law.steady_state_at(slip, load, **given), **given))


def _sliding(model: Model, contact: Contact) -> Sliding | None:
    """Return the steady friction of a contact; None if its law does not determine it."""
    v, N, p = ca.SX.sym("v"), ca.SX.sym("N"), model.vector("p")
    try:
        power = _steady(contact, v, N, dict.fromkeys(contact.given, 0.0)) * v
    except (ValueError, TypeError, NotImplementedError):
        return None
    if strays(power, ca.vertcat(v, N, p)):
        return None
    needs = np.flatnonzero(ca.which_depends(power, p, 1, False)).tolist()
    return Sliding(contact, ca.Function("power", [v, N, p], [power]), needs)


@final
@dataclass(frozen=True, eq=False)
class CarriedForce:
    """Force carried by the states of a law in one contact, and its static level.

    Attributes:
        contact: the contact.
        rows: indices of its states among those of the model.
        force: force of the states at zero slip [N].
        level: largest possible force in either direction [N].
        screen: (z, p) -> force, level and the slope of the force; None if the load depends on the
            motion.
    """

    contact: Contact
    rows: list[int]
    force: ca.SX
    level: ca.SX
    screen: ca.Function | None
    _limits: dict[Hashable, tuple[float, Array]] = field(default_factory=dict[Hashable, Any])

    @cached_property
    def watched(self) -> ca.SX:
        """Force, level, and force times its rate, which is positive while the force grows."""
        z = symbols_of(self.contact.states)
        growth = self.force * ca.jtimes(self.force, z, self.contact.rate)
        return ca.vertcat(self.force, self.level, growth)

    @cached_property
    def linear(self) -> bool:
        """True if the force is linear in the states."""
        return bool(ca.is_linear(self.force, symbols_of(self.contact.states)))

    def ratios(self, screen: ca.Function, z: Array, p: Array) -> Array:
        """Return the ratio of force to level at extreme states `z` of runs; a column per run."""
        force, level, _ = (rows.full() for rows in screen(z, p))
        return np.abs(force[0]) / np.where(level[0] > 0, level[0], np.inf)

    def bound(self, run: RunRecord, p: Array) -> float:
        """Return an upper bound of force over level in a run, from the extremes of each state."""
        if self.screen is None:
            return inf
        tops = run.farthest[self.rows]
        if self.linear:
            if (limits := self._limits.get(p.tobytes())) is None:
                _, level, slope = self.screen(0.0, p)
                limits = float(level) or inf, np.abs(slope.full()[0])
                remember(self._limits, p.tobytes(), limits, REMEMBERED)
            return float(limits[1] @ tops) / limits[0]
        every = np.column_stack([tops, -tops])
        return float(self.ratios(self.screen, every, np.tile(p[:, None], (1, 2))).max())


def _overloads(
    carried: CarriedForce,
    most: float,
    integrator: Integrator,
    inputs: InputData,
    run: RunRecord,
    p: Array,
) -> Iterator[str]:
    """Yield a message about a contact whose force exceeds its level, by `most` at most."""
    (t, y), fixed = run.seen, carried.screen is not None
    if not fixed:
        k = _peaks(y[:, carried.rows])
        t, y = t[k], y[k]
    name = f"held '{carried.contact.name}'"
    force, level, growth = _over_time(integrator, inputs, name, carried.watched, t, y, p)
    ratio = np.abs(force) / np.where(level > 0, level, np.inf)
    start = max(1.0, ratio[0])  # the start value may exceed the level
    allowed = (1 + (MARGIN if fixed else WIDE)) * start
    ratio = ratio if fixed else np.where(growth > 0, ratio, 0.0)
    k = int(ratio.argmax())
    if ratio[k] > allowed:
        yield overload(carried, ratio[k], f" at t = {t[k]:.6g} s")
    elif fixed and most > allowed and not run.complete:  # overload between result times
        yield overload(carried, most)


def overload(carried: CarriedForce, ratio: float, when: str = "") -> str:
    """Return the message about friction that is `ratio` times its level."""
    contact, law = carried.contact.name, type(carried.contact.law).__name__
    return (
        f"In contact '{contact}' {law} carries {ratio:.3g} times its static level{when}: "
        "its states do not relax, so this friction is not that of the law; give a smaller v_eps, "
        "or a softer bristle, which creeps faster than v_eps and than velocities are rounded."
    )


def places(model: Model) -> tuple[CarriedForce, ...]:
    """Return the contacts of a model whose law sticks through its states."""
    if "held" not in model.memory:
        model.memory["held"] = tuple(h for c in model.contacts if (h := _carried(model, c)))
    return model.memory["held"]


def _carried(model: Model, contact: Contact) -> CarriedForce | None:
    """Return the force that the states of a contact carry; None if force or level are unknown."""
    if not contact.states or APPLIED in contact.given:
        return None
    z, p = symbols_of(contact.states), model.vector("p")
    force_at, N = contact.law.force, contact.N
    both = _determined(model, lambda: [force_at(0.0, N, z, **contact.given), contact.most_held])
    if both is None or not ca.depends_on(both[0], z):
        return None
    (force, level), screen = ca.vertsplit(both), None
    if not strays(both, ca.vertcat(z, p)):
        screen = ca.Function("held", [z, p], [force, level, ca.jacobian(force, z)])
    own = [v.name for v in contact.states]
    return CarriedForce(
        contact, [i for i, v in enumerate(model.x) if v.name in own], force, level, screen
    )


def _peaks(z: Array) -> NDArray[np.intp]:
    """Return indices of peaks of a state and of the points before them; about `LOOKS` at most."""
    size = np.abs(z)
    inner = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])
    k = np.flatnonzero(inner.any(axis=1)) + 1
    found = np.unique(np.concatenate([k - 1, k, [0, size.shape[0] - 1]]))
    return found[:: 1 + found.size // LOOKS]


def of_members(
    model: Model, reach: Mapping[str, Array], p: Array, given: Collection[str]
) -> dict[int, str]:
    """Return member -> message, for runs with these extreme states.

    Args:
        reach: state -> smallest and largest value, (2, members); NaN for members that did not
            start.
        p: parameters, (members, np).
        given: states with start values of the user, which may have any size.
    """
    found: dict[int, str] = {}
    for carried in places(model):
        own = [v.name for v in carried.contact.states]
        if carried.screen is None or not set(own).isdisjoint(given):
            continue
        ends = (np.array([reach[name][k] for name in own]) for k in (0, 1))
        ratio = np.fmax(*(carried.ratios(carried.screen, end, p.T) for end in ends))
        found |= {int(m): overload(carried, ratio[m]) for m in np.flatnonzero(ratio > 1 + MARGIN)}
    return found
