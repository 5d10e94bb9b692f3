"""Problems with all that a transcription has to know, small enough to differentiate as a whole."""

import casadi as ca

from ocp.formulation.expressions import TIME, at_end, integral, worst
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from symfric import BrownMcPhee, Model, Output, Variable, drive
from symfric.multibody import JointSpringDamper, Mechanism, Revolute
from symfric.multibody.constraints import Constraint
from symfric.scenes import FourBar

EFFORT = integral(lambda s: s.force**2)
DRY = BrownMcPhee(mu_s=0.2, mu_d=0.15, v_t=0.02)


def stage() -> Model:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=0.3, mu_v=0.5, N_t=1e-3)
    return drive(law, m=1.0, N=1.0, free=["m"])


def dae() -> Model:
    """Time in its equations, an algebraic variable, an output, other nominal values than 1."""
    x, z, u = Variable("x", "m", nominal=2.0), Variable("z", "N", nominal=3.0), Variable("u", "N")
    t = ca.SX.sym("t")
    return Model(
        "dae",
        x=(x,),
        z=(z,),
        u=(u,),
        ode=z.symbol**3 + t * x.symbol,
        alg=z.symbol + x.symbol**2 - u.symbol,
        outputs={"y": Output(x.symbol * z.symbol, "W")},
        t=t,
    )


def double_pendulum(*constraints: Constraint) -> Model:
    M = Mechanism("arm", gravity=(0.0, 0.0, -9.81))
    turned = {"z": (0.0, -1.0, 0.0), "x": (0.0, 0.0, -1.0)}
    for name in ("upper", "lower"):
        M.body(name, 1.0, (0.1, 0.1, 0.1))
        M.frame(f"{name}.top", at=(0.0, 0.0, 0.5), **turned)
        M.frame(f"{name}.end", at=(0.0, 0.0, -0.5), **turned)
    M.frame("ground.top", **turned)
    M.joint(Revolute("q1", "ground.top", "upper.top"))
    M.joint(Revolute("q2", "upper.end", "lower.top"))
    for constraint in constraints:
        M.constraint(constraint)
    for i in (1, 2):
        tau = M.input(f"tau{i}", "N m", nominal=3.0)
        M.force(JointSpringDamper(f"motor{i}", f"q{i}", actuator=tau))
    return M.build()


def one_phase() -> Problem:
    return Problem(Phase(stage(), 1.0, end={"x": 1.0}), EFFORT)


def free_time() -> Problem:
    phase = Phase(stage(), Free(0.5, 2.0), end={"x": 1.0}, via={0.5: {"power": (0.0, 5.0)}})
    return Problem(phase, EFFORT + TIME, bounds={"power": (0, 9)})


def all_at_once() -> Problem:
    """Two phases of free duration: z in a join, in a condition at a node and in an end cost."""
    model = dae()
    first = Phase(model, Free(0.5, 2.0), end={"x": 1.0, "y": (0, 3)}, via={0.5: {"y": (0.0, 1.0)}})
    second = Phase(
        model,
        Free(0.5, 2.0),
        joins=[lambda before, after: before.z * after.z * after.x >= 1.0],
        link={"x": lambda before: -0.5 * before.x**2},
    )
    cost = integral(lambda s: s.u**2 * s.z) + at_end(lambda s: s.x**4 + s.y * s.u)
    bounds = {"y": (-1.0, None)}
    return Problem(first >> second, cost, bounds=bounds, durations=[((0, 1), 2.0)])


def mechanism() -> Problem:
    cost = integral(lambda s: s.tau1**2 + s.tau2**2 * s.q1)
    return Problem(Phase(double_pendulum(), Free(0.5, 2.0), end={"q1": 1.0}), cost)


def three_phases() -> Problem:
    """Free, fixed, free; a chosen parameter; a cost that knows the time since the start."""
    model = stage()
    phases = (
        Phase(model, Free(0.5, 2.0), end={"x": 1.0})
        >> Phase(model, 1.0, end={"x": 0.0})
        >> Phase(model, Free(0.5, 1.0))
    )
    return Problem(
        phases,
        EFFORT + at_end(lambda s: s.t**2 * s.v**2),
        choose={"m": (0.5, 2.0)},
        path=[lambda s: s.x * s.v * s.force <= 3],
    )


def largest_of_scenarios() -> Problem:
    phase = Phase(stage(), Free(0.5, 2.0), start={"x": 0.0, "v": 0.0}, end={"x": (0.9, 1.0)})
    scenarios = {"light": {"m": 1.0}, "heavy": {"m": 1.2}}
    return Problem(phase, worst(EFFORT + TIME), scenarios=scenarios, periodic=["v"])


def four_bar() -> Model:
    """A crank-rocker with a motor, at rest at the start."""
    M = FourBar(DRY, omega=0.0).mechanism()
    tau = M.input("tau", "N m", nominal=1.0)
    M.force(JointSpringDamper("motor", "theta_crank", actuator=tau))
    return M.build()


def angles(crank: float, rate: float = 0.0) -> tuple[dict[str, float], dict[str, float]]:
    """Coordinates and rates of the four-bar by its closed form."""
    beta, gamma, beta_rate, gamma_rate = FourBar(DRY, angle=crank, omega=rate).closed()
    q = {"theta_crank": crank, "theta_coupler": beta - crank, "theta_rocker": gamma}
    v = (rate, beta_rate - rate, gamma_rate)
    return q, {f"{name}_rate": x for name, x in zip(q, v, strict=True)}


def closed_loop() -> Problem:
    """All coordinates and rates named at the end, two at a via point, a link in between."""
    q, v = angles(2.0)
    via = {k: x for k, x in angles(1.6)[0].items() if k != "theta_rocker"}
    model = four_bar()
    first = Phase(model, Free(0.2, 0.5), via={0.5: via})
    second = Phase(model, 0.25, end=q | v)
    return Problem(first >> second, integral(lambda s: s.tau**2))


def mean_of_scenarios() -> Problem:
    model = stage()
    phases = Phase(model, Free(0.5, 2.0), end={"x": (0.9, 1.0)}) >> Phase(model, 1.0)
    scenarios = {"light": {"m": 1.0}, "heavy": {"m": 1.2}}
    return Problem(phases, EFFORT + TIME, scenarios=scenarios, rates={"force": (-9, 9)}, shared=[])


CASES = (
    one_phase,
    free_time,
    all_at_once,
    mechanism,
    three_phases,
    closed_loop,
    largest_of_scenarios,
    mean_of_scenarios,
)
