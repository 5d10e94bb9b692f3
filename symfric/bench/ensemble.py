"""Benchmarks of ensembles in SIMD lanes, on threads and on a graphics processor."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from os import cpu_count
from time import perf_counter
from typing import NamedTuple, final
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from symfric.bench import table
from symfric.bench.contenders import Solve, casadi
from symfric.bench.table import best_time, interleaved
from symfric.integrator import Ensemble, simulate_many
from symfric.integrator.cuda import on_device
from symfric.integrator.cuda.device import DeviceError
from symfric.integrator.equations.initial import first_guess, first_step, smallest_step
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.many.program import program
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import built
from symfric.integrator.simulate import simulate
from symfric.integrator.step.layout import Given, State
from symfric.laws import BrownMcPhee, Law, LuGre
from symfric.model import Model
from symfric.scenes import FourBar, Pendulum, SliderCrank, rabinowicz

Array = NDArray[np.float64]
RTOL, MOST = 1e-6, 10_000_000
MEMBERS = 400


class LaneRow(NamedTuple):
    """Ensemble over a start value, on one core.

    Attributes:
        case: scene and law.
        members: number of members.
        lanes: number of members per SIMD vector.
        member_us: time per member of a whole call of `simulate_many` [us].
        alone_us: the same for the compiled loop of `simulate`, which writes no results here.
        ratio: alone_us over member_us.
        again_ms: repeated call for one member and one millisecond [ms].
        attempts: mean number of attempts per member.
        equal: fraction of members with equal attempts in both; the others differ because vector
            versions of exp, tanh, sin ... differ from libm in the last digit.
        difference: median over members of the largest difference of a state at the end, relative to
            the largest state of all members.
    """

    case: str
    members: int
    lanes: int
    member_us: float
    alone_us: float
    ratio: float
    again_ms: float
    attempts: float
    equal: float
    difference: float


@final
@dataclass(frozen=True)
class CudaRow:
    """Ensemble over a start value on a graphics processor.

    Attributes:
        case: scene and law.
        real: floating point type.
        rtol: relative tolerance of both.
        device: name of the device; "no GPU" if there is none, and nothing is measured.
        members: number of members.
        first_s: time of the first call for a few members, with compilation by NVRTC [s].
        per_second: members per second of a whole call.
        cores_per_second: the same for compiled code on all cores, on a sample of the members.
        ratio: per_second over cores_per_second.
        equal: fraction of the sample with equal attempts on both.
        difference: median over the sample of the largest difference of a state at the end, relative
            to the largest state of all members.
        why: reason why nothing was measured.
    """

    case: str
    real: str
    rtol: float
    device: str = "no GPU"
    members: int = 0
    first_s: float = 0.0
    per_second: float = 0.0
    cores_per_second: float = 0.0
    ratio: float = 0.0
    equal: float = 0.0
    difference: float = 0.0
    why: str = ""


@final
@dataclass(frozen=True, eq=False)
class LaneBenchmark(table.Report):
    """Results on one core, and on a graphics processor."""

    rows: tuple[LaneRow, ...]
    cuda: tuple[CudaRow, ...]

    def shown(self) -> Iterator[table.Table | str]:
        """Yield tables of ensembles and single runs."""
        yield table.of(
            "Processor time of an ensemble and of the same runs one by one, on one core",
            self.rows,
            {"case": "case", "lanes": "lanes",
             "time per member [us]": table.rounded("member_us", 1),
             "one by one [us]": table.rounded("alone_us", 1),
             "ratio to the ensemble": table.rounded("ratio", 2),
             "attempts per member": table.rounded("attempts")},
        )  # fmt: skip
        yield table.of(
            "Overhead of a call, and agreement of the ensemble with single runs",
            self.rows,
            {"case": "case", "members": "members",
             "repeated call, one member [ms]": table.rounded("again_ms", 2),
             "members with equal attempts": lambda r: f"{r.equal:.0%}",
             "relative difference at the end": table.shortened("difference")},
        )  # fmt: skip
        yield from on_graphics_processor(self.cuda)


def on_graphics_processor(rows: Sequence[CudaRow]) -> Iterator[table.Table | str]:
    """Yield the table of members per second, and devices or the reasons why nothing was run."""
    yield table.Table(
        "Ensembles on a graphics processor and on all cores",
        ["case", "type", "members per second", "members per second, all cores",
         "ratio to all cores", "relative difference at the end"],
        [
            [r.case, r.real, r.device, "", "", ""] if r.why else
            [r.case, r.real, round(r.per_second), round(r.cores_per_second), round(r.ratio, 1),
             table.short(r.difference)]
            for r in rows
        ],
    )  # fmt: skip
    yield from dict.fromkeys(r.why or f"{r.device}, {r.members} members" for r in rows)


Case = tuple[str, Callable[[], Model], float, int]
CASES: tuple[Case, ...] = (
    ("rabinowicz/brown_mcphee", lambda: rabinowicz(BrownMcPhee()), 20.0, 1),
    ("rabinowicz/lugre", lambda: rabinowicz(LuGre()), 20.0, 1),
    ("pendulum/brown_mcphee", lambda: Pendulum(BrownMcPhee()).model(), 5.0, 2),
    ("slider_crank/brown_mcphee", lambda: SliderCrank(BrownMcPhee()).model(), 1.0, 4),
    ("four_bar/brown_mcphee", lambda: FourBar(BrownMcPhee()).model(), 0.5, 4),
)
"""Name, model, end time [s], and divisor of the number of members; the start value of the first
velocity varies."""


def bench_ensemble(*, quick: bool = False, progress: table.Progress = None) -> LaneBenchmark:
    """Measure all cases; `quick`: two, with few members."""
    cases = CASES[:2] if quick else CASES
    rows = tuple(
        _lane_row(name, make(), end, 20 if quick else MEMBERS // fewer)
        for name, make, end, fewer in table.each(cases, progress, lambda case: case[0])
    )
    return LaneBenchmark(rows, measure_cuda(quick=quick))


def _starts(model: Model, members: int) -> tuple[str, Array]:
    """Return the first velocity of a model, and start values around its default."""
    start = dict(zip((v.name for v in model.x), model.initial_state(None, None), strict=True))
    name = next(v.name for v in model.x if v.unit in ("m/s", "rad/s"))
    return name, start[name] + np.linspace(-0.1, 0.1, members)


def _ends(model: Model, many: Ensemble) -> Array:
    """Return the final states, one row per member."""
    return np.column_stack([many[v.name][:, 0] for v in model.x])


def _difference(y: Array, x: Array) -> float:
    """Return the median over members of the largest relative difference of a state."""
    return float(np.median((np.abs(y - x) / (np.abs(x).max(axis=0) + 1e-300)).max(axis=1)))


def _lane_row(name: str, model: Model, end: float, members: int) -> LaneRow:
    state, values = _starts(model, members)

    def together(count: int = members, t_end: float = end) -> Ensemble:
        return simulate_many(
            model, t_end, x0={state: values[:count]}, rtol=RTOL, backend="compiled",
            executor="serial",
        )  # fmt: skip

    alone = _one_by_one(model, {state: values}, end)
    best = interleaved(
        {"together": together, "alone": alone, "again": lambda: together(1, 1e-3)}, rounds=4
    )
    many, (S, attempts) = together(), alone()
    y = _ends(model, many)
    return LaneRow(
        case=name,
        members=members,
        lanes=_lanes(model, end),
        member_us=1e6 * best["together"] / members,
        alone_us=1e6 * best["alone"] / members,
        ratio=best["alone"] / best["together"],
        again_ms=1e3 * best["again"],
        attempts=float(attempts.mean()),
        equal=float((attempts == many.attempts).mean()),
        difference=_difference(y, S[:, State.Y][:, : y.shape[1]]),
    )


def _lanes(model: Model, end: float) -> int:
    integrator, _ = built(model, input_data(model, None, 0.0, end), ADAPTIVE["rodas5p"])
    return int(getattr(program(integrator, True).load(), "lanes", 1))


def _one_by_one(
    model: Model, x0: dict[str, Array], end: float
) -> Callable[[], tuple[Array, Array]]:
    """Return a function that runs all members in the compiled loop; it returns states, attempts."""
    inputs = input_data(model, None, 0.0, end)
    integrator, _ = built(model, inputs, ADAPTIVE["rodas5p"])
    engine, members = integrator.compiled, next(iter(x0.values())).size
    x, p = model.initial_states(x0, {}, members)
    data = np.tile(inputs.values[:, 0], (members, 1))
    y, d = first_guess(integrator.system, model, x), np.hstack([p, data])
    if integrator.system.algebraic[0] or integrator.system.manifold is not None:
        y = np.array([integrator.start(one, given) for one, given in zip(y, d, strict=True)])
    S = np.ascontiguousarray(State.at(0.0, first_step(end), y))
    atol = 0.1 * RTOL * integrator.system.nominal
    R = np.ascontiguousarray(Given.of(end, RTOL, np.inf, atol, d))

    def run() -> tuple[Array, Array]:
        now, attempts = S.copy(), np.zeros(members)
        work = integrator.borrow()
        work.over(np.array([0.0, end]), np.zeros((0, 1)))
        work.loop.h_min = smallest_step(end)
        for m in range(members):
            work.S[:], work.R[:], stop = S[m], R[m], Stop.FULL
            while stop is Stop.FULL:
                _, made, stop = engine.march(work, MOST)
                attempts[m] += made
            now[m] = work.S
        integrator.give_back(work)
        return now, attempts

    return run


Array = NDArray[np.float64]
THREAD_END = 20.0
THREADED, SAMPLED, REPEATS = 10_000, 200, 3


class EnsembleRow(NamedTuple):
    """Ensemble over start velocities, on threads.

    Attributes:
        case: scene and law.
        rtol: relative tolerance of both integrators.
        members: number of runs.
        workers: number of threads.
        time_s: shortest wall time of the call [s].
        member_s: time per member [s].
        efficiency: time on one thread over (workers * time).
        error: median relative position error at the end, on a sample of members.
        cvodes_member_s: time per member [s] of a Python loop over cvodes, on the sample.
        cvodes_error: error of cvodes on the sample.
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
    """Measure ensembles on one thread, two, four ... and all cores."""
    members, sample = (40, 4) if quick else (THREADED, SAMPLED)
    model, velocities = rabinowicz(law), np.linspace(-0.1, 0.1, members)
    picked = np.linspace(0, members - 1, sample).astype(int)
    exact = np.array([_end(model, v) for v in velocities[picked]])
    cvodes = casadi(model, np.array([THREAD_END]), ("x",), RTOL, "cvodes", as_c=False).solve
    cvodes_s, found = best_time(
        partial(_loop, cvodes, velocities[picked]), budget=0.0 if quick else 1.0, most=REPEATS
    )
    rows: list[EnsembleRow] = []
    _on_threads(model, velocities[:1], 1)  # compiles
    for workers in _workers():
        time, result = best_time(
            partial(_on_threads, model, velocities, workers),
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
                error=_off(result["x"][picked, 0], exact),
                cvodes_member_s=cvodes_s / sample,
                cvodes_error=_off(found, exact),
                ratio=(cvodes_s / sample) / (time / members),
            )
        )
    return rows


