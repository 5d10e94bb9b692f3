"""Predefined problems, each with its best known optimum and the source of this value.

In problems with friction, bodies stick and reverse during the motion, and the cost is the integral
of the squared input. Their `v_t` is the smoothing width of the law [m/s or rad/s]; at 1e-6 the
optimum is that of Coulomb's law with stiction. Problems of other authors, which have no friction,
use the data of their sources, so that optima can be compared digit by digit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import TypeVar, final

import casadi as ca

from ocp.formulation.expressions import TIME, at_end, integral
from ocp.formulation.phase import Free, Phase
from ocp.formulation.problem import Problem
from symfric.foundation.parameters import Variable
from symfric.laws import BrownMcPhee
from symfric.model import Model, Output
from symfric.model.contact import Contact
from symfric.multibody import JointFriction, JointSpringDamper, Mechanism, Prismatic, Revolute
from symfric.scenes.blocks import drive


@final
@dataclass(frozen=True, eq=False)
class Ready:
    """Predefined problem that `symfric ocp NAME` solves and `symfric bench starts` measures.

    Attributes:
        make: function that returns the problem; its keyword arguments are numbers such as v_t.
        optimum: best known cost J, in the unit of the problem's cost; NaN where none is known.
        uncertain: relative uncertainty of the optimum.
        source: closed form, publication, or method.
        friction: True if the problem has contacts.
    """

    make: Callable[..., Problem]
    optimum: float
    uncertain: float
    source: str
    friction: bool = False

    @property
    def name(self) -> str:
        """Name on the command line."""
        return self.make.__name__

    @property
    def title(self) -> str:
        """Motion and goal in one line."""
        return (self.make.__doc__ or "").partition("\n")[0].rstrip(".")


READY: dict[str, Ready] = {}
"""Name -> problem."""
Make = TypeVar("Make", bound=Callable[..., Problem])


def ready(
    optimum: float, uncertain: float, source: str, friction: bool = False
) -> Callable[[Make], Make]:
    """Add the decorated function to `READY`."""

    def add(make: Make) -> Make:
        READY[make.__name__] = Ready(make, optimum, uncertain, source, friction)
        return make

    return add


frictional = partial(ready, friction=True)
BEST = "best of many starts"
V_T = 1e-6
GRAVITY = 9.81
FORCE = integral(lambda s: s.force**2)


def guide(v_t: float) -> BrownMcPhee:
    """Return the friction of the linear guides: 4 N sliding, 6 N static, 0.5 N s/m, N = 1 N."""
    return BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, v_t=v_t, N_t=1e-3)


@frictional(64.59984, 1e-4, "closed form 40 + 0.5 / (1 - 4 tanh 0.25)")
def out_and_back(v_t: float = V_T) -> Problem:
    """1 m out and back in 2 s on a guide with stiction.

    The mass of 1 kg passes x = 1 m after 1 s and is back at rest after 2 s.
    """
    stage = drive(guide(v_t), m=1.0, N=1.0)
    out = Phase(stage, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0}, name="out")
    back = Phase(stage, T=1.0, end={"x": 0.0, "v": 0.0}, name="back")
    return Problem(out >> back, FORCE, bounds={"force": (-20.0, 20.0)})


@frictional(20.979, 1e-2, BEST)
def pendulum(v_t: float = V_T) -> Problem:
    """Swing-up with friction in the bearing.

    A motor of at most 3 N m cannot lift the pendulum of 1 kg and 1 m directly.
    """
    law = BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=v_t)
    made = Mechanism("pendulum", gravity=(0.0, 0.0, -GRAVITY))
    made.body("bob", 1.0, (1e-9, 1e-9, 1e-9))
    made.frame("ground.h", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    made.frame("bob.h", at=(0.0, 0.0, 1.0), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    bearing = JointFriction(law, radius=1.0, normal=1.0)
    made.joint(Revolute("phi", "ground.h", "bob.h", start=0.0, friction=bearing))
    torque = made.input("torque", "N m", nominal=1.0)
    made.force(JointSpringDamper("motor", "phi", actuator=torque))
    down = {"phi": 0.0, "phi_rate": 0.0}
    up = Phase(made.build(), T=5.0, start=down, end=down | {"phi": pi})
    return Problem(up, integral(lambda s: s.torque**2), bounds={"torque": (-3.0, 3.0)})


@frictional(71.534, 2e-2, BEST)
def cart_pendulum(v_t: float = V_T) -> Problem:
    """Swing-up by a cart on a rail.

    A cart of 1 kg swings up a pendulum of 0.3 kg and 0.5 m, and stops 0.8 m from its start.
    """
    law = BrownMcPhee(mu_s=2.2, mu_d=1.5, mu_v=0.1, v_t=v_t, N_t=1e-3)
    made = Mechanism("cart_pendulum", gravity=(0.0, 0.0, -GRAVITY))
    made.body("cart", 1.0, (1e-9, 1e-9, 1e-9))
    made.body("bob", 0.3, (1e-9, 1e-9, 1e-9))
    for frame in ("ground.rail", "cart.rail"):
        made.frame(frame, z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    made.frame("cart.h", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    made.frame("bob.h", at=(0.0, 0.0, 0.5), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    rail = JointFriction(law, normal=1.0)
    made.joint(Prismatic("x", "ground.rail", "cart.rail", friction=rail))
    made.joint(Revolute("theta", "cart.h", "bob.h"))
    force = made.input("force", "N", nominal=10.0)
    made.force(JointSpringDamper("motor", "x", "slide", actuator=force))
    down = {"x": 0.0, "x_rate": 0.0, "theta": 0.0, "theta_rate": 0.0}
    up = Phase(made.build(), T=2.0, start=down, end=down | {"x": 0.8, "theta": pi})
    return Problem(up, FORCE, bounds={"force": (-20.0, 20.0), "x": (-2.0, 2.0)})


def _coupled(name: str, v_t: float, share: float) -> Model:
    """Return a motor of 0.5 kg that moves a load of 1 kg on a guide by a spring of 200 N/m.

    `share` is the ratio of the friction of the motor to that of the load.
    """
    x_motor, x = (Variable(n, "m", nominal=0.1) for n in ("x_motor", "x"))
    v_motor, v = (Variable(n, "m/s", nominal=0.1) for n in ("v_motor", "v"))
    force = Variable("force", "N", nominal=10.0)
    spring = 200.0 * (x_motor.symbol - x.symbol) + 2.0 * (v_motor.symbol - v.symbol)
    load = Contact("load", v.symbol, 1.0, guide(v_t))
    contacts = (load,)
    under_motor = ca.SX(0.0)
    if share:
        motor = Contact("motor", v_motor.symbol, share, guide(v_t))
        contacts, under_motor = (motor, load), motor.force
    motor_acc, acc = (force.symbol - spring - under_motor) / 0.5, (spring - load.force) / 1.0
    ode = ca.vertcat(v_motor.symbol, v.symbol, motor_acc, acc)
    return Model(name, x=(x_motor, x, v_motor, v), u=(force,), ode=ode, contacts=contacts)


def _there_and_back(model: Model) -> Problem:
    rest = {"x_motor": 0.0, "x": 0.0, "v_motor": 0.0, "v": 0.0}
    there = Phase(model, T=1.0, start=rest, end={"x": 0.3}, name="there")
    back = Phase(model, T=1.0, end=rest, name="back")
    return Problem(there >> back, FORCE, bounds={"force": (-40.0, 40.0)})


@frictional(28.469, 3e-2, BEST)
def load_through_spring(v_t: float = V_T) -> Problem:
    """A load on a guide, moved there and back by a spring."""
    return _there_and_back(_coupled("load_through_spring", v_t, 0.0))


@frictional(58.744, 1e-2, BEST)
def two_blocks(v_t: float = V_T) -> Problem:
    """Two coupled blocks with a contact each.

    The problem is `load_through_spring` with friction of the motor in addition.
    """
    return _there_and_back(_coupled("two_blocks", v_t, 0.5))


@frictional(8.8827, 1e-2, BEST)
def parcel_on_tray(v_t: float = V_T) -> Problem:
    """A parcel slides along a tray that a torque tilts.

        m (v' - x w^2) = -m g sin(a) - F,   m (x w' + 2 v w) = N - m g cos(a),   J w' = M - x N

    with position x along the tray from its pivot, tilt a and w = a'. The normal force N depends on
    the motion. The solver was not tuned on this problem.
    """
    m, J = 1.0, 0.5
    x = Variable("x", "m", start=0.3, nominal=0.3)
    v = Variable("v", "m/s", nominal=0.5)
    tilt = Variable("tilt", "rad", nominal=0.5)
    w = Variable("tilt_rate", "rad/s", nominal=1.0)
    torque = Variable("torque", "N m", nominal=3.0)
    coriolis = 2.0 * v.symbol * w.symbol + GRAVITY * ca.cos(tilt.symbol)
    N = m * (x.symbol * torque.symbol / J + coriolis) / (1.0 + m * x.symbol**2 / J)
    law = BrownMcPhee(mu_s=0.4, mu_d=0.3, v_t=v_t)
    sole = Contact("sole", v.symbol, N, law)
    along = x.symbol * w.symbol**2 - GRAVITY * ca.sin(tilt.symbol) - sole.force / m
    ode = ca.vertcat(v.symbol, along, w.symbol, (torque.symbol - x.symbol * N) / J)
    model = Model("parcel_on_tray", x=(x, v, tilt, w), u=(torque,), ode=ode, contacts=(sole,))
    level = {"v": 0.0, "tilt": 0.0, "tilt_rate": 0.0}
    move = Phase(model, T=1.5, start={"x": 0.3, **level}, end={"x": 0.0, **level})
    bounds = {"torque": (-15.0, 15.0), "tilt": (-1.2, 1.2)}
    return Problem(move, integral(lambda s: s.torque**2), bounds=bounds)


@ready(1.80160312, 1e-8, "closed form, a cycloid; data of the example of Dymos, 1.8016 s")
def brachistochrone() -> Problem:
    """A bead slides from (0, 10) to (10, 5) m in the least time.

    The angle theta of the wire is the input; the curve is a cycloid.

    x' = v sin theta,  y' = -v cos theta,  v' = g cos theta
    """
    x, v = Variable("x", "m", nominal=10.0), Variable("v", "m/s", nominal=10.0)
    y = Variable("y", "m", start=10.0, nominal=10.0)
    theta = Variable("theta", "rad", lower=0.0, upper=3.14)
    speed, along, g = v.symbol, theta.symbol, 9.80665
    ode = ca.vertcat(speed * ca.sin(along), -speed * ca.cos(along), g * ca.cos(along))
    bead = Model("brachistochrone", x=(x, y, v), u=(theta,), ode=ode)
    return Problem(Phase(bead, Free(0.5, 10.0), end={"x": 10.0, "y": 5.0}), TIME)


@ready(4.0, 0.0, "closed form 4 / (9 wall); Bryson and Ho, Applied Optimal Control, 1975, 3.11")
def bryson_denham(wall: float = 1.0 / 9.0) -> Problem:
    """A cart turns round before a wall with the least squared acceleration.

    x' = v,  v' = a,  x <= wall,  (x, v) from (0, 1) to (0, -1) in 1 s; J = integral of a^2 / 2

    Args:
        wall: position of the wall [m]; for wall <= 1/6 the bound on x is active, J = 4 / (9 wall).
    """
    x, v = Variable("x", "m", nominal=wall), Variable("v", "m/s", start=1.0)
    a = Variable("a", "m/s^2", nominal=10.0)
    cart = Model("bryson_denham", x=(x, v), u=(a,), ode=ca.vertcat(v.symbol, a.symbol))
    turn = Phase(cart, 1.0, end={"x": 0.0, "v": -1.0})
    return Problem(turn, integral(lambda s: 0.5 * s.a**2), bounds={"x": (None, wall)})


@ready(
    -1.01283692,
    1e-8,
    "1.01283 in Dolan, More and Munson, Benchmarking Optimization Software with COPS 3.0, "
    "2004, 10; further digits by 800 intervals here, 3e-9 from those by 200",
)
def goddard() -> Problem:
    """A rocket flies as high as it can.

    The rocket holds 40 % fuel. Its thrust is full, then singular against drag, then zero:

    h' = v,  v' = (thrust - D) / m - 1 / h^2,  m' = -thrust / c,  D = 310 v^2 exp(500 (1 - h))

    in units of the radius of the planet, its gravity and the mass at the start.
    """
    h, v = Variable("h", "1", start=1.0), Variable("v", "1", lower=0.0, nominal=0.1)
    m = Variable("m", "1", start=1.0, lower=0.6, upper=1.0)
    thrust = Variable("thrust", "1", lower=0.0, upper=3.5)
    drag = 310.0 * v.symbol**2 * ca.exp(500.0 * (1.0 - h.symbol))
    rise = (thrust.symbol - drag) / m.symbol - 1.0 / h.symbol**2
    ode = ca.vertcat(v.symbol, rise, -thrust.symbol / 0.5)
    rocket = Model("goddard", x=(h, v, m), u=(thrust,), ode=ode)
    flight = Phase(rocket, Free(0.05, 1.0), end={"m": 0.6})
    return Problem(flight, -1.0 * at_end(lambda s: s.h), bounds={"h": (1.0, None)})


@ready(
    -1248.03,
    5e-3,
    "Dolan, More and Munson, COPS 3.0, 2004, 11; Betts, Practical Methods, 2010, 6.5",
)
def hang_glider() -> Problem:
    """A hang glider flies as far as it can through a thermal.

    The lift coefficient is the input. The glider descends from 1000 m to 900 m and is in a steady
    glide at both ends.
    """
    x, y = Variable("x", "m", nominal=1000.0), Variable("y", "m", start=1000.0, nominal=1000.0)
    vx = Variable("vx", "m/s", start=13.227567500, nominal=10.0)
    vy = Variable("vy", "m/s", start=-1.2875005200)
    lift = Variable("c_L", "1", lower=0.0, upper=1.4)
    mass, area, density, g = 100.0, 14.0, 1.13, 9.80665
    r = (x.symbol / 100.0 - 2.5) ** 2
    sink = vy.symbol - 2.5 * (1.0 - r) * ca.exp(-r)  # against the air of the thermal
    speed = ca.sqrt(vx.symbol**2 + sink**2)
    L = 0.5 * lift.symbol * density * area * speed
    D = 0.5 * (0.034 + 0.069662 * lift.symbol**2) * density * area * speed
    along, up = (-L * sink - D * vx.symbol) / mass, (L * vx.symbol - D * sink) / mass - g
    ode = ca.vertcat(vx.symbol, vy.symbol, along, up)
    glider = Model("hang_glider", x=(x, y, vx, vy), u=(lift,), ode=ode)
    end = {"y": 900.0, "vx": 13.227567500, "vy": -1.2875005200}
    flight, bounds = (
        Phase(glider, Free(50.0, 200.0), end=end),
        {"x": (0.0, None), "vx": (0.0, None)},
    )
    return Problem(flight, -1.0 * at_end(lambda s: s.x), bounds=bounds)


@ready(2030.85609, 1e-5, "Betts, Practical Methods for Optimal Control and Estimation, 2010, 6.14")
def alp_rider() -> Problem:
    """Stiff and unstable states ride over four peaks.

    Two of the four states are unstable together; the peaks are lower bounds of |y|^2:

    |y|^2 >= 3 p(t, 3, 12) + 3 p(t, 6, 10) + 3 p(t, 10, 6) + 8 p(t, 15, 4) + 0.01,
    p(t, a, b) = exp(-b (t - a)^2);  J = integral of 100 |y|^2 + 0.01 |u|^2 over 20 s

    The inputs are linear on intervals. Errors of a simulation grow by e^40 over 20 s, so an
    open-loop simulation misses the end.
    """
    starts = (2.0, 1.0, 2.0, 1.0)
    y = [Variable(f"y{i + 1}", "1", start=start) for i, start in enumerate(starts)]
    u = [Variable(f"u{i + 1}", "1", nominal=10.0) for i in range(2)]
    t = ca.SX.sym("t")
    a, b, c, d = (v.symbol for v in y)
    e, f = (v.symbol for v in u)
    ode = ca.vertcat(
        -10.0 * a + e + f,
        -2.0 * b + e + 2.0 * f,
        -3.0 * c + 5.0 * d + e - f,
        5.0 * c - 3.0 * d + e + 3.0 * f,
    )
    peaks = ((3.0, 3.0, 12.0), (3.0, 6.0, 10.0), (3.0, 10.0, 6.0), (8.0, 15.0, 4.0))
    alps = sum(height * ca.exp(-width * (t - at) ** 2) for height, at, width in peaks) + 0.01
    square = a**2 + b**2 + c**2 + d**2
    outputs = {"clearance": Output(square - alps, "1")}
    rider = Model("alp_rider", x=tuple(y), u=tuple(u), t=t, ode=ode, outputs=outputs)
    end = {"y1": 2.0, "y2": 3.0, "y3": 1.0, "y4": -2.0}
    ride = Phase(rider, 20.0, end=end, inputs={"u1": "linear", "u2": "linear"})
    cost = integral(
        lambda s: 100.0 * (s.y1**2 + s.y2**2 + s.y3**2 + s.y4**2) + 0.01 * (s.u1**2 + s.u2**2)
    )
    return Problem(ride, cost, bounds={"clearance": (0.0, None)})
