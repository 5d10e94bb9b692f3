"""Mechanisms: run time at equal error beside others, cost of the step, what is counted and met."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import partial
from importlib.util import find_spec
from math import inf, nan
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.bench import exudyn_peer
from symfric.bench.chains import SIZES, ChainRow, chain, exponent, scaling
from symfric.bench.contenders import MAKERS, Contender
from symfric.bench.counts import CompileRow, CountRow, compile_rows, counts
from symfric.bench.facts import DRIFT_S, DriftRow, Fact, NormRow, drifts, facts, norms
from symfric.bench.timing import best_time, unwarned
from symfric.foundation.compiler import find_compiler
from symfric.foundation.files import write_table
from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee
from symfric.scenes import MechanismScene, PendulumBox, SliderCrank

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
OURS, LOOP, EXUDYN = "symfric", "symfric loop", "exudyn"
ERRORS = (1e-4, 2e-5, 1e-5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
STEPS = (250, 500, 1000, 1250, 2500, 5000)
"""Of Exudyn, which has fixed ones."""
CRANK = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)


@final
@dataclass(frozen=True, eq=False)
class Case:
    """A scene and what is watched of it.

    Attributes:
        t_end: last time [s]; 25 equal intervals.
        watched: formulation that is measured -> states that say the same in it.
    """

    scene: MechanismScene
    t_end: float
    watched: dict[str, tuple[str, ...]]

    @property
    def times(self) -> Array:
        """Where positions are compared [s]."""
        return np.linspace(0.0, self.t_end, 26)[1:]


CASES: dict[str, Case] = {
    "slider_crank": Case(
        SliderCrank(CRANK), 0.25, {"joint": ("slider",), "absolute": ("block_x",)}
    ),
    "pendulum_box": Case(PendulumBox(BrownMcPhee()), 15.0, {"joint": ("x",)}),
}


@final
@dataclass(frozen=True)
class RunRow:
    """One integrator at one tolerance.

    Attributes:
        setting: relative tolerance, for Exudyn the number of steps.
        error: largest position error at 25 times over the largest position.
        time_s: shortest time of a call [s], once everything is built.
        compile_s: what the C compiler took for it alone [s]; 0 where one compilation serves all.
    """

    case: str
    integrator: str
    setting: float
    error: float
    time_s: float
    steps: int
    compile_s: float


@final
@dataclass(frozen=True)
class Ratio:
    """The loosest setting of an integrator that keeps an error, against ours that keeps it.

    Attributes:
        bound: the error that is kept.
        ratio: its time over that of `simulate` in joint coordinates.
        loop_ratio: its time over that of our compiled loop alone, without what Python adds.
    """

    case: str
    bound: float
    integrator: str
    setting: float
    error: float
    steps: int
    time_s: float
    ratio: float
    loop_ratio: float


@final
@dataclass(frozen=True, eq=False)
class MultibodyBenchmark:
    """All that one run of the benchmark has measured.

    Attributes:
        runs: every integrator at every tolerance.
        compiled: what building and compiling a step takes.
        counts: unknowns, operations and nonzeros of variants of a mechanism.
        chains: the step of chains of growing length.
        facts: reference numbers beside ours.
        norms: what constraints leave over.
        drifts: energy of frictionless mechanisms.
        skipped: what did not run -> why.
    """

    runs: tuple[RunRow, ...]
    compiled: tuple[CompileRow, ...] = ()
    counts: tuple[CountRow, ...] = ()
    chains: tuple[ChainRow, ...] = ()
    facts: tuple[Fact, ...] = ()
    norms: tuple[NormRow, ...] = ()
    drifts: tuple[DriftRow, ...] = ()
    skipped: dict[str, str] = field(default_factory=dict[str, str])

    def loosest(self, case: str, integrator: str, bound: float) -> RunRow | None:
        """The run with the fewest steps asked for whose error is at most `bound`, if any."""
        rows = [r for r in self.runs if (r.case, r.integrator) == (case, integrator)]
        by_steps = integrator == EXUDYN
        rows.sort(key=lambda r: r.setting if by_steps else -r.setting)
        return next((row for row in rows if row.error <= bound), None)

    def ratios(self) -> list[Ratio]:
        """Every integrator against ours, at each of the errors that both keep."""
        found: list[Ratio] = []
        for case in dict.fromkeys(r.case for r in self.runs):
            for bound in ERRORS:
                base, alone = (self.loosest(case, name, bound) for name in (OURS, LOOP))
                for name in dict.fromkeys(r.integrator for r in self.runs if r.case == case):
                    row = self.loosest(case, name, bound)
                    if row and base:
                        ratios = (row.time_s / b.time_s if b else nan for b in (base, alone))
                        found.append(
                            Ratio(case, bound, name, row.setting, row.error, row.steps,
                                  row.time_s, *ratios)
                        )  # fmt: skip
        return found

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data."""
        tables = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "skipped"}
        return {
            **{name: [asdict(row) for row in rows] for name, rows in tables.items()},
            "ratios": [asdict(row) for row in self.ratios()],
            "chain_exponents": self.exponents(),
            "skipped": self.skipped,
        }

    def exponents(self) -> dict[str, float]:
        """Growth of instructions and time of a step with the links, where chains were measured."""
        if len(self.chains) < 2:
            return {}
        return {column: exponent(self.chains, column) for column in ("instructions", "step_s")}

    def write_csv(self, path: str | Path) -> None:
        """Write the runs, a line each."""
        names = [field.name for field in fields(RunRow)]
        write_table(path, names, ([getattr(row, name) for name in names] for row in self.runs))

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Work-precision diagram: time against error, a panel per case."""
        from symfric.bench.pictures import plot_work_precision  # noqa: PLC0415

        lines: dict[str, dict[str, list[tuple[float, float]]]] = {}
        for row in self.runs:
            case = lines.setdefault(row.case, {})
            case.setdefault(row.integrator, []).append((row.error, row.time_s))
        return plot_work_precision(lines, path)


def bench_multibody(
    *,
    quick: bool = False,
    links: Sequence[int] = SIZES,
    progress: Callable[[str, float], None] | None = None,
) -> MultibodyBenchmark:
    """Measure everything in one run, so that ratios are of one machine in one state.

    Args:
        quick: three tolerances and joint coordinates only, short runs; for tests.
        links: lengths of the chains.
        progress: called with what is measured and the fraction done.
    """
    tell = progress or _say_nothing
    formulations = ("joint",) if quick else ("joint", "absolute")
    runs, skipped = _runs(quick, tell)
    tell("counts, compilation, chains", 0.6)
    return MultibodyBenchmark(
        runs=tuple(runs),
        compiled=tuple(compile_rows(formulations)),
        counts=tuple(counts(formulations)),
        chains=tuple(scaling(partial(chain, law=BrownMcPhee(v_t=0.01)), links)),
        facts=tuple(facts()),
        norms=tuple(norms(formulations)),
        drifts=tuple(drifts(1.0 if quick else DRIFT_S)),
        skipped=skipped,
    )


def _say_nothing(_: str, __: float) -> None:
    """Progress that nobody watches."""


def _runs(quick: bool, tell: Callable[[str, float], None]) -> tuple[list[RunRow], dict[str, str]]:
    """All integrators on all cases."""
    rows: list[RunRow] = []
    skipped: dict[str, str] = {}
    if find_compiler() is None:
        return rows, {"runs": "no C compiler"}
    tolerances = TOLERANCES[2:5] if quick else TOLERANCES
    for number, (case, what) in enumerate(CASES.items()):
        formulations = [f for f in what.watched if f == "joint" or not quick]
        models = {f: what.scene.mechanism().build(formulation=f) for f in formulations}
        names = [name for name, (formulation, _) in MAKERS.items() if formulation in models]
        exact = _exact(what)
        for k, name in enumerate(names):
            tell(f"{case}: {name}", 0.6 * (number + k / len(names)) / len(CASES))
            formulation, make = MAKERS[name]
            for rtol in tolerances:
                with_rtol = partial(
                    make, models[formulation], what.times, what.watched[formulation], rtol
                )
                row = _row(case, name, rtol, with_rtol, exact, skipped)
                rows += [row] if row else []
    what = CASES["slider_crank"]
    if quick:
        skipped[EXUDYN] = "takes too long for --quick"
    elif find_spec(EXUDYN) is None:
        skipped[EXUDYN] = "not installed (extra 'bench')"
    elif isinstance(what.scene, SliderCrank):
        for steps in STEPS:
            run = partial(exudyn_peer.slider_crank, what.scene, CRANK, what.times, steps)
            row = _row("slider_crank", EXUDYN, steps, run, _exact(what), skipped)
            rows += [row] if row else []
    return rows, skipped


def _row(
    case: str,
    name: str,
    setting: float,
    make: Callable[[], Contender],
    exact: Array,
    skipped: dict[str, str],
) -> RunRow | None:
    """Time and error of one integrator at one setting; None where it fails, which is noted."""
    try:
        with unwarned():
            contender = make()
            time_s, (found, steps) = best_time(contender.solve, budget=0.2, clock=process_time)
    except RuntimeError as error:
        last = str(error).strip().splitlines()[-1]
        skipped[f"{case}: {name} at {setting:g}"] = last.rpartition(": ")[2]
        return None
    error = np.abs(found - exact).max() / np.abs(exact).max() if found.size else inf
    return RunRow(
        case=case,
        integrator=name,
        setting=setting,
        error=float(error),
        time_s=time_s,
        steps=steps,
        compile_s=contender.compile_s,
    )


def _exact(what: Case) -> Array:
    """Positions by another of our methods at a tolerance far below all measured ones."""
    run = simulate(
        what.scene.model(), what.t_end, rtol=1e-12, t_eval=what.times, method="rodas4p"
    )  # fmt: skip
    return np.array([run[name] for name in what.watched["joint"]])
