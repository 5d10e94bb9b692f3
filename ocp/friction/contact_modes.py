"""Stick and slip of contacts at an instant: set-valued Coulomb friction, decided by trial.

A contact that stops, or sticks already, sticks if it can. The equations are solved with the modes
of all contacts, and

    sticking contacts   must have a reaction within the static levels of both directions; else they
                        slip in the overloaded direction
    contacts that start to slip must accelerate in that direction: d slip/dt >= 0; else they stick

until all modes are consistent. One contact changes at a time, the most overloaded first, and each
change solves everything again, since normal forces and other reactions change with it. If modes
repeat, all modes of the contacts without velocity are tried; a single consistent combination is
accepted. If there is none, or more than one, the modes are undetermined (`SolveError`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ocp.formulation.statement import further_states
from ocp.friction.mode_models import loops_of, mode_model, nominal_load, slip_change
from ocp.friction.smooth_models import jumps
from symfric.foundation.parameters import Variable
from symfric.foundation.status import SolveError, Status
from symfric.foundation.variable import at_start
from symfric.model import Contact, Event, Model

Array = NDArray[np.float64]
Modes = dict[str, int]
OVERLOAD = 1e-9
"""Excess of a reaction over the static level at break-away, over the level at the start."""
STILL = 1e-11
"""Relative sliding velocity treated as zero, over the nominal values of its states."""
TURNING = 1e-8
"""Sliding acceleration, over the largest one, that is rounding error."""
LIFTED = 1e-9
"""Share of the friction force by which a normal force may be negative."""
MANY = 8
"""Largest number of contacts without velocity whose modes are tried in all combinations."""
NEWTON_STEPS, NEWTON_TOLERANCE = 60, 1e-11


@final
@dataclass(frozen=True, eq=False)
class Instant:
    """State of a model for which its modes are decided.

    Attributes:
        t: time [s].
        x, u, p: numbers in the order of the mode models.
        guess: algebraic unknowns and friction forces "<contact>_F" by name.
    """

    t: float
    x: Array
    u: Array
    p: Array
    guess: Mapping[str, float]


@final
@dataclass(frozen=True, eq=False)
class InModes:
    """A model with one mode for each contact, and its functions.

    Attributes:
        model: with events at which a slipping contact stops or a sticking one is overloaded.
        modes: of the contacts.
        unknowns: (t, x, z, u, p) -> residual of the algebraic equations, and its slopes by z.
        look: (t, x, z, u, p) -> for each contact: margin above, margin below, d slip/dt, F, N.
    """

    model: Model
    modes: Modes
    unknowns: ca.Function
    look: ca.Function


@final
class Machine:
    """A model with contact modes; one `InModes` for each combination of modes, cached."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.contacts: tuple[Contact, ...] = tuple(c for c in model.contacts if jumps(model, c))
        bare = model.open
        if bare.events:
            raise ValueError(
                f"model '{model.name}': expected no events but those of contacts, got "
                f"{', '.join(e.name for e in bare.events)}; their resets may start sliding"
            )
        self._made: dict[tuple[int, ...], InModes] = {}
        self.sizes = {c.name: nominal_load(model, c) for c in self.contacts}
        """Typical holding forces of the contacts [N]."""
        self.together = {c.name: (c.name,) for c in self.contacts}
        """Contacts that stick together with each one."""
        for loop in loops_of(model, self.contacts):
            names = tuple(c.name for c in loop.members)
            self.together |= dict.fromkeys(names, names)
        for c in self.contacts:
            slip_change(model, c)  # raises for slips that depend on an input
        symbols = [bare.t, bare.vector("x"), model.vector("p")]
        slips = ca.vertcat(ca.SX(0, 1), *(c.slip for c in self.contacts))
        slopes = ca.densify(ca.jacobian(slips, bare.vector("x")))
        self._slips = ca.Function("slips", symbols, [slips, slopes])
        nominal = bare.nominal("x")
        touched = ca.DM(slopes.sparsity(), 1).full() != 0
        self.still = np.array([STILL * max(nominal[row], default=1.0) for row in touched])
        """Sliding velocity of each contact [m/s] treated as zero."""

    def within(self, modes: Modes) -> InModes:
        """Return the model with these modes."""
        key = tuple(modes[c.name] for c in self.contacts)
        if key not in self._made:
            self._made[key] = self._make(modes)
        return self._made[key]

    def _make(self, modes: Modes) -> InModes:
        model = mode_model(self.model, modes)
        symbols = [model.t, *(model.vector(letter) for letter in "xzup")]
        x, z, rate = symbols[1], symbols[2], _rates(model)
        rows, events, margins = list[list[Any]](), list[Event](), dict[str, ca.SX]()
        for c, still in zip(self.contacts, self.still, strict=True):
            change = ca.jtimes(c.slip, x, rate) + ca.jacobian(c.slip, model.t)
            mode = modes[c.name]
            if model.holonomic is None and not ca.SX(c.N).is_constant():
                events.append(Event(f"{c.name}_lifts", c.N + OVERLOAD, -1, terminal=True))
            if mode:
                rows.append([np.inf, np.inf, change, c.sliding(mode), c.N])
                events.append(Event(f"{c.name}_stops", mode * c.slip + still, -1, terminal=True))
                continue
            F, size = model.expression(f"{c.name}_reaction"), self.sizes[c.name]
            up, down = (model.expression(f"{c.name}_grip_{side}") for side in ("up", "down"))
            rows.append([up, down, change, F, c.N])
            for side, margin in (("up", up), ("down", down)):
                share = margin / size
                events.append(Event(f"{c.name}_slips_{side}", share + OVERLOAD, -1, terminal=True))
                margins[f"{c.name}_margin_{side}"] = share
        seen = ca.vertcat(ca.SX(0, 5), *(ca.horzcat(*map(ca.SX, row)) for row in rows))
        return InModes(
            _ending(model, tuple(events), margins),
            dict(modes),
            ca.Function("unknowns", symbols,
                        [ca.densify(model.alg), ca.densify(ca.jacobian(model.alg, z))]),
            ca.Function("look", symbols, [ca.densify(seen)]),
        )  # fmt: skip

    def slips(self, t: float, x: Array, p: Array) -> tuple[Array, Array]:
        """Return sliding velocities, shape (n,), and their derivatives by the states, (n, nx)."""
        values, slopes = self._slips(t, x, p)
        return values.full()[:, 0], slopes.full()

    def at_rest(self, t: float, x: Array, p: Array, modes: Modes) -> Array:
        """Return the nearest states in which sticking contacts have zero slip.

        The correction removes rounding and event location errors, about 1e-11 of a velocity.
        """
        values, slopes = self.slips(t, x, p)
        held = [i for i, c in enumerate(self.contacts) if not modes[c.name]]
        if not held:
            return x
        return x - np.linalg.lstsq(slopes[held], values[held], rcond=None)[0]

    def solved(self, modes: Modes, at: Instant) -> tuple[dict[str, float], Array]:
        """Return the algebraic unknowns with these modes by name, and the rows of `InModes.look`.

        Raises:
            SolveError: Newton's method fails.
        """
        made = self.within(modes)
        names = [v.name for v in made.model.z]
        z = np.array([_guessed(v.name, at.guess, v.start, made.model, at.p) for v in made.model.z])
        residual, slope = (m.full() for m in made.unknowns(at.t, at.x, z, at.u, at.p))
        size = np.maximum(np.abs(slope).max(axis=1, initial=1e-300), 1e-300)
        scale = np.array(
            [max(v.nominal, abs(value)) for v, value in zip(made.model.z, z, strict=True)]
        )
        for _ in range(NEWTON_STEPS):
            worst = np.abs(residual[:, 0] / size).max(initial=0.0)
            if worst <= NEWTON_TOLERANCE * max(1.0, float(np.max(scale, initial=0.0))):
                return dict(zip(names, z, strict=True)), made.look(at.t, at.x, z, at.u, at.p).full()
            step = np.linalg.lstsq(slope, residual[:, 0], rcond=None)[0]
            for damping in (1.0, 0.5, 0.25, 0.1, 0.02):
                tried = z - damping * step
                residual, slope = (m.full() for m in made.unknowns(at.t, at.x, tried, at.u, at.p))
                if np.abs(residual[:, 0] / size).max() < worst:
                    break
            z = tried
            scale = np.maximum(scale, np.abs(z))
        raise self.undecided(at.t, f"Newton's method found no reactions with {shown(modes)}")

    def margin(self, modes: Modes, at: Instant) -> float:
        """Return the least friction margin of sticking contacts, over nominal loads; < 0: slip."""
        _, look = self.solved(modes, at)
        found = [
            min(row[0], row[1]) / self.sizes[c.name]
            for c, row in zip(self.contacts, look, strict=True)
            if not modes[c.name]
        ]
        return min(found, default=np.inf) + OVERLOAD

    def undecided(self, t: float, why: str) -> SolveError:
        """Return the SolveError for undetermined contact modes."""
        return SolveError(
            f"model '{self.model.name}' at t = {t:.9g} s: no unique stick/slip mode: {why}",
            Status.SOLVER_FAILED,
        )


