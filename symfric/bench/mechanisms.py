"""Size and accuracy of mechanisms: counts, compilation, chains, reference values.

Source: Haug's spatial four-mass system and slider-crank; the reference values are solutions of
symfric in minimal coordinates (`tests/mechanics.py`).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from time import perf_counter

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.bench.report import Found, Row, best_time, compile_time
from symfric.foundation.numeric import bound
from symfric.foundation.programs import find_compiler
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.engine import c_source
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.simulate import simulate
from symfric.integrator.step.attempt import Given, State
from symfric.laws import BrownMcPhee, Law, SelfTuning, Viscous
from symfric.model import Model
from symfric.model.kinds import RATE
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.scenes import DoublePendulum, FourMass, MechanismScene, SliderCrank

Array = NDArray[np.float64]
LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
ALL = ("x1", "y2", "z3", "x4")
METHOD = METHODS["rodas5p"]
BOTH = ("joint", "absolute")
"""Coordinates in which mechanisms are built."""
COUNTS = "Size of the equations of mechanisms; CasADi instructions"
COMPILED = "Step of symfric as machine code, compiled once for all tolerances and parameters"
CHAINS = "Step of a chain in the virtual machine"
FACTS = "Reference values and differences from them"
NORMS = "Largest norms of the constraints"
DRIFTS = "Energy of frictionless mechanisms"


def four_mass(joints: tuple[str, ...] = (), friction: JointFriction | None = None) -> Mechanism:
    """Return the four-mass system with friction in `joints` only, by default that of the scene."""
    m = FourMass(LAW).mechanism()
    m.joints = [
        replace(j, friction=(friction or j.friction) if j.name in joints else None)
        for j in m.joints
    ]
    return m


def turned_pendulum() -> Mechanism:
    """Return the double pendulum with its second hinge turned, which makes the motion spatial."""
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
BUILT: dict[str, Callable[[], Mechanism]] = {
    "slider_crank": lambda: SliderCrank(LAW).mechanism(),
    "four_mass": lambda: four_mass(ALL),
}


def integrator(model: Model) -> Integrator:
    """Return the adaptive integrator of a model without inputs."""
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHOD)


@cache
def count(mechanism: str, variant: str, coordinates: str) -> Row:
    """Count unknowns, CasADi instructions and nonzeros of one of `VARIANTS`."""
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
    """Count all variants."""
    yield from ((COUNTS, count(*key, c)) for c in coordinates for key in VARIANTS)


def compilation(coordinates: Iterable[str] = BOTH) -> Iterator[Found]:
    """Measure times for building and compiling a step, if there is a compiler."""
    for c in coordinates if find_compiler() else ():
        for name, mechanism in BUILT.items():
            begin = perf_counter()
            made = integrator(mechanism().build(formulation=c))
            source = c_source(made.step, METHOD.H.shape[0])
            yield COMPILED, {
                "mechanism": name, "coordinates": c, "build time [s]": perf_counter() - begin,
                "lines of C": source.count("\n"), "compile time [s]": compile_time(source),
            }  # fmt: skip


SIZES = (2, 4, 8, 16, 32, 64)
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BUDGET = 120.0
"""Build time [s] above which no longer chain is measured."""


def chain(links: int, law: Law | None = None) -> Model:
    """Return a hanging chain of equal rods with hinges about x and y in turn; friction from
    reactions.
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
    """Measure the step of `make(n)` for each n of `sizes`, until building exceeds `budget` [s]."""
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
    """Return the slope of the logarithm of a column over that of the links, from `smallest` on."""
    used = [row for row in rows if float(row["links"]) >= smallest]
    used = used if len(used) > 1 else rows[-2:]
    links, values = (np.log([float(row[c]) for row in used]) for c in ("links", column))
    return float(np.polyfit(links, values, 1)[0])


def step_time(made: Integrator) -> float:
    """Return the time [s] of an attempt from the start, in the virtual machine."""
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
"""Duration [s] of the run over which the energy of a frictionless mechanism is checked."""


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
"""Case, time [s], signals, their values, and the accuracy of each value."""


def facts() -> Iterator[Found]:
    """Compare all reference values with runs at rtol 1e-10."""
    for case, scene in FACT_CASES.items():
        own = [row[1:] for row in REFERENCES if row[0] == case]
        times = [t for t, *_ in own]
        run = simulate(scene.model(), times[-1], rtol=RTOL, t_eval=times)
        for k, (t, *columns) in enumerate(own):
            for name, value, accuracy in zip(*columns, strict=True):
                yield FACTS, {
                    "case": case, "time [s]": t, "signal": name, "reference": f"{value:.9g}",
                    "difference": float(run[name][k]) - value,
                    "accuracy of the reference": accuracy,
                }  # fmt: skip


def norms(coordinates: Iterable[str] = BOTH) -> Iterator[Found]:
    """Measure constraints of both mechanisms with friction at the default tolerance.

    Velocities are relative to the largest rate, accelerations to the largest acceleration.
    """
    for case in ("four_mass brown_mcphee", "slider_crank brown_mcphee"):
        for c in coordinates:
            model = FACT_CASES[case].mechanism().build(formulation=c)
            run = simulate(model, max(t for name, t, *_ in REFERENCES if name == case))
            rates = [run[v.name] for v in model.x if v.kind == RATE]
            fastest = max(float(np.abs(v).max()) for v in rates)
            steepest = max(float(np.abs(np.gradient(v, run.t)).max()) for v in rates)
            phi, phi_dot, phi_ddot = (
                float(run[f"constraint_{level}"].max())
                for level in ("position", "velocity", "acceleration")
            )
            yield NORMS, {
                "case": case, "coordinates": c, "positions [m]": phi,
                "velocities, relative": phi_dot / fastest,
                "accelerations, relative": phi_ddot / steepest,
            }  # fmt: skip


def drifts(t_end: float = DRIFT_S) -> Iterator[Found]:
    """Measure the change of energy of both frictionless mechanisms over `t_end` [s].

    It is relative to the largest kinetic energy, or to the energy at the start if that is larger.
    """
    for case in ("four_mass frictionless", "slider_crank frictionless"):
        run = simulate(FACT_CASES[case].model(), t_end, rtol=RTOL)
        energy, kinetic = run["energy"], run["kinetic"]
        relative = float(np.abs(energy - energy[0]).max() / max(kinetic.max(), abs(energy[0])))
        yield DRIFTS, {
            "case": case, "rtol": RTOL, "end time [s]": t_end, "steps": run.statistics.steps,
            "relative change of energy": relative,
        }  # fmt: skip
