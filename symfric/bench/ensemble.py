"""Benchmarks of ensembles in SIMD lanes and on a graphics processor."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from symfric import BrownMcPhee, Ensemble, LuGre, Model, simulate_many
from symfric.bench.report import Found, Progress, Report, best_time, interleaved, unwarned
from symfric.foundation.numeric import Array
from symfric.integrator.cuda.device import Device, DeviceError
from symfric.integrator.equations.initial import first_guess, first_step, smallest_step
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.many.members import program
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import built
from symfric.scenes import FourBar, Pendulum, SliderCrank, rabinowicz

RTOL, MOST = 1e-6, 10_000_000
MEMBERS = 400
LANES = "Processor time of an ensemble and of the same runs one by one, on one core"
CUDA = "Ensembles on a graphics processor and on all cores"


class EnsembleCase(NamedTuple):
    """Ensemble over the start value of the first velocity.

    Attributes:
        name: scene and law.
        make: function that returns the model.
        t_end: end time [s].
        fewer: divisor of the number of members.
    """

    name: str
    make: Callable[[], Model]
    t_end: float
    fewer: int


CASES = (
    EnsembleCase("rabinowicz/brown_mcphee", lambda: rabinowicz(BrownMcPhee()), 20.0, 1),
    EnsembleCase("rabinowicz/lugre", lambda: rabinowicz(LuGre()), 20.0, 1),
    EnsembleCase("pendulum/brown_mcphee", lambda: Pendulum(BrownMcPhee()).model(), 5.0, 2),
    EnsembleCase("slider_crank/brown_mcphee", lambda: SliderCrank(BrownMcPhee()).model(), 1.0, 4),
    EnsembleCase("four_bar/brown_mcphee", lambda: FourBar(BrownMcPhee()).model(), 0.5, 4),
)


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all cases; with `quick`, only two, with as many members, so that lanes are full."""
    tasks: dict[str, Callable[[], Iterator[Found]]] = {
        case.name: partial(_lanes, case, MEMBERS // case.fewer)
        for case in (CASES[:2] if quick else CASES)
    }
    return Report().collect(tasks | {"graphics processor": partial(cuda, quick)}, progress)


def _starts(model: Model, members: int) -> tuple[str, Array]:
    """Return the name of the first velocity of a model, and start values around its default."""
    start = dict(zip((v.name for v in model.x), model.initial_state(None, None), strict=True))
    name = next(v.name for v in model.x if v.unit in ("m/s", "rad/s"))
    return name, start[name] + np.linspace(-0.1, 0.1, members)


def _ends(model: Model, many: Ensemble) -> Array:
    """Return the final states, one row per member."""
    return np.column_stack([many[v.name][:, 0] for v in model.x])


def _difference(y: Array, x: Array) -> float:
    """Return the median over members of the largest relative difference of a state.

    Differences are relative to the largest value of the state over all members.
    """
    return float(np.median((np.abs(y - x) / (np.abs(x).max(axis=0) + 1e-300)).max(axis=1)))


def _lanes(case: EnsembleCase, members: int) -> Iterator[Found]:
    """Measure `simulate_many`, and the compiled loop of `simulate` without its results.

    Their attempts may differ because the vector versions of exp, tanh, sin, ... differ from libm in
    the last digit.
    """
    model, end = case.make(), case.t_end
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
    integrator, _ = built(model, input_data(model, None, 0.0, end), ADAPTIVE["rodas5p"])
    yield LANES, {
        "case": case.name, "members": members,
        "lanes": program(integrator).members.lanes,
        "time per member [us]": 1e6 * best["together"] / members,
        "one by one [us]": 1e6 * best["alone"] / members,
        "ratio to the ensemble": best["alone"] / best["together"],
        "repeated call, one member [ms]": 1e3 * best["again"],
        "attempts per member": float(attempts.mean()),
        "members with equal attempts [%]": 100.0 * float((attempts == many.attempts).mean()),
        "relative difference at the end": _difference(y, S[:, SRow.Y][:, : y.shape[1]]),
    }  # fmt: skip


def _one_by_one(
    model: Model, x0: dict[str, Array], end: float
) -> Callable[[], tuple[Array, Array]]:
    """Return a function that runs all members one by one and returns states and attempts."""
    inputs = input_data(model, None, 0.0, end)
    integrator, _ = built(model, inputs, ADAPTIVE["rodas5p"])
    engine, members = integrator.compiled, next(iter(x0.values())).size
    x, p = model.initial_states(x0, {}, members)
    data = np.tile(inputs.values[:, 0], (members, 1))
    y, d = first_guess(integrator.system, model, x), np.hstack([p, data])
    if integrator.system.algebraic[0] or integrator.system.manifold is not None:
        y = np.array([integrator.start(one, given) for one, given in zip(y, d, strict=True)])
    S = np.ascontiguousarray(SRow.at(0.0, first_step(end), y))
    atol = 0.1 * RTOL * integrator.system.nominal
    R = np.ascontiguousarray(RRow.of(end, RTOL, np.inf, atol, d))

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


# ---- on a graphics processor ----

ON_DEVICE, SAMPLE = 1_000_000, 2000
CUDA_CASES = tuple(
    case._replace(fewer=1 if case.name.startswith("rabinowicz") else 10)
    for case in (*CASES[:2], CASES[3])
)
TOLERANCES = {"double": 1e-6, "float": 1e-4}


def cuda(quick: bool = False) -> Iterator[Found]:
    """Measure all cases in both types; with `quick`, one case with a hundredth of the members.

    The compiled code runs a sample of the members on all cores.
    """
    try:
        device = Device.found().name
    except DeviceError as error:
        yield f"Graphics processor: not run, {error}"
        return
    once = partial(best_time, most=1)
    for case in CUDA_CASES[:1] if quick else CUDA_CASES:
        model, members = case.make(), ON_DEVICE // (100 if quick else 1) // case.fewer
        state, values = _starts(model, members)
        picked = np.unique(np.linspace(0, members - 1, SAMPLE).astype(int))
        for real, rtol in TOLERANCES.items():
            call = partial(simulate_many, model, case.t_end, rtol=rtol)
            gpu, cores = partial(call, backend="cuda", real=real), partial(call, backend="compiled")
            with unwarned():  # the tolerance of single precision is loose
                first, _ = once(partial(gpu, x0={state: values[:100]}))
                spent, many = once(partial(gpu, x0={state: values}))
                cores(x0={state: values[:100]})
                on_cores, own = once(partial(cores, x0={state: values[picked]}))
            ours, theirs = members / spent, picked.size / on_cores
            yield CUDA, {
                "case": case.name, "type": real, "rtol": rtol, "device": device,
                "members": members, "first call, with compilation [s]": first,
                "members per second": ours, "members per second, all cores": theirs,
                "ratio to all cores": ours / theirs,
                "members with equal attempts [%]":
                    100.0 * float((many.attempts[picked] == own.attempts).mean()),
                "relative difference at the end":
                    _difference(_ends(model, many)[picked], _ends(model, own)),
            }  # fmt: skip