def _ending(model: Model, events: tuple[Event, ...], margins: Mapping[str, ca.SX]) -> Model:
    """Return `model` with events, and the integrals of the `margins` as states.

    Nothing depends on them. They make error control resolve a short overload of sticking contacts,
    during which nothing moves.
    """
    states = tuple(Variable(name, "s") for name in margins)
    rates = ca.vertcat(ca.SX(0, 1), *margins.values())
    return replace(model, events=events, **further_states(model, states, rates))


def _rates(model: Model) -> ca.SX:
    return ca.SX(0, 1) if model.ode is None else model.ode


def _guessed(name: str, guess: Mapping[str, float], start: Any, model: Model, p: Array) -> float:
    if name in guess:
        return guess[name]
    if name.endswith("_reaction") and (F := f"{name.removesuffix('_reaction')}_F") in guess:
        return guess[F]
    return float(at_start(ca.substitute(ca.SX(start), model.vector("p"), ca.DM(p)), ()))


def shown(modes: Modes) -> str:
    """Return modes as text."""
    words = {1: "slip+", 0: "stick", -1: "slip-"}
    return ", ".join(f"{name} {words[mode]}" for name, mode in modes.items())


def decided(machine: Machine, at: Instant, modes: Modes) -> tuple[Modes, dict[str, float]]:
    """Return the modes after this instant, with the unknowns and forces "<contact>_F".

    Args:
        machine: the model.
        at: the instant; its states determine the contacts without velocity.
        modes: modes before it; 0 for contacts that stopped.

    Raises:
        SolveError: no unique consistent modes.
    """
    slips = machine.slips(at.t, at.x, at.p)[0]
    free = [c.name for c, v, still in zip(machine.contacts, slips, machine.still, strict=True)
            if abs(v) <= still]  # fmt: skip
    trial, seen = dict(modes), list[Modes]()
    while trial not in seen:
        seen.append(dict(trial))
        found, look = machine.solved(trial, at)
        objection = _objection(machine, trial, free, look)
        if objection is None:
            if lifted := _lifted(machine, look):
                raise machine.undecided(at.t, f"with {shown(trial)} {lifted} lifts off")
            return trial, found | _forces(machine, look)
        trial |= objection
    return _tried(machine, at, trial, free)


