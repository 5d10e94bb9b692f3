"""Ready problems with friction: where bodies stick and reverse on the way, and sharply.

All minimise the integral of the squared input. `v_t` is the width of the law [m/s or rad/s]: at
1e-6 it is sharp, and the optimum is that of Coulomb's law with stiction.
"""

from functools import partial
from math import pi

import casadi as ca

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems.ready import Ready, ready
from symfric.foundation.parameters import Variable
from symfric.laws import BrownMcPhee
from symfric.model import Model
from symfric.model.contact import Contact
from symfric.multibody import (
    JointFriction,
    JointSpringDamper,
    Mechanism,
    Prismatic,
    Revolute,
)
from symfric.scenes.blocks import drive

FRICTION: list[Ready] = []
frictional = partial(ready, FRICTION, friction=True)
BEST = "best of many starts"
V_T = 1e-6
GRAVITY = 9.81
FORCE = integral(lambda s: s.force**2)


def guide(v_t: float) -> BrownMcPhee:
    """Friction of the linear guides below: 4 N sliding, 6 N at rest, 0.5 N s/m, for N = 1 N."""
    return BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, v_t=v_t, N_t=1e-3)


@frictional(
    "1 m out and back in 2 s on a guide with stiction",
    64.59984,
    1e-4,
    "closed form 40 + 0.5 / (1 - 4 tanh 0.25)",
)
def out_and_back(v_t: float = V_T) -> Problem:
    """1 kg goes 1 m out in 1 s, and back to rest in another."""
    stage = drive(guide(v_t), m=1.0, N=1.0)
    out = Phase(stage, T=1.0, start={"x": 0.0, "v": 0.0}, end={"x": 1.0}, name="out")
    back = Phase(stage, T=1.0, end={"x": 0.0, "v": 0.0}, name="back")
    return Problem(out >> back, FORCE, bounds={"force": (-20.0, 20.0)})


@frictional("swing-up with friction in the bearing", 20.979, 1e-2, BEST)
def pendulum(v_t: float = V_T) -> Problem:
    """A motor of 3 N m swings a pendulum of 1 kg and 1 m up that it cannot lift at once."""
    law = BrownMcPhee(mu_s=0.15, mu_d=0.1, v_t=v_t)
    made = Mechanism("pendulum", gravity=(0.0, 0.0, -GRAVITY))
    made.body("bob", 1.0, (1e-9, 1e-9, 1e-9))
    made.frame("ground.h", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    made.frame("bob.h", at=(0.0, 0.0, 1.0), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    bearing = JointFriction(law, radius=1.0, normal=1.0)
    made.joint(Revolute("phi", "ground.h", "bob.h", start=0.0, friction=bearing))
    torque = made.input("torque", "N m", nominal=1.0)
    made.force(JointSpringDamper("motor", "phi", actuator=torque))
    up = Phase(
        made.build(),
        T=5.0,
        start={"phi": 0.0, "phi_rate": 0.0},
        end={"phi": pi, "phi_rate": 0.0},
    )
    return Problem(up, integral(lambda s: s.torque**2), bounds={"torque": (-3.0, 3.0)})


@frictional("swing-up by a cart on a rail", 71.534, 2e-2, BEST)
def cart_pendulum(v_t: float = V_T) -> Problem:
    """A cart of 1 kg swings a pendulum of 0.3 kg and 0.5 m up, and stops 0.8 m further on."""
    law = BrownMcPhee(mu_s=2.2, mu_d=1.5, mu_v=0.1, v_t=v_t, N_t=1e-3)
    made = Mechanism("cart_pendulum", gravity=(0.0, 0.0, -GRAVITY))
    made.body("cart", 1.0, (1e-9, 1e-9, 1e-9))
    made.body("bob", 0.3, (1e-9, 1e-9, 1e-9))
    made.frame("ground.rail", z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    made.frame("cart.rail", z=(1.0, 0.0, 0.0), x=(0.0, 0.0, 1.0))
    made.frame("cart.h", z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    made.frame("bob.h", at=(0.0, 0.0, 0.5), z=(0.0, -1.0, 0.0), x=(0.0, 0.0, -1.0))
    rail = JointFriction(law, normal=1.0)
    made.joint(Prismatic("x", "ground.rail", "cart.rail", friction=rail))
    made.joint(Revolute("theta", "cart.h", "bob.h"))
    force = made.input("force", "N", nominal=10.0)
    made.force(JointSpringDamper("motor", "x", "slide", actuator=force))
    up = Phase(
        made.build(),
        T=2.0,
        start={"x": 0.0, "x_rate": 0.0, "theta": 0.0, "theta_rate": 0.0},
        end={"x": 0.8, "x_rate": 0.0, "theta": pi, "theta_rate": 0.0},
    )
    return Problem(up, FORCE, bounds={"force": (-20.0, 20.0), "x": (-2.0, 2.0)})


def _coupled(name: str, v_t: float, share: float) -> Model:
    """A motor of 0.5 kg moves a load of 1 kg on a guide through a spring of 200 N/m.

    `share` is the friction under the motor, in multiples of that under the load.
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
    return Model(
        name,
        x=(x_motor, x, v_motor, v),
        u=(force,),
        ode=ca.vertcat(
            v_motor.symbol,
            v.symbol,
            (force.symbol - spring - under_motor) / 0.5,
            (spring - load.force) / 1.0,
        ),
        contacts=contacts,
    )


def _there_and_back(model: Model) -> Problem:
    rest = {"x_motor": 0.0, "x": 0.0, "v_motor": 0.0, "v": 0.0}
    there = Phase(model, T=1.0, start=rest, end={"x": 0.3}, name="there")
    back = Phase(model, T=1.0, end=rest, name="back")
    return Problem(there >> back, FORCE, bounds={"force": (-40.0, 40.0)})


@frictional("a load on a guide, there and back through a spring", 28.480, 3e-2, BEST)
def load_through_spring(v_t: float = V_T) -> Problem:
    """A load on a guide goes 0.3 m there and back, moved through a spring."""
    return _there_and_back(_coupled("load_through_spring", v_t, 0.0))


@frictional("two coupled blocks with a contact each", 59.18, 1e-2, BEST)
def two_blocks(v_t: float = V_T) -> Problem:
    """The same with friction under the motor, too: two contacts."""
    return _there_and_back(_coupled("two_blocks", v_t, 0.5))


@frictional("a parcel slides along a tray that a torque tilts", 8.8827, 1e-2, BEST)
def parcel_on_tray(v_t: float = V_T) -> Problem:
    """A parcel slides 0.3 m along a tray that a torque tilts; its normal force follows the motion.

        m (v' - x w^2) = -m g sin(a) - F,   m (x w' + 2 v w) = N - m g cos(a),   J w' = M - x N

    with position x along the tray from its pivot, and tilt a, w = a'. Nothing in the solver was
    chosen by looking at this problem.
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
    model = Model(
        "parcel_on_tray",
        x=(x, v, tilt, w),
        u=(torque,),
        ode=ca.vertcat(v.symbol, along, w.symbol, (torque.symbol - x.symbol * N) / J),
        contacts=(sole,),
    )
    level = {"v": 0.0, "tilt": 0.0, "tilt_rate": 0.0}
    move = Phase(model, T=1.5, start={"x": 0.3, **level}, end={"x": 0.0, **level})
    bounds = {"torque": (-15.0, 15.0), "tilt": (-1.2, 1.2)}
    return Problem(move, integral(lambda s: s.torque**2), bounds=bounds)