def _workers() -> list[int]:
    cores = cpu_count() or 1
    return sorted({2**k for k in range(cores.bit_length()) if 2**k < cores} | {cores})


def _on_threads(model: Model, velocities: Array, workers: int) -> Ensemble:
    chunk = max(1, min(500, velocities.size // (4 * workers)))
    return simulate_many(
        model, THREAD_END, x0={"v": velocities}, rtol=RTOL, workers=workers, chunk=chunk
    )


def _loop(solve: Solve, velocities: Array) -> Array:
    return np.array([solve(v=float(v))[0][0, -1] for v in velocities])


def _end(model: Model, v: float) -> float:
    return simulate(model, THREAD_END, x0={"v": v}, rtol=1e-11, t_eval=[THREAD_END])["x"][0]


def _off(found: Array, exact: Array) -> float:
    return float(np.median(np.abs(found - exact)) / np.abs(exact).max())


Array = NDArray[np.float64]
ON_DEVICE, SAMPLE = 1_000_000, 2000
CUDA_CASES = tuple(
    (name, make, end, 1 if name.startswith("rabinowicz") else 10)
    for name, make, end, _ in (*CASES[:2], CASES[3])
)
TOLERANCES = {"double": 1e-6, "float": 1e-4}


def measure_cuda(*, quick: bool = False) -> tuple[CudaRow, ...]:
    """Measure all cases in both types; `quick`: one case, a hundredth of the members."""
    members, cases = ON_DEVICE // (100 if quick else 1), CUDA_CASES[:1] if quick else CUDA_CASES
    return tuple(_cuda_row(case, real, members) for case in cases for real in TOLERANCES)


def _cuda_row(case: Case, real: str, members: int) -> CudaRow:
    (name, make, end, fewer), rtol = case, TOLERANCES[real]
    try:
        device = on_device.find_device().name
    except DeviceError as error:
        return CudaRow(name, real, rtol, why=str(error))
    model, members = make(), members // fewer
    state, values = _starts(model, members)

    def run(x0: Array, backend: str) -> tuple[Ensemble, float]:
        began = perf_counter()
        with catch_warnings():
            simplefilter("ignore", UserWarning)  # the tolerance of single precision is loose
            found = simulate_many(
                model, end, x0={state: x0}, rtol=rtol, backend=backend,
                real=real if backend == "cuda" else "double",
            )  # fmt: skip
        return found, perf_counter() - began

    picked = np.unique(np.linspace(0, members - 1, SAMPLE).astype(int))
    _, first = run(values[:100], "cuda")
    many, spent = run(values, "cuda")
    run(values[:100], "compiled")
    own, on_cores = run(values[picked], "compiled")
    ours, theirs = members / spent, picked.size / on_cores
    return CudaRow(
        name, real, rtol, device, members, first, ours, theirs, ours / theirs,
        float((many.attempts[picked] == own.attempts).mean()),
        _difference(_ends(model, many)[picked], _ends(model, own)),
    )  # fmt: skip
