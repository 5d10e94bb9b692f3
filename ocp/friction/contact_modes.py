"""Stick and slip of contacts at one time: modes of set-valued Coulomb friction, found by trial.

A contact without velocity sticks if it can. The equations are solved with trial modes of all
contacts, which are changed until they are consistent:

    The reaction of a sticking contact must be within the static levels of both directions;
    otherwise the contact slips in the overloaded direction.
    A contact that starts to slip must accelerate in this direction, d slip/dt >= 0; otherwise it
    sticks.

One contact changes at a time, the most overloaded first. The equations are solved again after each
change, because normal forces and other reactions change with it. If modes repeat, all combinations
for the contacts without velocity are tried. A single consistent combination is accepted. If there
is none, or more than one, the modes are undetermined (`SolveError`).
"""

from collections.abc import Mapping
from itertools import product
from typing import Any, NamedTuple, final

import casadi as ca
import numpy as np

from ocp.formulation.changed_models import further_states, rebuilt
from ocp.formulation.expressions import arguments
from ocp.formulation.phase import Array
from ocp.friction.mode_models import SIDES, loops_of, mode_model, nominal_load, slip_change
from ocp.friction.sequence import KINDS
from ocp.friction.smooth_models import sticking
from symfric.foundation.parameters import Variable
from symfric.foundation.status import SolveError, Status
from symfric.foundation.variable import at_start, stacked
from symfric.model import Event, Model

Modes = dict[str, int]
OVERLOAD = 1e-9
"""Excess of a reaction over its static level at break-away, relative to the level at the start."""
STILL = 1e-11
"""Sliding velocity that counts as zero, relative to the nominal values of its states."""
TURNING = 1e-8
"""Sliding acceleration, relative to the largest one, that counts as rounding error."""
LIFTED = 1e-9
"""Magnitude up to which a normal force may be negative, relative to the friction force."""
MANY = 8
"""Largest number of contacts without velocity whose modes are tried in all combinations."""
NEWTON_STEPS, NEWTON_TOLERANCE = 60, 1e-11
LOOKS = 5
"""Number of entries of a row of `InModes.look`."""


class Instant(NamedTuple):
    """State of a model at one time, for which modes are decided.

    Attributes:
        t: time [s].
        x, u: states and inputs in the order of the mode models.
        guess: initial values of algebraic unknowns and friction forces "<contact>_F" by name.
    """

    t: float
    x: Array
    u: Array
    guess: Mapping[str, float]


class InModes(NamedTuple):
    """Model with one mode for each contact, and its functions.

    Attributes:
        model: mode model with events at which a slipping contact stops or a sticking contact is
            overloaded.
        unknowns: (t, x, z, u, p) -> residual of the algebraic equations, and its Jacobian by z.
        look: (t, x, z, u, p) -> row of each contact: upper margin, lower margin, d slip/dt, F, N.
        linear: True if the algebraic equations are affine in z, so that z is unique.
    """

    model: Model
    unknowns: ca.Function
    look: ca.Function
    linear: bool


