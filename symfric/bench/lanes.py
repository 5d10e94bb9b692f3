"""Members of an ensemble side by side in the lanes of vectors, beside the same one by one."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.bench.cuda import CudaRow, measure_cuda
from symfric.bench.timing import interleaved
from symfric.integrator import Ensemble, simulate_many
from symfric.integrator.equations.initial import first_guess, first_step, smallest_step
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.many.program import program
from symfric.integrator.methods.tableaux import ADAPTIVE
from symfric.integrator.running.built import built
from symfric.integrator.running.engine import Stop
from symfric.integrator.step.layout import Given, State
from symfric.laws import BrownMcPhee, LuGre
from symfric.model import Model
from symfric.scenes import FourBar, Pendulum, SliderCrank, rabinowicz

Array = NDArray[np.float64]
RTOL, MOST = 1e-6, 10_000_000
MEMBERS = 400


@final
@dataclass(frozen=True)
class LaneRow:
    """An ensemble over a start value, on one core.

    Attributes:
        case: scene and law.
        members: how many.
        lanes: of them at once.
        member_us: time of a whole call of `simulate_many`, for each member [us].
        alone_us: the same for the compiled loop of `simulate`, which writes no results here.
        ratio: alone_us over member_us.
        again_ms: another call for one member over a millisecond [ms].
        attempts: mean attempts of a member.
        equal: fraction of members with the same attempts in both; the others differ since exp,
            tanh, sin ... of vectors have another last digit than those of libm.
        difference: median over members of the largest difference of a state at the end, relative to
            the largest one of all members.
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
@dataclass(frozen=True, eq=False)
class LaneBenchmark:
    """All rows of one run of the benchmark, and those on a graphics processor."""

    rows: tuple[LaneRow, ...]
    cuda: tuple[CudaRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """Rows."""
        return {
            "rows": [asdict(row) for row in self.rows],
            "cuda": [asdict(row) for row in self.cuda],
        }


Case = tuple[str, Callable[[], Model], str, float, float, int]
CASES: tuple[Case, ...] = (
    ("rabinowicz/brown_mcphee", lambda: rabinowicz(BrownMcPhee()), "v", 0.0, 20.0, 1),
    ("rabinowicz/lugre", lambda: rabinowicz(LuGre()), "v", 0.0, 20.0, 1),
    ("pendulum/brown_mcphee", lambda: Pendulum(BrownMcPhee()).model(), "", 0.0, 5.0, 2),
    ("slider_crank/brown_mcphee", lambda: SliderCrank(BrownMcPhee()).model(), "", 0.0, 1.0, 4),
    ("four_bar/brown_mcphee", lambda: FourBar(BrownMcPhee()).model(), "", 0.0, 0.5, 4),
)
"""Name, model, state whose start value varies (the first velocity by default), its middle, end [s],
and by how much there are fewer members."""


def bench_ensemble(
    *, quick: bool = False, progress: Callable[[str, float], None] | None = None
) -> LaneBenchmark:
    """Measure all cases; `quick`: two, with few members."""
    rows: list[LaneRow] = []
    cases = CASES[:2] if quick else CASES
    for k, (name, make, state, middle, end, fewer) in enumerate(cases):
        if progress is not None:
            progress(name, k / len(cases))
        members = 20 if quick else MEMBERS // fewer
        rows.append(_row(name, make(), state, middle, end, members))
    return LaneBenchmark(tuple(rows), measure_cuda(quick=quick))


def _row(name: str, model: Model, state: str, middle: float, end: float, members: int) -> LaneRow:
    starts = dict(zip((v.name for v in model.x), model.initial_state(None, None), strict=True))
    state = state or next(v.name for v in model.x if v.unit in ("m/s", "rad/s"))
    x0 = {state: starts[state] + middle + np.linspace(-0.1, 0.1, members)}

    def together(count: int = members, t_end: float = end) -> Ensemble:
        return simulate_many(
            model, t_end, x0={state: x0[state][:count]}, rtol=RTOL, backend="compiled",
            executor="serial",
        )  # fmt: skip

    alone = _one_by_one(model, x0, end)
    best = interleaved(
        {"together": together, "alone": alone, "again": lambda: together(1, 1e-3)}, rounds=4
    )
    many, (S, attempts) = together(), alone()
    y = np.column_stack([many[v.name][:, 0] for v in model.x])
    own = S[:, State.Y][:, : y.shape[1]]
    off = (np.abs(y - own) / (np.abs(own).max(axis=0) + 1e-300)).max(axis=1)
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
        difference=float(np.median(off)),
    )


def _lanes(model: Model, end: float) -> int:
    integrator, _ = built(model, input_data(model, None, 0.0, end), ADAPTIVE["rodas5p"])
    return int(getattr(program(integrator, True).load(), "lanes", 1))


def _one_by_one(
    model: Model, x0: dict[str, Array], end: float
) -> Callable[[], tuple[Array, Array]]:
    """Runs all members in the compiled loop of `simulate`; start columns advanced, attempts."""
    inputs = input_data(model, None, 0.0, end)
    integrator, _ = built(model, inputs, ADAPTIVE["rodas5p"])
    engine, members = integrator.compiled(), next(iter(x0.values())).size
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
        for m in range(members):
            stop = Stop.FULL
            while stop is Stop.FULL:
                _, made, stop = engine.run(now[m], R[m], 64, MOST, smallest_step(end))
                attempts[m] += made
        return now, attempts

    return run
