"""Many runs at once: time per member, scaling over the cores, beside a Python loop over cvodes."""

from dataclasses import dataclass
from functools import partial
from os import cpu_count
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.bench import peers
from symfric.bench.timing import best_time
from symfric.integrator import Ensemble, simulate_many
from symfric.integrator.simulate import simulate
from symfric.laws import Law
from symfric.model import Model
from symfric.scenes import rabinowicz

Array = NDArray[np.float64]
T_END, RTOL = 20.0, 1e-6
MEMBERS, SAMPLE, REPEATS = 10_000, 200, 3


@final
@dataclass(frozen=True)
class EnsembleRow:
    """An ensemble over start velocities, on threads.

    Attributes:
        case: scene and law.
        rtol: tolerance of both integrators.
        members: how many runs.
        workers: threads.
        time_s: shortest wall time of the call [s], of a few.
        member_s: of that, time per member [s].
        efficiency: time on one thread over (workers * time).
        error: median relative position error at the end, on a sample of members.
        cvodes_member_s: time per member [s] of a Python loop over cvodes, on the sample.
        cvodes_error: its error there.
        ratio: cvodes_member_s over member_s.
    """

    case: str
    rtol: float
    members: int
    workers: int
    time_s: float
    member_s: float
    efficiency: float
    error: float
    cvodes_member_s: float
    cvodes_error: float
    ratio: float


def measure_ensemble(case: str, law: Law, quick: bool) -> list[EnsembleRow]:
    """Rows for one thread, two, four ... and all cores."""
    members, sample = (40, 4) if quick else (MEMBERS, SAMPLE)
    model, velocities = rabinowicz(law), np.linspace(-0.1, 0.1, members)
    picked = np.linspace(0, members - 1, sample).astype(int)
    exact = np.array([_exact(model, v) for v in velocities[picked]])
    solve = peers.casadi(model, np.array([T_END]), RTOL, "cvodes", False)
    cvodes_s, found = best_time(
        partial(_loop, solve, velocities[picked]), budget=0.0 if quick else 1.0, most=REPEATS
    )
    rows: list[EnsembleRow] = []
    _run(model, velocities[:1], 1)  # compiles
    for workers in _workers():
        time, result = best_time(
            partial(_run, model, velocities, workers),
            budget=0.0 if quick else np.inf,
            most=REPEATS,
        )
        alone = rows[0].time_s if rows else time
        rows.append(
            EnsembleRow(
                case=case,
                rtol=RTOL,
                members=members,
                workers=workers,
                time_s=time,
                member_s=time / members,
                efficiency=alone / (workers * time),
                error=_error(result["x"][picked, 0], exact),
                cvodes_member_s=cvodes_s / sample,
                cvodes_error=_error(found, exact),
                ratio=(cvodes_s / sample) / (time / members),
            )
        )
    return rows


def _workers() -> list[int]:
    cores = cpu_count() or 1
    return sorted({2**k for k in range(cores.bit_length()) if 2**k < cores} | {cores})


def _run(model: Model, velocities: Array, workers: int) -> Ensemble:
    chunk = max(1, min(500, velocities.size // (4 * workers)))
    return simulate_many(
        model, T_END, x0={"v": velocities}, rtol=RTOL, workers=workers, chunk=chunk
    )


def _loop(solve: peers.Solve, velocities: Array) -> Array:
    return np.array([solve(float(v))[0][-1] for v in velocities])


def _exact(model: Model, v: float) -> float:
    return simulate(model, T_END, x0={"v": v}, rtol=1e-11, t_eval=[T_END])["x"][0]


def _error(found: Array, exact: Array) -> float:
    return float(np.median(np.abs(found - exact)) / np.abs(exact).max())
