"""Models with closed forms whose derivatives the tests know."""

import casadi as ca

from symfric import Model, Output, Variable
from symfric.model.parts import Holonomic


def oscillator() -> Model:
    """x'' = -k x - c x' + u."""
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s", start=0.5)
    k, c = Variable("k", "1/s^2", start=4.0), Variable("c", "1/s", start=0.3)
    u = Variable("u", "m/s^2", start=0.0)
    force = u.symbol - k.symbol * x.symbol - c.symbol * v.symbol
    energy = Output(k.symbol * x.symbol**2 / 2 + v.symbol**2 / 2, "J")
    return Model(
        "oscillator",
        x=(x, v),
        u=(u,),
        p=(k, c),
        ode=ca.vertcat(v.symbol, force),
        outputs={"energy": energy},
    )


def root() -> Model:
    """x' = -z, z^3 = p x: x = (1 - 2/3 p^(1/3) t)^(3/2) from x = 1."""
    x, z = Variable("x", "m", start=1.0), Variable("z", "m/s", start=0.5)
    p = Variable("p", "m^2/s^3", start=0.7)
    return Model(
        "root", x=(x,), z=(z,), p=(p,), ode=-z.symbol, alg=z.symbol**3 - p.symbol * x.symbol
    )


def followed() -> Model:
    """x' = z with z + z^3 = u - x: an algebraic unknown that follows what is held."""
    x, z, u = Variable("x", "m"), Variable("z", "1"), Variable("u", "N")
    alg = z.symbol + z.symbol**3 - u.symbol + x.symbol
    return Model("followed", x=(x,), z=(z,), u=(u,), ode=z.symbol, alg=alg)


def switched() -> Model:
    """x' = -z with z = p u x: x = exp(-p int u), z jumps with u."""
    x, z = Variable("x", "m", start=1.0), Variable("z", "m/s", start=0.0)
    p, u = Variable("p", "1", start=0.8), Variable("u", "1/s", start=0.0)
    return Model(
        "switched",
        x=(x,),
        z=(z,),
        p=(p,),
        u=(u,),
        ode=-z.symbol,
        alg=z.symbol - p.symbol * u.symbol * x.symbol,
    )


def pendulum() -> Model:
    """A point of mass 1 on a circle of radius l about the origin, in Cartesian coordinates."""
    x, y = Variable("x", "m", start=0.6), Variable("y", "m", start=-0.8)
    vx, vy = Variable("vx", "m/s"), Variable("vy", "m/s")
    lam, radius = Variable("lam", "1/s^2"), Variable("l", "m", start=1.0)
    a = ca.SX.sym("a", 2)
    q, v = ca.vertcat(x.symbol, y.symbol), ca.vertcat(vx.symbol, vy.symbol)
    weight = ca.vertcat(0.0, -9.81)

    def closed(acceleration: ca.SX) -> ca.SX:
        return ca.dot(q, acceleration) + ca.sumsqr(v)

    free = weight - q * lam.symbol
    return Model(
        "pendulum",
        x=(x, y, vx, vy),
        z=(lam,),
        p=(radius,),
        holonomic=Holonomic(
            2, (ca.sumsqr(q) - radius.symbol**2) / 2, a, ca.vertcat(a - free, closed(a))
        ),
    )
