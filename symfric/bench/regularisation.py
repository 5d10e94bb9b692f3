"""Error of smooth friction against dry friction, over what makes it smooth.

    error = max over signals and times of |x(s) - x(0)| / (largest - smallest value of x(0))

s scales v_t or, inversely, the stiffness of bristles. x(0) is the motion with set-valued friction
of the same levels, `ExactCoulomb`; where there is none, a run at a sixteenth of the smallest width,
whose own error follows from the order in which the last runs converge. Every width is run at
several tolerances: where their curves part, the error of the law ends and that of the integrator
begins. Where the motion is periodic, a second error is that of the last cycle, its period and its
amplitude, which does not grow with the number of cycles.

Limits: in the four-mass system three contacts rest as one. Which load each of them carries is not
determined by set-valued friction, and with mu_s > mu_d the instant of their break-away is neither;
smooth laws choose by how they creep, each in its way (1e-4 to 1e-3 apart). There Brown-McPhee is
measured against its own limit, and a law with mu_s = mu_d against set-valued friction.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import log, nan
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from symfric.bench import table
from symfric.figures.regularisation import (
    Machine,
    Regularisation,
    Sample,
    distance,
    regularisation,
    sample,
)
from symfric.foundation.parameters import parameters
from symfric.foundation.programs import find_compiler
from symfric.laws import (
    BrownMcPhee,
    Coulomb,
    ExactCoulomb,
    Law,
    LuGre,
    LuGreNormalised,
    steady_force,
)
from symfric.results.trajectory import Trajectory
from symfric.scenes import FourMass, PendulumBox, Rabinowicz, Scene, SliderCrank

Array = NDArray[np.float64]
RTOLS = (1e-5, 1e-6, 1e-8)
"""Relative tolerances of the runs."""
FINE = 1e-10
"""That of references."""
HALF_DECADES = tuple(10.0 ** (-k / 2) for k in range(9))
"""Factors of the widths: four decades."""
BEYOND = 1 / 16
"""Factor of the smallest width at which a reference is run where no exact law can be."""
STILL = 1e-12
"""What an instant may be off a sample [s] to be that sample."""
ROUNDS = 9
"""Calls, the fastest of which is the time."""


@final
@dataclass(frozen=True, eq=False)
class Case:
    """A law in a machine.

    Attributes:
        law: at its largest width.
        scene: law -> machine.
        exact: the law that it tends to, where the machine can have it.
        cycle: whether the motion is periodic.
    """

    name: str
    law: Law
    scene: Callable[[Law], Scene]
    t_end: float
    exact: Callable[[Law], Law] | None = None
    cycle: bool = False
    of: tuple[str, ...] | None = None


class RegularisationRow(NamedTuple):
    """One width at one tolerance.

    Attributes:
        parameter, unit, value: what makes the law smooth.
        error: largest difference from dry friction, relative to the size of the motion.
        cycle_error: that of period and amplitude of the last cycle; NaN where there is none.
        order: in which the error falls from the width before; NaN at the first.
        time_s: CPU time of a call [s].
        reference: what it is compared with.
        uncertain: error of the reference.
    """

    case: str
    parameter: str
    unit: str
    value: float
    rtol: float
    error: float
    cycle_error: float
    order: float
    time_s: float
    steps: int
    attempts: int
    reference: str
    uncertain: float


def peak(law: Law) -> float:
    """Largest coefficient of friction of a static law in steady sliding, near its v_t."""
    scale = float(law.velocity_scale)  # pyright: ignore[reportArgumentType]
    return float(steady_force(law, np.linspace(0.5, 2.0, 30001) * scale, 1.0).max())


def _coulomb(law: Law) -> Law:
    """Dry friction with the levels of Brown-McPhee, whose peak is 0.05 % short of mu_s."""
    return ExactCoulomb(mu_s=peak(law), mu_d=parameters(law)["mu_d"].value)


def _flat(law: Law) -> Law:
    """Dry friction of one level."""
    mu = parameters(law)["mu_d"].value
    return ExactCoulomb(mu_s=mu, mu_d=mu)


def _falling(law: Law) -> Law:
    """Dry friction that falls over the Stribeck velocity of bristles."""
    own = parameters(law)
    levels = {name: own[name].value for name in ("mu_s", "mu_d", "v_s", "sigma_2")}
    return ExactCoulomb(form="stribeck", **levels)


def _brown(mu_s: float, mu_d: float) -> Law:
    return BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=1e-2)


def _lugre(kind: type[LuGre | LuGreNormalised]) -> Law:
    return kind(mu_s=0.15, mu_d=0.1, v_s=1e-2, sigma_0=1e3, sigma_1=10.0, sigma_2=0.0)


def _slow_crank(law: Law) -> Scene:
    """Started with 1 rad/s, so that it comes to rest."""
    return SliderCrank(law, omega=1.0)


CASES = (
    Case(
        name="rabinowicz brown_mcphee",
        law=_brown(0.15, 0.1),
        scene=Rabinowicz,
        t_end=20.0,
        exact=_coulomb,
        cycle=True,
        of=("x",),
    ),
    Case(
        name="rabinowicz lugre",
        law=_lugre(LuGre),
        scene=Rabinowicz,
        t_end=20.0,
        exact=_falling,
        cycle=True,
        of=("x",),
    ),
    Case("pendulum_box brown_mcphee", _brown(0.15, 0.1), PendulumBox, 15.0, _coulomb),
    Case("pendulum_box lugre_normalised", _lugre(LuGreNormalised), PendulumBox, 15.0, _falling),
    Case("four_mass coulomb", Coulomb(mu_d=0.1, v_eps=1e-2), FourMass, 4.0, _flat),
    Case("four_mass brown_mcphee", _brown(0.12, 0.1), FourMass, 4.0),
    Case("slider_crank brown_mcphee", _brown(0.1, 0.08), _slow_crank, 5.0, _coulomb),
)


@final
@dataclass(frozen=True)
class RegularisationBenchmark(table.Report):
    """Errors and costs of all cases over width and tolerance; see `bench_regularisation`."""

    rows: tuple[RegularisationRow, ...]

    def shown(self) -> Iterator[table.Table | str]:
        """A table per case, a line per width: errors at each tolerance, order and cost."""
        for case in dict.fromkeys(row.case for row in self.rows):
            own = [row for row in self.rows if row.case == case]
            first, rtols = own[0], list(dict.fromkeys(row.rtol for row in own))
            lines = [
                [row for row in own if row.value == x] for x in dict.fromkeys(r.value for r in own)
            ]
            cyclic = any(line[-1].cycle_error == line[-1].cycle_error for line in lines)
            yield table.Table(
                f"{case}: error against {first.reference} (accurate to {first.uncertain:.1g}); "
                "order and error of the last cycle at the smallest rtol, steps and time at the "
                "largest",
                [f"{first.parameter} [{first.unit}]", *(f"error at rtol {r:g}" for r in rtols),
                 "order", *(["error of the last cycle"] if cyclic else []), "steps",
                 "time per run [ms]"],
                [
                    [table.short(line[0].value), *(table.short(r.error) for r in line),
                     table.short(line[-1].order, 2),
                     *([table.short(line[-1].cycle_error)] if cyclic else []), line[0].steps,
                     table.short(1e3 * line[0].time_s)]
                    for line in lines
                ],
            )  # fmt: skip

    def drawn(self) -> tuple[Any, ...]:
        """Error against width above, CPU time below, a column per case, a line per tolerance."""
        return "regularisation", self.rows


def bench_regularisation(
    *,
    quick: bool = False,
    cases: Sequence[Case] = CASES,
    factors: Sequence[float] = HALF_DECADES,
    rtols: Sequence[float] = RTOLS,
    progress: table.Progress = None,
) -> RegularisationBenchmark:
    """Run every case at every width and tolerance, as machine code where there is a compiler.

    `quick` takes every second width once, in the virtual machine.
    """
    factors = factors[::2] if quick else factors
    backend = "vm" if quick or find_compiler() is None else "compiled"
    rows: list[RegularisationRow] = []
    for case in table.each(cases, progress, lambda case: case.name):
        rows += _measured(case, factors, rtols, 2 if quick else ROUNDS, backend)
    return RegularisationBenchmark(tuple(rows))


def _measured(
    case: Case, factors: Sequence[float], rtols: Sequence[float], rounds: int, backend: str
) -> list[RegularisationRow]:
    """The rows of a case: tolerance by tolerance, width by width."""
    knob = regularisation("bench", case.law)
    model = case.scene(case.law).model(knob.names)
    machine = Machine(case.name, lambda _: model, case.t_end, case.of, free=True, backend=backend)
    reference, of_what, uncertain = _reference(case, knob, machine, factors)
    cycles = replace(machine, of=last_cycle) if case.cycle else None
    exact = _reference(case, knob, cycles, factors)[0] if cycles else None
    name, unit = knob.names[0], parameters(case.law)[knob.names[0]].unit
    rows: list[RegularisationRow] = []
    for rtol in rtols:
        before: tuple[float, float] | None = None
        for s in factors:
            run = _at(machine, knob, s, rtol, rounds)
            error, in_cycle, order = distance(run, reference), nan, nan
            if cycles and exact:
                in_cycle = distance(_at(cycles, knob, s, rtol), exact)
            if before is not None and error > 0 < before[1]:
                order = log(before[1] / error) / log(before[0] / s)
            before = s, error
            rows.append(
                RegularisationRow(
                    case=case.name,
                    parameter=name,
                    unit=unit,
                    value=run.values[name],
                    rtol=rtol,
                    error=error,
                    cycle_error=in_cycle,
                    order=order,
                    time_s=run.time_s,
                    steps=run.steps,
                    attempts=run.attempts,
                    reference=of_what,
                    uncertain=uncertain,
                )
            )
    return rows


def _at(machine: Machine, knob: Regularisation, s: float, rtol: float, rounds: int = 1) -> Sample:
    return sample(machine, knob.law, rtol, s, knob.values(s), rounds)


def _reference(
    case: Case, knob: Regularisation, machine: Machine, factors: Sequence[float]
) -> tuple[Sample, str, float]:
    """The motion with dry friction, what it is, and its error."""
    if case.exact is not None:
        law = case.exact(case.law)
        exact = case.scene(law).model()
        own = Machine(case.name, lambda _: exact, case.t_end, machine.of, backend="vm")
        fine = sample(own, law, FINE)
        return fine, type(law).__name__, max(FINE, distance(sample(own, law, 10 * FINE), fine))
    last = factors[-1] * BEYOND
    coarse, middle, finest = (_at(machine, knob, last * r**2, FINE) for r in (4.0, 2.0, 1.0))
    wide, near = distance(coarse, middle), distance(middle, finest)
    order = log(wide / near) / log(4.0) if wide > near > 0 else nan
    name = knob.names[0]
    # near = C s^q (4^q - 1) where s is the finest width
    left = near / (4.0**order - 1.0) if order == order else near
    return finest, f"{name} = {finest.values[name]:.3g}", max(left, FINE)


def last_cycle(run: Trajectory) -> Array:
    """Period [s] and amplitude [m] of the last stick-slip cycle of `x`; empty without two cycles.

    A cycle goes from one largest elongation to the next, the smallest between them. These are where
    the cubic through four samples of the velocity passes through zero.
    """
    t, x, v = run.t, run["x"], run["v"]
    falls = np.flatnonzero((v[1:-2] > 0) & (v[2:-1] <= 0)) + 1
    if falls.size < 2:
        return np.zeros(0)
    rises = np.flatnonzero((v[1:-2] < 0) & (v[2:-1] >= 0)) + 1
    low = rises[(rises > falls[-2]) & (rises < falls[-1])][-1]
    (first, _), (_, least), (last, most) = (_turn(t, x, v, k) for k in (falls[-2], low, falls[-1]))
    return np.array([last - first, most - least])


def _turn(t: Array, x: Array, v: Array, k: int) -> tuple[float, float]:
    """Instant and value of the extreme of x between the samples k and k + 1."""
    h = float(t[k + 1] - t[k])
    rate = np.polynomial.Polynomial.fit(t[k - 1 : k + 3] - t[k], v[k - 1 : k + 3], 3).convert()
    roots = rate.roots()
    inside = roots.real[(np.abs(roots.imag) < STILL) & (roots.real > -STILL) & (roots.real < h)]
    way = rate.integ()
    at = float(inside[0])
    return float(t[k]) + at, float(x[k] + way(at) - way(0.0))
