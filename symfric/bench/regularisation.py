"""Error of smooth friction relative to dry friction, over the width or stiffness of the law.

    error = max over signals and times of |x(s) - x(0)| / (largest - smallest value of x(0))

The factor s scales v_t or, inversely, the stiffness of bristles. The reference x(0) is the motion
with set-valued friction of the same levels, `ExactCoulomb`. In a machine that does not allow this
law, the reference is a run at a sixteenth of the smallest width; its error is estimated from the
order of convergence of the last runs. Each width is run at several tolerances. Where their curves
agree, they show the error of the law; where they differ, that of the integrator. For a periodic
motion, the error of period and amplitude of the last cycle is measured as well, since it does not
grow with the number of cycles.

Limits: in the four-mass system three contacts are at rest together. Set-valued friction does not
determine their loads and, with mu_s > mu_d, the instant of their break-away; the creep of each
smooth law determines them (1e-4 to 1e-3 apart). There, Brown-McPhee is compared with its limit,
and a law with mu_s = mu_d with set-valued friction.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import log, nan
from typing import final

import numpy as np

from symfric import Trajectory, parameters, with_values
from symfric.bench.report import Found, Progress, Report, backend, curves
from symfric.figures.regularisation import (
    Machine,
    Regularisation,
    Sample,
    distance,
    regularisation,
    sample,
)
from symfric.foundation.numeric import Array
from symfric.laws import (
    BrownMcPhee,
    Coulomb,
    ExactCoulomb,
    Law,
    LuGre,
    LuGreNormalised,
    steady_force,
)
from symfric.scenes import FourMass, PendulumBox, Rabinowicz, Scene, SliderCrank

RTOLS = (1e-5, 1e-6, 1e-8)
"""Relative tolerances of the runs."""
FINE = 1e-10
"""Relative tolerance of references."""
HALF_DECADES = tuple(10.0 ** (-k / 2) for k in range(9))
"""Factors of the widths over four decades."""
BEYOND = 1 / 16
"""Ratio of the width of a reference without an exact law to the smallest measured width."""
ROUNDS = 9
"""Number of calls, of which the shortest time is used."""
TITLE = "Error of smooth friction relative to dry friction"


@final
@dataclass(frozen=True, eq=False)
class LawCase:
    """Law in a machine.

    Attributes:
        name: machine and law.
        law: law at its largest width.
        scene: function from a law to the machine.
        t_end: end time [s].
        exact: function from the law to its limit; None if the machine does not allow the limit.
        cycle: True for a periodic motion.
        of: compared signals.
    """

    name: str
    law: Law
    scene: Callable[[Law], Scene]
    t_end: float
    exact: Callable[[Law], Law] | None = None
    cycle: bool = False
    of: tuple[str, ...] | None = None


def peak(law: Law) -> float:
    """Return the largest friction coefficient of a static law in steady sliding, near its v_t."""
    scale = float(law.velocity_scale)  # pyright: ignore[reportArgumentType]
    return float(steady_force(law, np.linspace(0.5, 2.0, 30001) * scale, 1.0).max())


def _coulomb(law: Law) -> Law:
    """Return dry friction with the levels of Brown-McPhee, whose peak is 0.05 % below mu_s."""
    return ExactCoulomb(mu_s=peak(law), mu_d=parameters(law)["mu_d"].value)


def _flat(law: Law) -> Law:
    """Return dry friction with mu_s = mu_d."""
    mu = parameters(law)["mu_d"].value
    return ExactCoulomb(mu_s=mu, mu_d=mu)


def _falling(law: Law) -> Law:
    """Return dry friction that falls over the Stribeck velocity of bristles."""
    return with_values(ExactCoulomb(form="stribeck"), {
        name: parameters(law)[name].value for name in ("mu_s", "mu_d", "v_s", "sigma_2")
    })  # fmt: skip


def _brown(mu_s: float, mu_d: float) -> Law:
    return BrownMcPhee(mu_s=mu_s, mu_d=mu_d, v_t=1e-2)


def _lugre(kind: type[LuGre | LuGreNormalised]) -> Law:
    return kind(mu_s=0.15, mu_d=0.1, v_s=1e-2, sigma_0=1e3, sigma_1=10.0, sigma_2=0.0)


CASES = (
    LawCase("rabinowicz brown_mcphee", _brown(0.15, 0.1), Rabinowicz, 20.0, _coulomb, True, ("x",)),
    LawCase("rabinowicz lugre", _lugre(LuGre), Rabinowicz, 20.0, _falling, True, ("x",)),
    LawCase("pendulum_box brown_mcphee", _brown(0.15, 0.1), PendulumBox, 15.0, _coulomb),
    LawCase("pendulum_box lugre_normalised", _lugre(LuGreNormalised), PendulumBox, 15.0, _falling),
    LawCase("four_mass coulomb", Coulomb(mu_d=0.1, v_eps=1e-2), FourMass, 4.0, _flat),
    LawCase("four_mass brown_mcphee", _brown(0.12, 0.1), FourMass, 4.0),
    # with 1 rad/s at the start the crank comes to rest
    LawCase("slider_crank brown_mcphee", _brown(0.1, 0.08), partial(SliderCrank, omega=1.0), 5.0,
         _coulomb),
)  # fmt: skip


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Run every case at every width and tolerance, compiled if there is a compiler.

    With `quick`, every second width is run twice in the virtual machine.
    """
    factors = HALF_DECADES[::2] if quick else HALF_DECADES
    how = {"rounds": 2 if quick else ROUNDS, "engine": "vm" if quick else backend()}
    tasks = {case.name: partial(rows, case, factors, RTOLS, **how) for case in CASES}
    draw = curves("case", ("rtol",), "value", "error", "error of the last cycle",
                  "time per run [ms]")  # fmt: skip
    return Report((TITLE, draw)).collect(tasks, progress)


