"""Reference positions and energies, norms of constraints, drift of the energy: how accurate it is.

Source: Haug's spatial four-mass system and slider-crank; the numbers are our own solutions in
minimal coordinates (`tests/mechanics.py`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee, Law, SelfTuning, Viscous
from symfric.model.kinds import RATE
from symfric.results.trajectory import Trajectory
from symfric.scenes import FourMass, MechanismScene, SliderCrank

SMOOTH = Viscous(sigma_2=0.0)
RTOL = 1e-10
DRIFT_S = 100.0
"""Time [s] over which the energy of a frictionless mechanism is watched."""


@final
@dataclass(frozen=True)
class Fact:
    """A reference number, from own solutions in other coordinates, and ours.

    Attributes:
        digits: what the reference is good for; the difference should be below it.
    """

    case: str
    t: float
    signal: str
    value: float
    reference: float
    digits: float


@final
@dataclass(frozen=True)
class NormRow:
    """Largest norms of the constraints over a run.

    Attributes:
        phi: on positions [m].
        phi_dot: on velocities, over the largest rate.
        phi_ddot: on accelerations, over the largest acceleration.
    """

    case: str
    formulation: str
    phi: float
    phi_dot: float
    phi_ddot: float


@final
@dataclass(frozen=True)
class DriftRow:
    """Energy of a frictionless mechanism over a long time.

    Attributes:
        relative: largest change of the energy over its largest part.
    """

    case: str
    rtol: float
    t_end: float
    steps: int
    relative: float


def _tuned(mu_s: float, mu_d: float) -> Law:
    return SelfTuning.from_peak_velocity(0.01, mu_s=mu_s, mu_d=mu_d)


def _positions(*values: float) -> dict[str, float]:
    return dict(zip(("x1", "y2", "z3", "x4"), values, strict=True))


CASES: dict[str, MechanismScene] = {
    "four_mass frictionless": FourMass(SMOOTH),
    "four_mass brown_mcphee": FourMass(BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)),
    "four_mass self_tuning": FourMass(_tuned(0.12, 0.1)),
    "slider_crank frictionless": SliderCrank(SMOOTH),
    "slider_crank brown_mcphee": SliderCrank(BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)),
    "slider_crank self_tuning": SliderCrank(_tuned(0.1, 0.08)),
}
REFERENCES: Mapping[str, dict[float, tuple[dict[str, float], dict[str, float]]]] = {
    "four_mass frictionless": {
        4.0: (
            _positions(-0.54021178, 4.97073146, 4.92867414, -2.15971352) | {"energy": 387.936521},
            dict.fromkeys(("x1", "y2", "z3", "x4"), 1e-8) | {"energy": 1e-6},
        )
    },
    "four_mass brown_mcphee": {
        2.0: (_positions(0.765030, 4.941126, 4.958354, 2.484775), {}),
        4.0: (
            _positions(-0.134542, 4.998190, 4.900827, 0.212878) | {"energy": 304.733},
            {"energy": 1e-3},
        ),
    },
    "four_mass self_tuning": {
        2.0: (_positions(0.753115, 4.942956, 4.956529, 2.497415), {}),
        4.0: (
            _positions(-0.135846, 4.998154, 4.900863, 0.207150) | {"energy": 304.772},
            {"energy": 1e-3},
        ),
    },
    "slider_crank frictionless": {
        0.25: (
            {"crank_rate": 120.8896, "crank": 30.1022, "slider": 0.20990, "energy": 1488.991},
            {"crank_rate": 1e-4, "crank": 1e-4, "energy": 1e-3},
        )
    },
    "slider_crank brown_mcphee": {
        0.25: (
            {"crank_rate": 84.363452, "crank": 25.271674, "slider": 0.2235396, "energy": 741.347},
            {"crank_rate": 5e-6, "crank": 1e-6, "slider": 1e-7, "energy": 1e-3},
        )
    },
    "slider_crank self_tuning": {
        0.25: (
            {"crank_rate": 84.3534, "crank": 25.2698, "energy": 741.108},
            {"crank_rate": 1e-4, "crank": 1e-4, "energy": 1e-3},
        )
    },
}
"""Case -> time [s] -> values, and what they are good for where that is not 1e-5."""


def facts() -> list[Fact]:
    """All reference numbers beside ours at rtol 1e-10."""
    rows: list[Fact] = []
    for case, by_time in REFERENCES.items():
        times = list(by_time)
        run = simulate(CASES[case].model(), times[-1], rtol=RTOL, t_eval=times)
        for k, (t, (values, digits)) in enumerate(by_time.items()):
            rows += [
                Fact(case, t, name, float(run[name][k]), value, digits.get(name, 1e-5))
                for name, value in values.items()
            ]
    return rows


def norms(formulations: tuple[str, ...] = ("joint", "absolute")) -> list[NormRow]:
    """Constraints of both mechanisms with friction over their runs, at the default tolerance."""
    rows: list[NormRow] = []
    for case in ("four_mass brown_mcphee", "slider_crank brown_mcphee"):
        for formulation in formulations:
            model = CASES[case].mechanism().build(formulation=formulation)
            run = simulate(model, max(REFERENCES[case]))
            rates = _largest(run, [v.name for v in model.x if v.kind == RATE])
            steepest = max(float(np.abs(np.gradient(run[n], run.t)).max()) for n in rates)
            fastest = max(rates.values())
            phi, phi_dot, phi_ddot = (
                float(run[n].max())
                for n in ("constraint_position", "constraint_velocity", "constraint_acceleration")
            )
            rows.append(NormRow(case, formulation, phi, phi_dot / fastest, phi_ddot / steepest))
    return rows


def drifts(t_end: float = DRIFT_S) -> list[DriftRow]:
    """Energy of both frictionless mechanisms over `t_end` seconds."""
    rows: list[DriftRow] = []
    for case in ("four_mass frictionless", "slider_crank frictionless"):
        run = simulate(CASES[case].model(), t_end, rtol=RTOL)
        energy, kinetic = run["energy"], run["kinetic"]
        relative = float(np.abs(energy - energy[0]).max() / max(kinetic.max(), abs(energy[0])))
        rows.append(DriftRow(case, RTOL, t_end, run.statistics.steps, relative))
    return rows


def _largest(run: Trajectory, names: list[str]) -> dict[str, float]:
    return {name: float(np.abs(run[name]).max()) for name in names}