@final
class Machine:
    """Model with contact modes, with which an `InModes` of each combination is cached.

    Attributes:
        model: the user's model.
        p: values of the parameters.
        contacts: contacts that can stick.
        sizes: contact -> typical holding force [N].
        together: contact -> contacts that stick together with it, including the contact.
        still: sliding velocity of each contact [m/s] that counts as zero.
    """

    def __init__(self, model: Model, p: Array) -> None:
        self.model, self.p, self.contacts = model, p, sticking(model)
        bare = model.open
        if bare.events:
            raise ValueError(
                f"model '{model.name}': expected no events but those of contacts, got "
                f"{', '.join(e.name for e in bare.events)}; their resets may start sliding"
            )
        kept: dict[Any, dict[tuple[int, ...], InModes]] = model.memory
        self._made = kept.setdefault("ocp machine", {})
        self.sizes = {c.name: nominal_load(model, c) for c in self.contacts}
        self.together = {c.name: (c.name,) for c in self.contacts}
        for loop in loops_of(model):
            names = tuple(c.name for c in loop.members)
            self.together |= dict.fromkeys(names, names)
        for c in self.contacts:
            slip_change(model, c)  # raises ValueError for slips that depend on an input
        slips = stacked(c.slip for c in self.contacts)
        slopes = ca.densify(ca.jacobian(slips, bare.vector("x")))
        symbols = [bare.t, bare.vector("x"), model.vector("p")]
        self._slips = ca.Function("slips", symbols, [slips, slopes])
        nominal = bare.nominal("x")
        touched = ca.DM(slopes.sparsity(), 1).full() != 0
        self.still = np.array([STILL * max(nominal[row], default=1.0) for row in touched])

    def within(self, modes: Modes) -> InModes:
        """Return the model with `modes`."""
        key = tuple(modes[c.name] for c in self.contacts)
        if key not in self._made:
            self._made[key] = self._make(modes)
        return self._made[key]

    def _make(self, modes: Modes) -> InModes:
        """Return the model with `modes`, with the integrals of the friction margins as states.

        No equation depends on these states. They let error control resolve a short overload of
        sticking contacts, during which no other state changes.
        """
        model = mode_model(self.model, modes)
        symbols = arguments(model)
        x, z, rate = symbols[1], symbols[2], ca.SX(0, 1) if model.ode is None else model.ode
        rows, events, margins = list[list[Any]](), list[Event](), dict[str, ca.SX]()

        def event(name: str, expression: ca.SX) -> None:
            events.append(Event(name, expression, -1, terminal=True))

        for c, still in zip(self.contacts, self.still, strict=True):
            change = ca.jtimes(c.slip, x, rate) + ca.jacobian(c.slip, model.t)
            mode = modes[c.name]
            if model.holonomic is None and not ca.SX(c.N).is_constant():
                event(f"{c.name}_lifts", c.N + OVERLOAD)
            if mode:
                rows.append([np.inf, np.inf, change, c.sliding(mode), c.N])
                event(f"{c.name}_stops", mode * c.slip + still)
                continue
            grips = [model.expression(f"{c.name}_grip_{side}") for side in SIDES.values()]
            rows.append([*grips, change, model.expression(f"{c.name}_reaction"), c.N])
            for side, grip in zip(SIDES.values(), grips, strict=True):
                share = margins[f"{c.name}_margin_{side}"] = grip / self.sizes[c.name]
                event(f"{c.name}_slips_{side}", share + OVERLOAD)
        states = tuple(Variable(name, "s") for name in margins)
        changes = further_states(model, states, stacked(margins.values()))
        seen = ca.vertcat(ca.SX(0, LOOKS), *(ca.horzcat(*map(ca.SX, row)) for row in rows))
        unknowns = [ca.densify(model.alg), ca.densify(ca.jacobian(model.alg, z))]
        return InModes(
            rebuilt(model, events=tuple(events), **changes),
            ca.Function("unknowns", symbols, unknowns),
            ca.Function("look", symbols, [ca.densify(seen)]),
            not ca.depends_on(unknowns[1], z),
        )

    def slips(self, t: float, x: Array) -> tuple[Array, Array]:
        """Return the sliding velocities, shape (n,), and their derivatives by states, (n, nx)."""
        values, slopes = self._slips(t, x, self.p)
        return values.full()[:, 0], slopes.full()

    def at_rest(self, t: float, x: Array, modes: Modes) -> Array:
        """Return the nearest states in which sticking contacts have zero slip.

        The correction removes rounding and event location errors, about 1e-11 of a velocity.
        """
        values, slopes = self.slips(t, x)
        held = [i for i, c in enumerate(self.contacts) if not modes[c.name]]
        if not held:
            return x
        return x - np.linalg.lstsq(slopes[held], values[held], rcond=None)[0]

    def solved(self, modes: Modes, at: Instant) -> tuple[dict[str, float], Array]:
        """Return algebraic unknowns and forces "<contact>_F" by name, and rows of `InModes.look`.

        Raises:
            SolveError: Newton's method does not converge.
        """
        made = self.within(modes)
        variables = made.model.z
        z = np.array([self._guess(v, at.guess, made.model) for v in variables])
        residual, slope = (m.full() for m in made.unknowns(at.t, at.x, z, at.u, self.p))
        size = np.maximum(np.abs(slope).max(axis=1, initial=1e-300), 1e-300)
        scale = np.maximum([v.nominal for v in variables], np.abs(z))
        for _ in range(NEWTON_STEPS):
            worst = np.abs(residual[:, 0] / size).max(initial=0.0)
            if worst <= NEWTON_TOLERANCE * max(1.0, float(np.max(scale, initial=0.0))):
                look = made.look(at.t, at.x, z, at.u, self.p).full()
                names = (*(v.name for v in variables), *(f"{c.name}_F" for c in self.contacts))
                return dict(zip(names, [*z, *look[:, 3].tolist()], strict=True)), look
            step = np.linalg.lstsq(slope, residual[:, 0], rcond=None)[0]
            for damping in (1.0, 0.5, 0.25, 0.1, 0.02):
                tried = z - damping * step
                parts = made.unknowns(at.t, at.x, tried, at.u, self.p)
                residual, slope = (m.full() for m in parts)
                if np.abs(residual[:, 0] / size).max() < worst:
                    break
            z = tried
            scale = np.maximum(scale, np.abs(z))
        raise self.undecided(at.t, f"Newton's method found no reactions with {shown(modes)}")

    def _guess(self, v: Variable, guess: Mapping[str, float], model: Model) -> float:
        contact = v.name.removesuffix("_reaction")
        for name in (v.name, *([f"{contact}_F"] if contact != v.name else [])):
            if name in guess:
                return guess[name]
        return float(at_start(ca.substitute(ca.SX(v.start), model.vector("p"), ca.DM(self.p)), ()))

    def undecided(self, t: float, why: str) -> SolveError:
        """Return a `SolveError` for undetermined contact modes with the reason `why`."""
        return SolveError(
            f"model '{self.model.name}' at t = {t:.9g} s: no unique stick/slip mode: {why}",
            Status.SOLVER_FAILED,
        )

    def decided(self, at: Instant, modes: Modes) -> tuple[Modes, dict[str, float]]:
        """Return the modes just after a time, with the unknowns and forces "<contact>_F".

        Args:
            at: state at this time, which determines the contacts without velocity.
            modes: modes just before this time; 0 for contacts that have stopped.

        Raises:
            SolveError: there are no unique consistent modes.
        """
        slips = zip(self.contacts, self.slips(at.t, at.x)[0], self.still, strict=True)
        free = [c.name for c, v, still in slips if abs(v) <= still]
        trial, seen = dict(modes), list[Modes]()
        while trial not in seen:
            seen.append(dict(trial))
            found, look = self.solved(trial, at)
            objection = self._objection(trial, free, found, look)
            if objection is None:
                if lifted := self._lifted(look):
                    raise self.undecided(at.t, f"with {shown(trial)} {lifted} lifts off")
                return trial, found
            trial |= objection
        return self._tried(at, trial, free)

    def changed(self, modes: Modes, t: Array, x: Array, z: Array, u: Array) -> int | None:
        """Return the index of the first of several times at which `modes` are inconsistent.

        Args:
            modes: modes just before each time.
            t: times [s], shape (n,).
            x, z, u: states, algebraic unknowns and inputs just after each time, (rows, n).
        """
        if not t.size:
            return None
        look, p = self.within(modes).look, np.tile(self.p[:, None], (1, t.size))
        rows = look.map(t.size)(t[None, :], x, z, u, p).full().reshape(-1, t.size, LOOKS)
        for k in range(t.size):
            slips = zip(self.contacts, self.slips(t[k], x[:, k])[0], self.still, strict=True)
            free = [c.name for c, v, still in slips if abs(v) <= still]
            seen = rows[:, k]
            forces = {f"{c.name}_F": row[3] for c, row in zip(self.contacts, seen, strict=True)}
            if self._objection(modes, free, forces, seen) is not None or self._lifted(seen):
                return k
        return None

    def _lifted(self, look: Array) -> str:
        """Return the name of the first contact with a negative normal force, or ""."""
        pairs = zip(self.contacts, look, strict=True)
        return next((c.name for c, row in pairs if row[4] < -LIFTED * abs(row[3])), "")

    def _objection(
        self, modes: Modes, free: list[str], forces: Mapping[str, float], look: Array
    ) -> Modes | None:
        """Return corrected modes of the most inconsistent contact, or None if all are consistent.

        Contacts that stick together with this contact change with it.
        """
        largest = max(1e-300, float(np.abs(look[:, 2]).max(initial=0.0)))
        found: list[tuple[float, str, Modes]] = []
        for c, (up, down, change, *_) in zip(self.contacts, look, strict=True):
            mode, members = modes[c.name], self.together[c.name]
            slack = OVERLOAD * self.sizes[c.name] / 2
            if not mode and max(-up, -down) > slack:
                away = {c.name: 1 if -up > -down else -1}
                if len(members) > 1:
                    away = {name: 1 if forces[f"{name}_F"] > 0 else -1 for name in members}
                share = max(-up, -down) / max((up + down) / 2, slack)
                found.append((2.0 + share, c.name, away))
            elif mode and c.name in free and mode * change < -TURNING * largest:
                still = {*members} <= {*free}
                rest = dict.fromkeys(members, 0) if still else {c.name: -mode}
                found.append((-mode * change / largest, c.name, rest))
        return max(found, key=lambda one: one[:2])[2] if found else None

    def _tried(self, at: Instant, modes: Modes, free: list[str]) -> tuple[Modes, dict[str, float]]:
        """Return the only consistent combination of modes of the contacts without velocity."""
        if len(free) > MANY or any(len(self.together[name]) > 1 for name in free):
            raise self.undecided(at.t, f"{len(free)} contacts without velocity have cyclic modes")
        fits: list[tuple[Modes, dict[str, float]]] = []
        for choice in product((0, 1, -1), repeat=len(free)):
            trial = modes | dict(zip(free, choice, strict=True))
            try:
                found, look = self.solved(trial, at)
            except SolveError:
                continue
            if self._objection(trial, free, found, look) is None and not self._lifted(look):
                fits.append((trial, found))
        if len(fits) != 1:
            what = "; ".join(shown(m) for m, _ in fits)
            text = f"{what} are consistent" if fits else "no choice of modes is consistent"
            raise self.undecided(at.t, text)
        return fits[0]


def shown(modes: Modes) -> str:
    """Return modes as text for messages."""
    return ", ".join(f"{name} {KINDS[mode]}" for name, mode in modes.items())
