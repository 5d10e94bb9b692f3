"""User's machine with any law in it, what one run costs, and references of errors."""

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import inf, log
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.choice.friction import Friction, alike, friction_of
from symfric.choice.smoothing import OF_BRISTLES, Smoothing, smoothing
from symfric.figures.regularisation import Machine, Sample, apart, positions, sample
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.status import OverloadWarning, SolveError, Status
from symfric.laws import BrownMcPhee, Law, Stribeck
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import Scene

Array = NDArray[np.float64]


OVERLOAD = "drier bristles creep too slowly for their v_eps or for the rounding of velocities"
"""Reason for runs whose friction passes its level."""
FAILURES = (RuntimeError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError)
"""Errors that a law, or a function of the user that makes a machine of it, may raise."""


def quiet_run(machine: Machine, model: Model, law: Law, rtol: float, most: int) -> Sample:
    """One run of `model` without warnings; `most` attempts are allowed.

    Raises:
        SolveError: it failed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # loose tolerances are tried on purpose
        warnings.simplefilter("error", OverloadWarning)
        try:
            return sample(machine, law, rtol, max_steps=most, model=model)
        except OverloadWarning:
            raise SolveError(OVERLOAD, Status.SOLVER_FAILED) from None


@final
@dataclass(frozen=True, eq=False)
class Candidate:
    """Law in a machine, with numbers that describe the wanted friction, and its smoothing.

    Attributes:
        machine: where it is.
        law: with its numbers.
        knobs: place -> what may be scaled of the law there; "" for a function law -> model.
        scene: that holds the laws; None for a function law -> model.
    """

    machine: Machine
    law: Law
    knobs: Mapping[str, Smoothing]
    scene: Scene | None

    @property
    def power(self) -> float:
        """Least power of the smoothing that its velocities have; 0 where nothing is smooth."""
        return min((k.velocities for k in self.knobs.values() if k.powers), default=0.0)

    def law_at(self, s: float) -> Law:
        """Return the law at the smoothing `s`; of several places the first."""
        return next(iter(self.knobs.values())).at(s)

    def model(self, s: float) -> Model:
        """Return the machine at the smoothing `s`.

        Raises:
            ValueError: beyond a bound of the law, or the machine refuses it.
        """
        if self.scene is None:
            return self.machine.model(self.law_at(s))
        laws: dict[str, Any] = {place: knob.at(s) for place, knob in self.knobs.items()}
        return replace(self.scene, **laws).model()

    def run(self, model: Model, rtol: float, most: int) -> Sample:
        """One run of the law in `model`, the machine at some smoothing; see `quiet_run`."""
        return quiet_run(self.machine, model, self.law, rtol, most)

    @cached_property
    def first(self) -> Model:
        """Machine with the law as it comes."""
        return self.model(1.0)


def candidate(
    machine: Machine, law: Law, frictions: Mapping[str, Friction], load: float | None, own: bool,
    bristles: float = OF_BRISTLES[0],
) -> Candidate:  # fmt: skip
    """Return `law` in `machine`.

    Args:
        frictions: that it is to describe, by the place in the machine; "" for any other place.
        load: normal force [N] where it is one number.
        own: it has its numbers already: they were fitted, nothing is to be scaled.
        bristles: the power of the velocities of a law with states, see `smoothing`.

    Raises:
        ValueError: the machine refuses the law, or no numbers of the law describe the friction.
    """
    same = law if own else alike(law, frictions[""], load)
    made = machine.make(same)
    scene = made if isinstance(made, Scene) else None
    held = {"": same} if scene is None else holders(machine, scene, type(same))
    if not held:
        raise ValueError(f"{machine.name} does not hold it")
    knobs: dict[str, Smoothing] = {}
    for place, there in held.items():
        friction = frictions.get(place, frictions[""])
        if own:
            knobs[place] = Smoothing(there, {}, friction.mu_s, load)
        else:
            knobs[place] = smoothing(alike(there, friction, load), friction, load, bristles)
    return Candidate(machine, same, knobs, scene)


def holders(machine: Machine, scene: Scene, kind: type[Law]) -> dict[str, Law]:
    """Place -> law of the scene, where the candidate is."""
    names = machine.places or [item.name for item in fields(scene)]
    return {n: getattr(scene, n) for n in names if isinstance(getattr(scene, n), kind)}


def frictions_of(machine: Machine, given: Friction | None, scene: object) -> dict[str, Friction]:
    """Place -> friction there, "" for any: as given, else that of the scene as it comes."""
    if given is not None:
        return {"": given}
    if isinstance(scene, Scene):
        return {"": friction_of(scene.law)}
    start = Friction()
    made: object = start
    for probe in (start.exact, BrownMcPhee()):
        with suppress(*FAILURES):
            made = machine.make(probe)
            break
    if machine.places is not None or not isinstance(made, Scene):
        return {"": start}
    held = {f.name: getattr(made, f.name) for f in fields(made)}
    found = {name: friction_of(law) for name, law in held.items() if isinstance(law, Law)}
    return {"": found["law"]} | found


def load_of(model: Model) -> float | None:
    """Return the normal force [N] of all contacts where it is one number; else None."""
    loads = [contact.N for contact in model.contacts]
    if not loads or not all(is_number(N) and np.isfinite(float(N)) for N in loads):
        return None
    found = {float(N) for N in loads}  # pyright: ignore[reportArgumentType]
    return found.pop() if len(found) == 1 else None


FINE = 1e-10
"""Relative tolerance of references."""
ATTEMPTS = 400_000
RATIO, SHARPEST = 4.0, 12
"""Widths of the sharpest law fall by this factor, so many times at most."""


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """Motion that errors are measured from.

    Attributes:
        about: what it is.
        motion, size: rows of numbers, and what their errors are relative to.
        uncertain: how far it may be from dry friction itself; 0 of data.
        mean: errors are root mean squares: of data, which hold noise.
    """

    about: str
    motion: Array
    size: Array
    uncertain: float
    mean: bool = False

    def off(self, motion: Array) -> float:
        """Error of a motion; infinite where it does not compare."""
        return apart(motion, self.motion, self.size, self.mean)


OWN = Reference("its own fine run", np.zeros((0, 0)), np.zeros(0), 0.0)
"""Stands for the fine run of each law itself: only the integrator is judged."""


def reference_of(
    where: str,
    machine: Machine,
    given: object,
    frictions: Mapping[str, Friction],
    load: float | None,
    accuracy: float,
) -> tuple[Reference, Machine]:
    """Return the reference, and the machine compared at its times.

    Raises:
        ValueError: no reference, or signals that the machine does not have.
        SolveError: no law comes near dry friction in this machine.
    """
    if isinstance(given, Trajectory):
        names = (
            machine.of
            if machine.of and not callable(machine.of)
            else positions(given.model, BrownMcPhee())
        )
        rows = np.array([given[name] for name in names])
        own = replace(machine, of=tuple(names), times=given.t, t_end=float(given.t[-1]))
        return Reference("the run that was given", rows, _size(rows), 0.0), own
    if isinstance(given, Mapping):
        return _of_data(where, machine, checks.named(where, given))
    if isinstance(given, Law):
        return _of_law(machine, given), machine
    checks.choice(where, given, ("exact", "sharpest"))
    if given == "exact":
        try:
            return _exact(machine, frictions, load), machine
        except FAILURES:
            pass  # a machine without the applied force, or without events: the sharpest law then
    return _sharpest(machine, frictions, load, accuracy), machine


def _size(rows: Array) -> Array:
    moved = np.ptp(rows, axis=1)
    return np.where(moved > 0, moved, 1.0)


def _of_data(where: str, machine: Machine, given: Mapping[str, Any]) -> tuple[Reference, Machine]:
    times = checks.times(f"{where}: t", given.get("t"), 0.0)
    names = tuple(name for name in given if name != "t")
    if not names:
        raise ValueError(f"{where}: expected t and at least one signal, got t alone")
    rows = np.array([checks.array(f"{where}: {name}", given[name]) for name in names])
    if rows.shape[1] != times.size:
        raise ValueError(
            f"{where}: expected a value for each of {times.size} times, got {rows.shape[1]}"
        )
    own = replace(machine, of=names, times=times, t_end=float(times[-1]))
    return Reference("the data", rows, _size(rows), 0.0, mean=True), own


def _of_law(machine: Machine, law: Law) -> Reference:
    run = quiet_run(machine, machine.model(law), law, FINE, ATTEMPTS)
    return Reference(type(law).__name__, run.motion, run.size, FINE)


def _exact(machine: Machine, frictions: Mapping[str, Friction], load: float | None) -> Reference:
    held = candidate(machine, frictions[""].exact, frictions, load, own=False)
    fine, coarse = (held.run(held.first, rtol, ATTEMPTS) for rtol in (FINE, 10 * FINE))
    uncertain = apart(coarse.motion, fine.motion, fine.size)
    return Reference(
        "exact dry friction (ExactCoulomb)", fine.motion, fine.size, max(uncertain, FINE)
    )


def _sharpest(
    machine: Machine, frictions: Mapping[str, Friction], load: float | None, accuracy: float
) -> Reference:
    """Return the limit of a smooth law, as far as its runs follow each other in a power of the
    width.
    """
    law = BrownMcPhee() if frictions[""].v_s is None else Stribeck()
    held, runs, gaps = candidate(machine, law, frictions, load, own=False), [], list[float]()
    uncertain = inf
    for k in range(SHARPEST):
        s = RATIO**-k
        try:
            runs.append(held.run(held.model(s), max(1e-10, 1e-4 * accuracy), ATTEMPTS))
        except SolveError:
            if not runs:
                raise
            break
        if len(runs) > 1:
            gaps.append(apart(runs[-2].motion, runs[-1].motion, runs[-1].size))
            order = log(gaps[-2] / gaps[-1]) / log(RATIO) if len(gaps) > 1 and gaps[-1] else 0.0
            uncertain = gaps[-1] / (RATIO**order - 1) if order > 0.2 else gaps[-1]
        if uncertain < 0.1 * accuracy:
            break
    about = f"the sharpest law, {type(law).__name__} at {RATIO:g}^-{len(runs) - 1} of its width"
    return Reference(about, runs[-1].motion, runs[-1].size, uncertain)
