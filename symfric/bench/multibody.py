"""Mechanisms: run time at equal error compared with other tools, and size and cost of a step."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from math import inf
from time import perf_counter, process_time
from typing import final

import casadi as ca
import numpy as np

from symfric import BrownMcPhee, Law, Model, Viscous, simulate
from symfric.bench.contenders import MECHANISMS, Array, Contender
from symfric.bench.report import Found, Progress, Report, Row, best_time, curves, ratios, unwarned
from symfric.foundation.numeric import bound
from symfric.foundation.programs import find_compiler
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.attempt import RRow, SRow
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.scenes import DoublePendulum, FourMass, MechanismScene, PendulumBox, SliderCrank

OURS = "symfric"
ERRORS = (1e-4, 2e-5, 1e-5)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
CRANK = BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
ALL = ("x1", "y2", "z3", "x4")
METHOD = METHODS["rodas5p"]
BOTH = ("joint", "absolute")
"""Coordinates in which mechanisms are built."""
RUNS = "Time of a run against its error"
COUNTS = "Size of the equations of mechanisms; CasADi instructions"
CHAINS = "Step of a chain in the virtual machine"
DRIFTS = "Energy of frictionless mechanisms"
SIZES = (2, 4, 8, 16, 32, 64)
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BUDGET = 120.0
"""Build time [s] of a chain above which no longer chains are measured."""


@final
@dataclass(frozen=True, eq=False)
class MechanismCase:
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


CASES: dict[str, MechanismCase] = {
    "slider_crank": MechanismCase(
        SliderCrank(CRANK), 0.25, {"joint": ("slider",), "absolute": ("block_x",)}
    ),
    "pendulum_box": MechanismCase(PendulumBox(BrownMcPhee()), 15.0, {"joint": ("x",)}),
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
        "counts": partial(counts, kinds),
        "chains": partial(chains, make, links),
        "energy": partial(drifts, 1.0 if quick else DRIFT_S),
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


# ---- size and cost of the equations ----


def four_mass(joints: tuple[str, ...] = (), friction: JointFriction | None = None) -> Mechanism:
    """Return the four-mass system with friction in `joints` only; by default the scene's law."""
    m = FourMass(LAW).mechanism()
    m.joints = [
        replace(j, friction=(friction or j.friction) if j.name in joints else None)
        for j in m.joints
    ]
    return m


def turned_pendulum() -> Mechanism:
    """Return the double pendulum with a turned second hinge, which makes the motion spatial."""
    m = DoublePendulum(LAW).mechanism()
    m.frame("upper.turned", at=(0.0, 0.0, -0.5), z=(1.0, 0.0, 0.0), x=(0.0, 0.0, -1.0))
    m.frame("lower.turned", at=(0.0, 0.0, 0.5), z=(1.0, 0.0, 0.0), x=(0.0, 0.0, -1.0))
    second = m.joints[1]
    hinge = Revolute("phi_2", "upper.turned", "lower.turned", friction=second.friction)
    m.joints = [m.joints[0], hinge]
    return m


VARIANTS: dict[tuple[str, str], Callable[[], Mechanism]] = {
    ("four_mass", "frictionless"): four_mass,
    ("four_mass", "constant normal"): lambda: four_mass(ALL, JointFriction(LAW, normal=50.0)),
    ("four_mass", "reactions in one"): lambda: four_mass(("x1",)),
    ("four_mass", "reactions in all"): lambda: four_mass(ALL),
    ("double_pendulum", "planar"): lambda: DoublePendulum(LAW).mechanism(),
    ("double_pendulum", "spatial"): turned_pendulum,
}


def integrator(model: Model) -> Integrator:
    """Return the adaptive integrator of a model without inputs."""
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHOD)


@cache
def count(mechanism: str, variant: str, coordinates: str) -> Row:
    """Return the numbers of unknowns, CasADi instructions and nonzeros of one of `VARIANTS`."""
    model = VARIANTS[mechanism, variant]().build(formulation=coordinates)
    made = integrator(model)
    return {
        "mechanism": mechanism, "variant": variant, "coordinates": coordinates,
        "states": len(model.x), "algebraic variables": len(model.z),
        "instructions, accelerations": model.function("ode").n_instructions(),
        "instructions, step": made.instructions,
        "nonzeros of the Jacobian": ca.jacobian(made.system.f, made.system.y).nnz(),
    }  # fmt: skip


def counts(coordinates: Iterable[str] = BOTH) -> Iterator[Found]:
    """Yield the rows of all variants."""
    yield from ((COUNTS, count(*key, c)) for c in coordinates for key in VARIANTS)


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


def exponent(rows: Sequence[Row], column: str) -> float:
    """Return the slope of log(column) over log(links), for at least 8 links."""
    used = [row for row in rows if float(row["links"]) >= 8]
    used = used if len(used) > 1 else rows[-2:]
    links, values = (np.log([float(row[c]) for row in used]) for c in ("links", column))
    return float(np.polyfit(links, values, 1)[0])


def step_time(made: Integrator) -> float:
    """Return the time [s] of an attempted step from the start, in the virtual machine."""
    whole, model = made.system, made.model
    y = first_guess(whole, model, model.initial_state())
    d = np.zeros(whole.d.numel())
    y = consistent(whole, "bench", y, d)
    S = SRow.at(0.0, 1e-4, y)
    R = RRow.of(1.0, 1e-6, 1.0, 1e-7 * whole.nominal, d)
    S_out, D = np.zeros(S.size), np.zeros(made.step.numel_out(1))
    return best_time(bound(made.step, (S, R), (S_out, D)), budget=0.1, most=1000)[0]


DRIFT_S = 100.0
"""Duration [s] of the run over which the energy of a frictionless mechanism is checked."""


def drifts(t_end: float = DRIFT_S) -> Iterator[Found]:
    """Measure the change of energy of frictionless mechanisms over `t_end` [s] at rtol 1e-10.

    The change is relative to the largest kinetic energy, or to the initial energy if it is larger.
    """
    for kind in (FourMass, SliderCrank):
        run = simulate(kind(Viscous(sigma_2=0.0)).model(), t_end, rtol=1e-10)
        energy, kinetic = run["energy"], run["kinetic"]
        relative = float(np.abs(energy - energy[0]).max() / max(kinetic.max(), abs(energy[0])))
        yield DRIFTS, {
            "scene": kind.__name__, "end time [s]": t_end, "steps": run.statistics.steps,
            "relative change of energy": relative,
        }  # fmt: skip
