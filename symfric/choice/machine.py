"""Law in the user's machine, and the reference motion from which errors are measured."""

import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import inf, log
from typing import Any, final

import numpy as np

from symfric.choice.friction import Friction, alike, friction_of
from symfric.choice.smoothing import OF_BRISTLES, Smoothing, smoothing
from symfric.figures.regularisation import Machine, Sample, apart, positions, sample
from symfric.foundation import checks
from symfric.foundation.numeric import Array, is_number
from symfric.foundation.status import OverloadWarning, SolveError, Status
from symfric.laws import BrownMcPhee, Law, Stribeck
from symfric.model import Model
from symfric.results.trajectory import Trajectory
from symfric.scenes import Scene

OVERLOAD = "drier bristles creep too slowly for their v_eps or for the rounding of velocities"
"""Reason given for runs whose friction exceeds its static level."""
FAILURES = (RuntimeError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError)
"""Errors of a law, or of a function of the user that inserts it into a machine."""


def quiet_run(machine: Machine, model: Model, law: Law, rtol: float, most: int) -> Sample:
    """Return one run of `model` without warnings, with at most `most` attempts of a step.

    Raises:
        SolveError: the run failed.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # loose tolerances are intended
        warnings.simplefilter("error", OverloadWarning)
        try:
            return sample(machine, law, rtol, max_steps=most, model=model)
        except OverloadWarning:
            raise SolveError(OVERLOAD, Status.SOLVER_FAILED) from None


@final
@dataclass(frozen=True, eq=False)
class Candidate:
    """Law in a machine, with parameters that describe the required friction, and its smoothing.

    Attributes:
        machine: the machine.
        law: the law with its parameters.
        knobs: maps each contact to the smoothing of its law; the key is "" if `machine` is a
            function law -> model.
        scene: scene that contains the laws; None for a function law -> model.
    """

    machine: Machine
    law: Law
    knobs: Mapping[str, Smoothing]
    scene: Scene | None

    @property
    def power(self) -> float:
        """Smallest power of s with which velocities are scaled; 0 if nothing is scaled."""
        return min((k.velocities for k in self.knobs.values() if k.powers), default=0.0)

    def law_at(self, s: float) -> Law:
        """Return the law of the first contact at the smoothing `s`."""
        return next(iter(self.knobs.values())).at(s)

    def model(self, s: float) -> Model:
        """Return the machine at the smoothing `s`.

        Raises:
            ValueError: a parameter is out of bounds, or the machine rejects the law.
        """
        if self.scene is None:
            return self.machine.model(self.law_at(s))
        laws: dict[str, Any] = {place: knob.at(s) for place, knob in self.knobs.items()}
        return replace(self.scene, **laws).model()

    def run(self, model: Model, rtol: float, most: int) -> Sample:
        """Return one run of the law in `model`, a result of the method `model`; see `quiet_run`."""
        return quiet_run(self.machine, model, self.law, rtol, most)

    @cached_property
    def first(self) -> Model:
        """Machine with the unscaled law."""
        return self.model(1.0)


def candidate(
    machine: Machine, law: Law, frictions: Mapping[str, Friction], load: float | None, own: bool,
    bristles: float = OF_BRISTLES[0],
) -> Candidate:  # fmt: skip
    """Return `law` in `machine`.

    Args:
        machine: the machine.
        law: the law.
        frictions: maps contacts to the friction to describe; the key "" is for all others.
        load: normal force [N]; None if it is not one number.
        own: True if the law was fitted: its parameters are kept, and it is not scaled.
        bristles: power of the velocities of a law with states, see `smoothing`.

    Raises:
        ValueError: the machine rejects the law, or the law cannot describe the friction.
    """
    same = law if own else alike(law, frictions[""], load)
    made = machine.make(same)
    scene, laws = None, {"": same}
    if isinstance(made, Scene):
        scene, names = made, machine.places or [item.name for item in fields(made)]
        laws = {n: getattr(made, n) for n in names if isinstance(getattr(made, n), type(same))}
    if not laws:
        raise ValueError(f"{machine.name} does not hold it")
    knobs: dict[str, Smoothing] = {}
    for place, there in laws.items():
        friction = frictions.get(place, frictions[""])
        if own:
            knobs[place] = Smoothing(there, {}, friction.mu_s, load)
        else:
            knobs[place] = smoothing(alike(there, friction, load), friction, load, bristles)
    return Candidate(machine, same, knobs, scene)


def frictions_of(machine: Machine, given: Friction | None, scene: object) -> dict[str, Friction]:
    """Return the friction of each contact: `given`, or by default that of the laws of the scene.

    The key "" is for all contacts without an entry.
    """
    if given is not None:
        return {"": given}
    if isinstance(scene, Scene):
        return {"": friction_of(scene.law)}
    made: object = None
    for probe in (Friction().exact, BrownMcPhee()):
        with suppress(*FAILURES):
            made = machine.make(probe)
            break
    if machine.places is not None or not isinstance(made, Scene):
        return {"": Friction()}
    laws = {f.name: getattr(made, f.name) for f in fields(made)}
    frictions = {name: friction_of(law) for name, law in laws.items() if isinstance(law, Law)}
    return {"": frictions["law"]} | frictions


def load_of(model: Model) -> float | None:
    """Return the normal force [N] of all contacts, or None if it is not one number."""
    loads = [contact.N for contact in model.contacts]
    if not all(is_number(N) and np.isfinite(float(N)) for N in loads):
        return None
    values = {float(N) for N in loads}  # pyright: ignore[reportArgumentType]
    return values.pop() if len(values) == 1 else None


FINE = 1e-10
"""Relative tolerance of reference runs."""
ATTEMPTS = 400_000
RATIO, SHARPEST = 4.0, 12
"""Ratio of successive widths of the sharpest law, and the largest number of widths."""


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """Motion from which errors are measured.

    Attributes:
        about: description of the motion.
        motion, size: signals in rows, and the size of each row to which errors are relative.
        uncertain: estimated distance of the motion from dry friction; 0 for data.
        mean: True if errors are root mean squares, for data with noise.
    """

    about: str
    motion: Array
    size: Array
    uncertain: float
    mean: bool = False

    def off(self, motion: Array) -> float:
        """Return the error of a motion; inf if its shape differs from the reference."""
        return apart(motion, self.motion, self.size, self.mean)


OWN = Reference("its own fine run", np.zeros((0, 0)), np.zeros(0), 0.0)
"""Placeholder for the fine run of each law itself, for which only the integrator causes errors."""


def reference_of(
    where: str, machine: Machine, given: object, frictions: Mapping[str, Friction],
    load: float | None, accuracy: float,
) -> tuple[Reference, Machine]:  # fmt: skip
    """Return the reference, and the machine with the compared signals and times.

    Raises:
        ValueError: `given` is not a reference, or has signals that the machine does not have.
        SolveError: no law approaches dry friction in this machine.
    """
    if isinstance(given, Trajectory):
        signals = machine.of if machine.of and not callable(machine.of) else None
        names = tuple(signals or positions(given.model, BrownMcPhee()))
        rows = np.array([given[name] for name in names])
        return _known("the run that was given", machine, names, given.t, rows, mean=False)
    if isinstance(given, Mapping):
        data = checks.named(where, given)
        times = checks.times(f"{where}: t", data.pop("t", None), 0.0)
        if not data:
            raise ValueError(f"{where}: expected t and at least one signal, got t alone")
        rows = np.array([checks.array(f"{where}: {name}", data[name]) for name in data])
        if rows.shape[1] != times.size:
            raise ValueError(
                f"{where}: expected a value for each of {times.size} times, got {rows.shape[1]}"
            )
        return _known("the data", machine, tuple(data), times, rows, mean=True)
    if isinstance(given, Law):
        run = quiet_run(machine, machine.model(given), given, FINE, ATTEMPTS)
        return Reference(type(given).__name__, run.motion, run.size, FINE), machine
    checks.choice(where, given, ("exact", "sharpest"))
    if given == "exact":
        with suppress(*FAILURES):  # the machine may provide no applied force or no events
            return _exact(machine, frictions, load), machine
    return _sharpest(machine, frictions, load, accuracy), machine


def _known(
    about: str, machine: Machine, names: tuple[str, ...], times: Array, rows: Array, mean: bool
) -> tuple[Reference, Machine]:
    """Return known signals as the reference, and the machine compared at their times."""
    moved = np.ptp(rows, axis=1)
    size = np.where(moved > 0, moved, 1.0)
    compared = replace(machine, of=names, times=times, t_end=float(times[-1]))
    return Reference(about, rows, size, 0.0, mean), compared


def _exact(machine: Machine, frictions: Mapping[str, Friction], load: float | None) -> Reference:
    held = candidate(machine, frictions[""].exact, frictions, load, own=False)
    fine, coarse = (held.run(held.first, rtol, ATTEMPTS) for rtol in (FINE, 10 * FINE))
    uncertain = max(apart(coarse.motion, fine.motion, fine.size), FINE)
    return Reference("exact dry friction (ExactCoulomb)", fine.motion, fine.size, uncertain)


def _sharpest(
    machine: Machine, frictions: Mapping[str, Friction], load: float | None, accuracy: float
) -> Reference:
    """Return a smooth law with small widths, and its distance from the limit of zero widths.

    The distance follows from the power of the width with which the runs converge.
    """
    law = BrownMcPhee() if frictions[""].v_s is None else Stribeck()
    held, runs, gaps = candidate(machine, law, frictions, load, own=False), [], list[float]()
    uncertain = inf
    for k in range(SHARPEST):
        try:
            runs.append(held.run(held.model(RATIO**-k), max(1e-10, 1e-4 * accuracy), ATTEMPTS))
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
