"""A model with everything that units have to carry: input, algebraic variable, events, an end."""

import casadi as ca

from symfric.foundation.parameters import Variable
from symfric.model import Event, Model, Output


def wire() -> Model:
    """A falling bead on a bent wire: x'' by an algebraic equation, an input, a floor, an end."""
    x, v, z = Variable("x", "m", 1.0), Variable("v", "m/s"), Variable("z", "N", 0.5)
    f = Variable("f", "N", nominal=2.0, doc="push")
    k = Variable("k", "N/m", 3.0, lower=0.0, upper=50.0)
    ends = Event("end", x.symbol - 4.0, direction=1, terminal=True)
    bounce = Event("floor", x.symbol, direction=-1, reset={"v": -0.5 * v.symbol})
    return Model(
        name="wire",
        x=(x, v),
        z=(z,),
        u=(f,),
        p=(k,),
        ode=ca.vertcat(v.symbol, f.symbol - z.symbol - ca.sqrt(6.0 - x.symbol) + 2.0),
        alg=ca.atan(z.symbol) + 0.1 * z.symbol - k.symbol * x.symbol / (4.0 + f.symbol**2),
        outputs={"power": Output(v.symbol * f.symbol, "W")},
        events=(bounce, ends),
    )
