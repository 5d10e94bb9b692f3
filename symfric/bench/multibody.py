"""Mechanisms: run time at equal error compared with others, cost of the step, counts."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from math import inf, nan
from time import process_time
from typing import Any, NamedTuple, final

import numpy as np

from symfric.bench import exudyn_peer, mechanisms, table
from symfric.bench.contenders import MECHANISMS, Array, Contender
from symfric.bench.mechanisms import SIZES, chain
from symfric.bench.table import best_time, unwarned
from symfric.foundation.programs import find_compiler
from symfric.integrator.simulate import simulate
from symfric.laws import BrownMcPhee
from symfric.scenes import MechanismScene, PendulumBox, SliderCrank

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
        """Times at which positions are compared [s]."""
        return np.linspace(0.0, self.t_end, 26)[1:]


CASES: dict[str, Case] = {
    "slider_crank": Case(
        SliderCrank(CRANK), 0.25, {"joint": ("slider",), "absolute": ("block_x",)}
    ),
    "pendulum_box": Case(PendulumBox(BrownMcPhee()), 15.0, {"joint": ("x",)}),
}


class RunRow(NamedTuple):
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


class Ratio(NamedTuple):
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
class MultibodyBenchmark(table.Report):
    """All that one run of the benchmark has measured.

    Attributes:
        runs: every integrator at every tolerance.
        compiled: what building and compiling a step takes.
        counts: unknowns, operations and nonzeros of variants of a mechanism.
        chains: the step of chains of growing length.
        facts: reference numbers and ours.
        norms: what constraints leave over.
        drifts: energy of frictionless mechanisms.
        skipped: what did not run -> why.
    """

    runs: tuple[RunRow, ...]
    compiled: tuple[mechanisms.CompileRow, ...] = ()
    counts: tuple[mechanisms.CountRow, ...] = ()
    chains: tuple[mechanisms.ChainRow, ...] = ()
    facts: tuple[mechanisms.Fact, ...] = ()
    norms: tuple[mechanisms.NormRow, ...] = ()
    drifts: tuple[mechanisms.DriftRow, ...] = ()
    skipped: dict[str, str] = field(default_factory=dict[str, str])

    def loosest(self, case: str, integrator: str, bound: float) -> RunRow | None:
        """The run with the fewest requested steps whose error is at most `bound`, if any."""
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
        ratios, exponents = table.plain(self.ratios()), self.exponents()
        return table.plain(self) | {"ratios": ratios, "chain_exponents": exponents}

    def shown(self) -> Iterator[table.Table | str]:
        """Runs, ratios, compilation, counts, chains, reference numbers, constraints, energy."""
        common: dict[str, table.Column] = {
            "integrator": "integrator", "rtol (Exudyn: number of steps)": "setting",
            "relative error": table.shortened("error"), "steps": "steps",
            "time per run [ms]": table.shortened("time_s", 1e3),
        }  # fmt: skip
        yield table.of(
            "Time of a run against its error", self.runs,
            {"case": "case", **common, "compile time [s]": table.rounded("compile_s", 2)},
        )  # fmt: skip
        for case in dict.fromkeys(r.case for r in self.runs):
            yield table.of(
                f"{case}: the loosest tolerance that keeps an error; times relative to "
                "`simulate` in joint coordinates and to its compiled loop alone",
                [r for r in self.ratios() if r.case == case],
                {"error bound": "bound", **common, "ratio to simulate": table.rounded("ratio", 1),
                 "ratio to the loop": table.rounded("loop_ratio", 1)},
            )  # fmt: skip
        yield table.of(
            "Step of symfric as machine code, compiled once for all tolerances and parameters",
            self.compiled,
            {"mechanism": "mechanism", "coordinates": "formulation",
             "build time [s]": table.shortened("build_s"), "lines of C": "lines",
             "compile time [s]": table.rounded("compile_s", 2)},
        )  # fmt: skip
        yield table.of(
            "Size of the equations of mechanisms; CasADi instructions", self.counts,
            {"mechanism": "mechanism", "variant": "variant", "coordinates": "formulation",
             "states": "states", "algebraic variables": "algebraic",
             "instructions, accelerations": "ode", "instructions, step": "step",
             "nonzeros of the Jacobian": "nonzeros"},
        )  # fmt: skip
        growth = ", ".join(f"{name} {value:.2f}" for name, value in self.exponents().items())
        yield table.of(
            "Step of a chain in the virtual machine; growth exponents: "
            f"{growth or 'from two lengths on'}",
            self.chains,
            {"links": "links", "build time [s]": table.shortened("build_s"),
             "instructions": "instructions", "time per step [us]": table.shortened("step_s", 1e6)},
        )  # fmt: skip
        yield table.of(
            "Reference values and differences from them", self.facts,
            {"case": "case", "time [s]": "t", "signal": "signal",
             "reference": lambda r: f"{r.reference:.9g}",
             "difference": lambda r: table.short(r.value - r.reference),
             "accuracy of the reference": "digits"},
        )  # fmt: skip
        yield table.of(
            "Largest norms of the constraints", self.norms,
            {"case": "case", "coordinates": "formulation", "positions [m]": table.shortened("phi"),
             "velocities, relative": table.shortened("phi_dot"),
             "accelerations, relative": table.shortened("phi_ddot")},
        )  # fmt: skip
        yield table.of(
            "Energy of frictionless mechanisms", self.drifts,
            {"case": "case", "rtol": "rtol", "end time [s]": "t_end", "steps": "steps",
             "relative change of energy": table.shortened("relative")},
        )  # fmt: skip
        yield from table.not_run(self.skipped)

    def exponents(self) -> dict[str, float]:
        """Growth of instructions and time of a step with the links, where chains were measured."""
        if len(self.chains) < 2:
            return {}
        return {
            column: mechanisms.exponent(self.chains, column)
            for column in ("instructions", "step_s")
        }

    def drawn(self) -> tuple[Any, ...]:
        """Work-precision diagram: time against error, a panel per case."""
        return "work_precision", ((r.case, r.integrator, r.error, r.time_s) for r in self.runs)


def bench_multibody(
    *,
    quick: bool = False,
    links: Sequence[int] = SIZES,
    progress: table.Progress = None,
) -> MultibodyBenchmark:
    """Measure everything in one run, so that ratios are of one machine in one state.

    Args:
        quick: three tolerances and joint coordinates only, short runs; for tests.
        links: lengths of the chains.
        progress: called with what is measured and the fraction done.
    """
    formulations = ("joint",) if quick else ("joint", "absolute")
    runs, skipped = _runs(quick, progress)
    return MultibodyBenchmark(
        runs=tuple(runs),
        compiled=tuple(mechanisms.compile_rows(formulations)),
        counts=tuple(mechanisms.counts(formulations)),
        chains=tuple(mechanisms.scaling(partial(chain, law=BrownMcPhee(v_t=0.01)), links)),
        facts=tuple(mechanisms.facts()),
        norms=tuple(mechanisms.norms(formulations)),
        drifts=tuple(mechanisms.drifts(1.0 if quick else mechanisms.DRIFT_S)),
        skipped=skipped,
    )


def _runs(quick: bool, progress: table.Progress) -> tuple[list[RunRow], dict[str, str]]:
    """All integrators on all cases."""
    rows: list[RunRow] = []
    skipped: dict[str, str] = {}
    if find_compiler() is None:
        return rows, {"runs": "no C compiler"}
    tolerances = TOLERANCES[2:5] if quick else TOLERANCES
    for case, what in CASES.items():
        formulations = [f for f in what.watched if f == "joint" or not quick]
        models = {f: what.scene.mechanism().build(formulation=f) for f in formulations}
        names = [name for name, (formulation, _) in MECHANISMS.items() if formulation in models]
        exact = _exact(what)
        for name in table.each(names, progress, f"{case}: {{}}".format):
            formulation, make = MECHANISMS[name]
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
            time_s, (found, count) = best_time(contender.solve, budget=0.2, clock=process_time)
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
        steps=count(),
        compile_s=contender.compile_s,
    )


def _exact(what: Case) -> Array:
    """Positions by another of our methods at a tolerance far below all measured ones."""
    run = simulate(
        what.scene.model(), what.t_end, rtol=1e-12, t_eval=what.times, method="rodas4p"
    )  # fmt: skip
    return np.array([run[name] for name in what.watched["joint"]])