def rows(
    case: LawCase, factors: Sequence[float], rtols: Sequence[float], rounds: int, engine: str
) -> Iterator[Found]:
    """Yield the rows of a case, tolerance by tolerance, width by width."""
    knob = regularisation("bench", case.law)
    model = case.scene(case.law).model([*knob.powers])
    machine = Machine(case.name, lambda _: model, case.t_end, case.of, free=True, backend=engine)
    reference, of_what, uncertain = _reference(case, knob, machine, factors)
    cycles = replace(machine, of=last_cycle)
    cycle = _reference(case, knob, cycles, factors)[0] if case.cycle else None
    name = next(iter(knob.powers))
    yield f"{case.name}: compared with {of_what}, accurate to {uncertain:.1g}"
    for rtol in rtols:
        before = (nan, nan)
        for s in factors:
            run = _at(machine, knob, s, rtol, rounds)
            error = distance(run, reference)
            order = log(before[1] / error) / log(before[0] / s) if error > 0 < before[1] else nan
            before = s, error
            yield TITLE, {
                "case": case.name, "parameter": f"{name} [{parameters(case.law)[name].unit}]",
                "value": run.values[name], "rtol": rtol, "error": error, "order": order,
                "error of the last cycle":
                    distance(_at(cycles, knob, s, rtol), cycle) if cycle else nan,
                "steps": run.steps, "attempts": run.attempts, "time per run [ms]": 1e3 * run.time_s,
                "error of the reference": uncertain,
            }  # fmt: skip


def _at(machine: Machine, knob: Regularisation, s: float, rtol: float, rounds: int = 1) -> Sample:
    return sample(machine, knob.law, rtol, s, knob.values(s), rounds)


def _reference(
    case: LawCase, knob: Regularisation, machine: Machine, factors: Sequence[float]
) -> tuple[Sample, str, float]:
    """Return the motion with dry friction, its name, and its error."""
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
    name = next(iter(knob.powers))
    # near = C s^q (4^q - 1) where s is the finest width
    left = near / (4.0**order - 1.0) if order == order else near
    return finest, f"{name} = {finest.values[name]:.3g}", max(left, FINE)


def last_cycle(run: Trajectory) -> Array:
    """Return period [s] and amplitude [m] of the last stick-slip cycle of `x`.

    A cycle lasts from one largest elongation to the next, with the smallest elongation between
    them. The result is empty if there are fewer than two largest elongations.
    """
    falls, rises = (run.crossings("v", direction) for direction in (-1, 1))
    if falls.size < 2:
        return np.zeros(0)
    first, last = falls[-2:]
    low = rises[(rises > first) & (rises < last)][-1]
    least, most = run.at([low, last])["x"]
    return np.array([last - first, most - least])
