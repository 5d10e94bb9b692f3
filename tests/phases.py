"""Small problems in phases, for tests."""

from dataclasses import replace
from typing import Any

import casadi as ca
from motions import double_integrator, stage

from ocp.checking.mesh_refinement import Goals, refined_solve
from ocp.formulation.expressions import TIME, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from ocp.solving.methods import Ipopt
from ocp.solving.one_solve import Solver, Task
from ocp.solving.prepared import Supervisor
from ocp.solving.solution import Solution
from ocp.solving.starts import Start
from ocp.solving.watch import Report
from ocp.transcription.schemes import Radau, Scheme, make_meshes
from ocp.transcription.transcribe import Transcription, discretise
from symfric import BrownMcPhee, Model, Variable
from symfric.multibody import JointSpringDamper
from symfric.scenes import SliderCrank

UNIT = double_integrator()


def unit_move(**more: Any) -> Problem:
    """Unit move from rest to rest in 1 s with least integral of a^2: 12."""
    phase = {"T": 1.0, "end": {"x": 1.0, "v": 0.0}} | more
    cost = phase.pop("cost", integral(lambda s: s.a**2))
    problem = {k: phase.pop(k) for k in ("scenarios", "shared", "choose") if k in phase}
    return Problem(Phase(phase.pop("model", UNIT), **phase), cost, **problem)


def algebraic_move() -> Model:
    """x' = z with 0 = z - v, for `unit_move`."""
    x, v, z = Variable("x", "m"), Variable("v", "m/s"), Variable("z", "m/s")
    a = Variable("a", "m/s^2")
    ode, alg = ca.vertcat(z.symbol, a.symbol), z.symbol - v.symbol
    return Model("dae", x=(x, v), z=(z,), u=(a,), ode=ode, alg=alg)


def there_and_back(**more: Any) -> Problem:
    """1 m out in 1 s and back in the next one: two phases."""
    out = Phase(UNIT, 1.0, end={"x": 1.0}, name="out")
    back = Phase(UNIT, 1.0, end={"x": 0.0, "v": 0.0}, name="back")
    return Problem(out >> back, integral(lambda s: s.a**2), **more)


def fastest_move(v_t: float = 1e-3) -> Problem:
    """1 m from rest to rest with |force| <= 20 N in the shortest time, against friction."""
    phase = Phase(stage(v_t), Free(0.1, 10.0, guess=1.0), end={"x": 1.0, "v": 0.0})
    return Problem(phase, TIME, bounds={"force": (-20.0, 20.0)})


def on(problem: Problem, intervals: Any = 10, scheme: Scheme | None = None) -> Transcription:
    """Return the program of a problem on one mesh."""
    return discretise(problem, scheme or Radau()).on(make_meshes(problem, intervals))


def solve_once(
    problem: Problem,
    intervals: Any = 50,
    scheme: Scheme | None = None,
    solver: Solver | None = None,
    guess: Start = None,
    progress: Report | None = None,
) -> Solution:
    """Solve on one mesh."""
    task = Task(problem, scheme or Radau(), solver or Ipopt(), Supervisor(progress=progress))
    goals, meshes = replace(Goals.of(1e-3), passes=1), make_meshes(problem, intervals)
    return refined_solve(task, meshes, guess, goals)


SLIDER_CRANK = SliderCrank(BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02), omega=0.0)


def slider_crank(scene: SliderCrank = SLIDER_CRANK) -> Model:
    """A slider-crank with a motor, at rest at the start."""
    m = scene.mechanism()
    torque = m.input("torque", "N m", nominal=10.0)
    m.force(JointSpringDamper("motor", "crank", "turn", actuator=torque))
    return m.build()