def _forces(machine: Machine, look: Array) -> dict[str, float]:
    return {f"{c.name}_F": float(row[3]) for c, row in zip(machine.contacts, look, strict=True)}


def _lifted(machine: Machine, look: Array) -> str:
    """Return the first contact with a negative normal force, or ""."""
    pairs = zip(machine.contacts, look, strict=True)
    return next((c.name for c, row in pairs if row[4] < -LIFTED * abs(row[3])), "")


def _objection(machine: Machine, modes: Modes, free: list[str], look: Array) -> Modes | None:
    """Return corrected modes of the worst inconsistent contact and those that stick with it."""
    largest = max(1e-300, float(np.abs(look[:, 2]).max(initial=0.0)))
    forces = _forces(machine, look)
    found: list[tuple[float, str, Modes]] = []
    for c, (up, down, change, *_) in zip(machine.contacts, look, strict=True):
        mode, members = modes[c.name], machine.together[c.name]
        if not mode:
            slack = OVERLOAD * machine.sizes[c.name] / 2
            excess = max(-up, -down)
            if excess > slack:
                away = {c.name: 1 if -up > -down else -1}
                if len(members) > 1:
                    away = {name: 1 if forces[f"{name}_F"] > 0 else -1 for name in members}
                found.append((2.0 + excess / max((up + down) / 2, slack), c.name, away))
        elif c.name in free and mode * change < -TURNING * largest:
            still = {*members} <= {*free}
            rest = dict.fromkeys(members, 0) if still else {c.name: -mode}
            found.append((-mode * change / largest, c.name, rest))
    return max(found, key=lambda one: one[:2])[2] if found else None


def _tried(
    machine: Machine, at: Instant, modes: Modes, free: list[str]
) -> tuple[Modes, dict[str, float]]:
    """Try all combinations of modes of the contacts without velocity."""
    if len(free) > MANY or any(len(machine.together[name]) > 1 for name in free):
        raise machine.undecided(at.t, f"{len(free)} contacts without velocity have cyclic modes")
    fits = list(_consistent(machine, at, modes, free))
    if len(fits) != 1:
        what = "; ".join(shown(m) for m, _ in fits) if fits else "no choice of modes"
        raise machine.undecided(at.t, f"{what} are consistent" if fits else f"{what} is consistent")
    return fits[0]


def _consistent(
    machine: Machine, at: Instant, modes: Modes, free: list[str]
) -> Iterator[tuple[Modes, dict[str, float]]]:
    for choice in product((0, 1, -1), repeat=len(free)):
        trial = modes | dict(zip(free, choice, strict=True))
        try:
            found, look = machine.solved(trial, at)
        except SolveError:
            continue
        if _objection(machine, trial, free, look) is None and not _lifted(machine, look):
            yield trial, found | _forces(machine, look)
