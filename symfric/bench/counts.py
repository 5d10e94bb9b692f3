"""What a mechanism needs, counted: unknowns, operations and nonzeros of variants of it."""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import final

import casadi as ca

from symfric.bench.contenders import compile_time
from symfric.foundation.compiler import find_compiler
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.running.loop import c_source
from symfric.laws import BrownMcPhee
from symfric.model import Model
from symfric.multibody import JointFriction, Mechanism, Revolute
from symfric.scenes import DoublePendulum, FourMass, SliderCrank

LAW = BrownMcPhee(mu_s=0.12, mu_d=0.1, v_t=0.01)
ALL = ("x1", "y2", "z3", "x4")
METHOD = METHODS["rodas5p"]


@final
@dataclass(frozen=True)
class CountRow:
    """What one variant of a mechanism has.

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


@final
@dataclass(frozen=True)
class CompileRow:
    """What it takes to get the step of a mechanism as machine code.

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
    """What building and compiling a step takes; empty without a compiler."""
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
