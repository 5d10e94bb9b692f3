"""References of errors: exact dry friction, the sharpest law there is, a run, or data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, log
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.choice.friction import Friction
from symfric.choice.machine import FAILURES, Machine, candidate
from symfric.figures.regularisation import apart, positions
from symfric.foundation import checks
from symfric.foundation.status import SolveError
from symfric.laws import BrownMcPhee, Law, Stribeck
from symfric.results.trajectory import Trajectory

Array = NDArray[np.float64]
FINE = 1e-10
"""Relative tolerance of references."""
ATTEMPTS = 400_000
RATIO, SHARPEST = 4.0, 12
"""Widths of the sharpest law fall by this factor, so many times at most."""


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """The motion that errors are measured from.

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
    """The reference, and the machine compared at its times.

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
    run = machine.run(machine.with_law(law), law, FINE, ATTEMPTS)
    return Reference(type(law).__name__, run.motion, run.size, FINE)


def _exact(machine: Machine, frictions: Mapping[str, Friction], load: float | None) -> Reference:
    held = candidate(machine, frictions[""].exact, frictions, load, own=False)
    fine, coarse = (machine.run(held.first, held.law, rtol, ATTEMPTS) for rtol in (FINE, 10 * FINE))
    uncertain = apart(coarse.motion, fine.motion, fine.size)
    return Reference(
        "exact dry friction (ExactCoulomb)", fine.motion, fine.size, max(uncertain, FINE)
    )


def _sharpest(
    machine: Machine, frictions: Mapping[str, Friction], load: float | None, accuracy: float
) -> Reference:
    """The limit of a smooth law, as far as its runs follow each other in a power of the width."""
    law = BrownMcPhee() if frictions[""].v_s is None else Stribeck()
    held, runs, gaps = candidate(machine, law, frictions, load, own=False), [], list[float]()
    uncertain = inf
    for k in range(SHARPEST):
        s = RATIO**-k
        try:
            runs.append(machine.run(held.model(s), law, max(1e-10, 1e-4 * accuracy), ATTEMPTS))
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
