"""Mechanisms: run time at equal error compared with other tools, and cost of a step of chains."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from math import inf
from time import perf_counter, process_time
from typing import final

import numpy as np

from symfric.bench.contenders import MECHANISMS, Array, Contender
from symfric.bench.report import (
    Found,
    Progress,
    Report,
    Row,
    best_time,
    curves,
    ratios,
    unwarned,
)
from symfric.foundation.numeric import bound
from symfric.foundation.programs import find_compiler
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.simulate import simulate
from symfric.integrator.step.attempt import Given, State
from symfric.laws import BrownMcPhee, Law
from symfric.model import Model
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.scenes import MechanismScene, PendulumBox, SliderCrank

OURS = "symfric"
ERRORS = (1e-4, 2e-5, 1e-5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
CRANK = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
METHOD = METHODS["rodas5p"]
BOTH = ("joint", "absolute")
"""Coordinates in which mechanisms are built."""
RUNS = "Time of a run against its error"
CHAINS = "Step of a chain in the virtual machine"
SIZES = (2, 4, 8, 16, 32, 64)
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BUDGET = 120.0
"""Build time [s] of a chain above which no longer chains are measured."""


@final
@dataclass(frozen=True, eq=False)
class Case:
    """Scene and the states that are compared.

    Attributes:
        scene: machine.
        t_end: end time [s]; positions are compared at 25 equal intervals.
        watched: formulation -> compared states, the same positions in each formulation.
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


def bench(quick: bool = False, links: Sequence[int] = SIZES, progress: Progress = None) -> Report:
    """Measure all subjects in one run on one machine, so that ratios are meaningful.

    Args:
        quick: use three tolerances, joint coordinates only, and short runs.
        links: lengths of the chains.
        progress: called with the current item and the fraction done.
    """
    kinds = ("joint",) if quick else BOTH
    draw = curves("case", ("integrator",), "relative error", "time per run [ms]")
    report = Report((RUNS, draw))
    tasks: dict[str, Callable[[], Iterable[Found]]] = {
        f"{case}: {name}": partial(_runs, case, name, quick)
        for case, what in CASES.items()
        for name, (formulation, _) in MECHANISMS.items()
        if find_compiler() and formulation in what.watched and formulation in kinds
    }
    if not find_compiler():
        report.notes.append("runs: not run, no C compiler")
    make = partial(chain, law=BrownMcPhee(v_t=0.01))
    tasks |= {
        "ratios": lambda: ratios(report.tables.get(RUNS, []), OURS, ERRORS),
        "chains": partial(chains, make, links),
    }
    return report.collect(tasks, progress)


def _runs(case: str, name: str, quick: bool) -> Iterator[Found]:
    """Measure one integrator at all tolerances."""
    what, (formulation, make) = CASES[case], MECHANISMS[name]
    model = what.scene.mechanism().build(formulation=formulation)
    for rtol in TOLERANCES[2:5] if quick else TOLERANCES:
        solver = partial(make, model, what.times, what.watched[formulation], rtol)
        yield _run(case, name, rtol, solver)


def _run(case: str, name: str, setting: float, make: Callable[[], Contender]) -> Found:
    """Return time and error of one integrator at one setting, or a note if it fails.

    The error is the largest position error at 25 times, relative to the largest position. The
    compile time is 0 if one compilation is used for all tolerances.
    """
    try:
        with unwarned():
            contender = make()
            time_s, (found, count) = best_time(contender.solve, budget=0.2, clock=process_time)
    except RuntimeError as error:
        last = str(error).strip().splitlines()[-1]
        return f"{case}: {name} at {setting:g}: not run, {last.rpartition(': ')[2]}"
    exact = _exact(case)
    error = float(np.abs(found - exact).max() / np.abs(exact).max()) if found.size else inf
    return RUNS, {
        "case": case, "integrator": name, "rtol": setting, "relative error": error,
        "steps": count(), "time per run [ms]": 1e3 * time_s,
        "compile time [s]": contender.compile_s,
    }  # fmt: skip


@cache
def _exact(case: str) -> Array:
    """Return positions computed by another method at a tolerance far below those measured."""
    what = CASES[case]
    run = simulate(
        what.scene.model(), what.t_end, rtol=1e-12, t_eval=what.times, method="rodas4p"
    )  # fmt: skip
    return np.array([run[name] for name in what.watched["joint"]])


# ---- cost of a step ----


def integrator(model: Model) -> Integrator:
    """Return the adaptive integrator of a model without inputs."""
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHOD)


def chain(links: int, law: Law | None = None) -> Model:
    """Return a hanging chain of equal rods with hinges about alternating axes x and y.

    With a law, the hinges have friction from reactions.
    """
    m, length = Mechanism("chain"), 1.0
    m.frame("ground.end", z=Y)
    last = "ground"
    for i in range(links):
        body, axis = f"rod_{i + 1}", X if i % 2 else Y
        m.body(body, 1.0, (length**2 / 12, length**2 / 12, 1e-3))
        m.frame(f"{body}.top", at=(0.0, 0.0, length / 2), z=axis)
        m.frame(f"{body}.end", at=(0.0, 0.0, -length / 2), z=Y if i % 2 else X)
        friction = None if law is None else JointFriction(law, radius=0.02)
        m.joint(Revolute(f"q{i + 1}", f"{last}.end", f"{body}.top", start=0.3, friction=friction))
        last = body
    return m.build()


def chains(
    make: Callable[[int], Model], sizes: Sequence[int] = SIZES, budget: float = BUDGET
) -> Iterator[Found]:
    """Measure the step of `make(n)` for n in `sizes`, until the build time exceeds `budget` [s]."""
    rows: list[Row] = []
    for n in sizes:
        begin = perf_counter()
        made = integrator(make(n))
        build_s = perf_counter() - begin
        rows.append(
            {"links": n, "build time [s]": build_s, "instructions": made.instructions,
             "time per step [us]": 1e6 * step_time(made)}
        )  # fmt: skip
        yield CHAINS, rows[-1]
        if build_s > budget:
            break
    if len(rows) > 1:
        growth = [f"{c} {exponent(rows, c):.2f}" for c in ("instructions", "time per step [us]")]
        yield f"Growth exponents of a chain: {', '.join(growth)}"


def exponent(rows: Sequence[Row], column: str, smallest: int = 8) -> float:
    """Return the slope of log(column) over log(links), for at least `smallest` links."""
    used = [row for row in rows if float(row["links"]) >= smallest]
    used = used if len(used) > 1 else rows[-2:]
    links, values = (np.log([float(row[c]) for row in used]) for c in ("links", column))
    return float(np.polyfit(links, values, 1)[0])


def step_time(made: Integrator) -> float:
    """Return the time [s] of an attempted step from the start, in the virtual machine."""
    whole, model = made.system, made.model
    y = first_guess(whole, model, model.initial_state())
    d = np.zeros(whole.d.numel())
    y = consistent(whole, "bench", y, d)
    S = State.at(0.0, 1e-4, y)
    R = Given.of(1.0, 1e-6, 1.0, 1e-7 * whole.nominal, d)
    S_out, D = np.zeros(S.size), np.zeros(made.step.numel_out(1))
    return best_time(bound(made.step, (S, R), (S_out, D)), budget=0.1, most=1000)[0]
