"""Needs and accuracy of mechanisms: counts, compilation, chains, reference numbers.

Source: Haug's spatial four-mass system and slider-crank; the reference numbers are our own
solutions in minimal coordinates (`tests/mechanics.py`).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench.table import best_time, compile_time
from symfric.foundation.numeric import bound
from symfric.foundation.programs import find_compiler
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.engine import c_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.simulate import simulate
from symfric.integrator.step.layout import Given, State
from symfric.laws import BrownMcPhee, Law, SelfTuning, Viscous
from symfric.model import Model
from symfric.model.kinds import RATE
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.results.trajectory import Trajectory
from symfric.scenes import DoublePendulum, FourMass, MechanismScene, SliderCrank

LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
ALL = ("x1", "y2", "z3", "x4")
METHOD = METHODS["rodas5p"]


class CountRow(NamedTuple):
    """Counts of one variant of a mechanism.

    Attributes:
        states, algebraic: of the model; coordinates and rates, multipliers and normal forces.
        ode: CasADi instructions of the explicit accelerations.
        step: CasADi instructions of an adaptive step.
        nonzeros: of the derivatives of the right-hand side by the unknowns.
    """

    mechanism: str
    variant: str
    formulation: str
    states: int
    algebraic: int
    ode: int
    step: int
    nonzeros: int


class CompileRow(NamedTuple):
    """Cost of the step of a mechanism as machine code.

    Attributes:
        build_s: time [s] to write its expressions.
        lines: of generated C.
        compile_s: processor time [s] of the C compiler.
    """

    mechanism: str
    formulation: str
    build_s: float
    lines: int
    compile_s: float


def four_mass(joints: tuple[str, ...] = (), friction: JointFriction | None = None) -> Mechanism:
    """The four-mass system with friction in `joints` alone, that of the scene by default."""
    m = FourMass(LAW).mechanism()
    m.joints = [
        replace(j, friction=(friction or j.friction) if j.name in joints else None)
        for j in m.joints
    ]
    return m


def turned_pendulum() -> Mechanism:
    """The double pendulum with its second hinge turned, so that it leaves the plane."""
    m = DoublePendulum(LAW).mechanism()
    m.frame("upper.turned", at=(0.0, 0.0, -0.5), z=(1.0, 0.0, 0.0), x=(0.0, 0.0, -1.0))
    m.frame("lower.turned", at=(0.0, 0.0, 0.5), z=(1.0, 0.0, 0.0), x=(0.0, 0.0, -1.0))
    second = m.joints[1]
    hinge = Revolute("phi_2", "upper.turned", "lower.turned", friction=second.friction)
    m.joints = [m.joints[0], hinge]
    return m


VARIANTS: tuple[tuple[str, str, Mechanism], ...] = (
    ("four_mass", "frictionless", four_mass()),
    ("four_mass", "constant normal", four_mass(ALL, JointFriction(LAW, normal=50.0))),
    ("four_mass", "reactions in one", four_mass(("x1",))),
    ("four_mass", "reactions in all", four_mass(ALL)),
    ("double_pendulum", "planar", DoublePendulum(LAW).mechanism()),
    ("double_pendulum", "spatial", turned_pendulum()),
)
COMPILED: tuple[tuple[str, Mechanism], ...] = (
    ("slider_crank", SliderCrank(LAW).mechanism()),
    ("four_mass", four_mass(ALL)),
)


def integrator(model: Model) -> Integrator:
    """The adaptive integrator of a model without inputs."""
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHOD)


def count(mechanism: str, variant: str, formulation: str, of: Mechanism) -> CountRow:
    """Count one variant in "joint" or "absolute" coordinates."""
    model = of.build(formulation=formulation)
    made = integrator(model)
    whole = made.system
    return CountRow(
        mechanism=mechanism,
        variant=variant,
        formulation=formulation,
        states=len(model.x),
        algebraic=len(model.z),
        ode=model.function("ode").n_instructions(),
        step=made.instructions,
        nonzeros=ca.jacobian(whole.f, whole.y).nnz(),
    )


def counts(formulations: tuple[str, ...] = ("joint", "absolute")) -> list[CountRow]:
    """All variants in the given formulations."""
    return [count(name, variant, f, of) for f in formulations for name, variant, of in VARIANTS]


def compile_rows(formulations: tuple[str, ...] = ("joint", "absolute")) -> list[CompileRow]:
    """Times for building and compiling a step; empty without a compiler."""
    rows: list[CompileRow] = []
    for formulation in formulations if find_compiler() else ():
        for name, mechanism in COMPILED:
            begin = perf_counter()
            made = integrator(mechanism.build(formulation=formulation))
            source = c_source(made.step, METHOD.H.shape[0])
            build_s = perf_counter() - begin
            seconds = compile_time(source)
            rows.append(CompileRow(name, formulation, build_s, source.count("\n"), seconds))
    return rows


Array = NDArray[np.float64]
SIZES = (2, 4, 8, 16, 32, 64)
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BUDGET = 120.0
"""A chain that took longer to build [s] is the last one."""


class ChainRow(NamedTuple):
    """One size.

    Attributes:
        links: how many.
        build_s: time [s] from nothing to the step.
        instructions: of the step.
        step_s: time [s] of an attempt in the virtual machine.
    """

    links: int
    build_s: float
    instructions: int
    step_s: float


def chain(links: int, law: Law | None = None) -> Model:
    """A hanging chain of equal rods, its hinges about x and y by turns; friction from reactions."""
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


def scaling(
    make: Callable[[int], Model],
    sizes: Sequence[int] = SIZES,
    budget: float = BUDGET,
) -> list[ChainRow]:
    """Measure the step of `make(n)` for every n of `sizes`, until one takes longer than `budget`.

    Args:
        make: number of links -> model.
        sizes: increasing.
        budget: time for building [s].
    """
    rows: list[ChainRow] = []
    for n in sizes:
        begin = perf_counter()
        made = integrator(make(n))
        build_s = perf_counter() - begin
        rows.append(ChainRow(n, build_s, made.instructions, step_time(made)))
        if build_s > budget:
            break
    return rows


def exponent(rows: Sequence[ChainRow], column: str, smallest: int = 8) -> float:
    """Slope of the logarithm of a column over that of the links, from `smallest` links on."""
    used = [row for row in rows if row.links >= smallest]
    if len(used) < 2:
        used = list(rows[-2:])
    links = np.log([row.links for row in used])
    values = np.log([float(getattr(row, column)) for row in used])
    return float(np.polyfit(links, values, 1)[0])


def step_time(made: Integrator) -> float:
    """Time [s] of an attempt from the start, in the virtual machine."""
    whole, model = made.system, made.model
    y = first_guess(whole, model, model.initial_state())
    d = np.zeros(whole.d.numel())
    y = consistent(whole, "bench", y, d)
    S = State.at(0.0, 1e-4, y)
    R = Given.of(1.0, 1e-6, 1.0, 1e-7 * whole.nominal, d)
    S_out, D = np.zeros(S.size), np.zeros(made.step.numel_out(1))
    return best_time(bound(made.step, (S, R), (S_out, D)), budget=0.1, most=1000)[0]


SMOOTH = Viscous(sigma_2=0.0)
RTOL = 1e-10
DRIFT_S = 100.0
"""Time [s] over which the energy of a frictionless mechanism is watched."""


class Fact(NamedTuple):
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


class NormRow(NamedTuple):
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


class DriftRow(NamedTuple):
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


FACT_CASES: dict[str, MechanismScene] = {
    "four_mass frictionless": FourMass(SMOOTH),
    "four_mass brown_mcphee": FourMass(BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)),
    "four_mass self_tuning": FourMass(_tuned(0.12, 0.1)),
    "slider_crank frictionless": SliderCrank(SMOOTH),
    "slider_crank brown_mcphee": SliderCrank(BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)),
    "slider_crank self_tuning": SliderCrank(_tuned(0.1, 0.08)),
}
_FOUR = ("x1", "y2", "z3", "x4", "energy")
_CRANK = ("crank_rate", "crank", "slider", "energy")
REFERENCES: tuple[tuple[str, float, tuple[str, ...], tuple[float, ...], tuple[float, ...]], ...] = (
    ("four_mass frictionless", 4.0, _FOUR,
     (-0.54021178, 4.97073146, 4.92867414, -2.15971352, 387.936521),
     (1e-8, 1e-8, 1e-8, 1e-8, 1e-6)),
    ("four_mass brown_mcphee", 2.0, _FOUR[:4],
     (0.765030, 4.941126, 4.958354, 2.484775), (1e-5,) * 4),
    ("four_mass brown_mcphee", 4.0, _FOUR,
     (-0.134542, 4.998190, 4.900827, 0.212878, 304.733), (1e-5, 1e-5, 1e-5, 1e-5, 1e-3)),
    ("four_mass self_tuning", 2.0, _FOUR[:4],
     (0.753115, 4.942956, 4.956529, 2.497415), (1e-5,) * 4),
    ("four_mass self_tuning", 4.0, _FOUR,
     (-0.135846, 4.998154, 4.900863, 0.207150, 304.772), (1e-5, 1e-5, 1e-5, 1e-5, 1e-3)),
    ("slider_crank frictionless", 0.25, _CRANK,
     (120.8896, 30.1022, 0.20990, 1488.991), (1e-4, 1e-4, 1e-5, 1e-3)),
    ("slider_crank brown_mcphee", 0.25, _CRANK,
     (84.363452, 25.271674, 0.2235396, 741.347), (5e-6, 1e-6, 1e-7, 1e-3)),
    ("slider_crank self_tuning", 0.25, ("crank_rate", "crank", "energy"),
     (84.3534, 25.2698, 741.108), (1e-4, 1e-4, 1e-3)),
)  # fmt: skip
"""Case, time [s], signals, their values, and what these are good for."""


def facts() -> list[Fact]:
    """All reference numbers and ours at rtol 1e-10."""
    rows: list[Fact] = []
    for case in FACT_CASES:
        own = [row[1:] for row in REFERENCES if row[0] == case]
        times = [t for t, *_ in own]
        run = simulate(FACT_CASES[case].model(), times[-1], rtol=RTOL, t_eval=times)
        for k, (t, *columns) in enumerate(own):
            rows += [
                Fact(case, t, name, float(run[name][k]), value, digits)
                for name, value, digits in zip(*columns, strict=True)
            ]
    return rows


def norms(formulations: tuple[str, ...] = ("joint", "absolute")) -> list[NormRow]:
    """Constraints of both mechanisms with friction over their runs, at the default tolerance."""
    rows: list[NormRow] = []
    for case in ("four_mass brown_mcphee", "slider_crank brown_mcphee"):
        for formulation in formulations:
            model = FACT_CASES[case].mechanism().build(formulation=formulation)
            run = simulate(model, max(t for name, t, *_ in REFERENCES if name == case))
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
        run = simulate(FACT_CASES[case].model(), t_end, rtol=RTOL)
        energy, kinetic = run["energy"], run["kinetic"]
        relative = float(np.abs(energy - energy[0]).max() / max(kinetic.max(), abs(energy[0])))
        rows.append(DriftRow(case, RTOL, t_end, run.statistics.steps, relative))
    return rows


def _largest(run: Trajectory, names: list[str]) -> dict[str, float]:
    return {name: float(np.abs(run[name]).max()) for name in names}
