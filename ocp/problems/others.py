"""Problems of others with known optima, in which nothing rubs.

Each is stated with the data of its source, so that its optimum can be compared digit by digit.
"""

import casadi as ca

from ocp.formulation.bounds import Free
from ocp.formulation.expressions import TIME, at_end, integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.problems.ready import Ready, ready
from symfric.foundation.parameters import Variable
from symfric.model import Model, Output

OTHERS: list[Ready] = []
"""Brachistochrone, Bryson-Denham, Goddard's rocket, hang glider, alp rider."""


@ready(
    OTHERS,
    "a bead slides from (0, 10) to (10, 5) m in the least time",
    1.80160312,
    1e-8,
    "closed form, a cycloid; data of the example of Dymos, 1.8016 s",
)
def brachistochrone() -> Problem:
    """Fastest slide from (0, 10) to (10, 5) m along a wire of angle theta; the curve is a cycloid.

    x' = v sin theta,  y' = -v cos theta,  v' = g cos theta
    """
    x, v = Variable("x", "m", nominal=10.0), Variable("v", "m/s", nominal=10.0)
    y = Variable("y", "m", start=10.0, nominal=10.0)
    theta = Variable("theta", "rad", lower=0.0, upper=3.14)
    speed, along, g = v.symbol, theta.symbol, 9.80665
    ode = ca.vertcat(speed * ca.sin(along), -speed * ca.cos(along), g * ca.cos(along))
    bead = Model("brachistochrone", x=(x, y, v), u=(theta,), ode=ode)
    return Problem(Phase(bead, Free(0.5, 10.0), end={"x": 10.0, "y": 5.0}), TIME)


@ready(
    OTHERS,
    "a cart turns round before a wall with the least squared acceleration",
    4.0,
    0.0,
    "closed form 4 / (9 wall); Bryson and Ho, Applied Optimal Control, 1975, 3.11",
)
def bryson_denham(wall: float = 1.0 / 9.0) -> Problem:
    """A cart between walls turns round without touching, with the least squared acceleration.

    x' = v,  v' = a,  x <= wall,  (x, v) from (0, 1) to (0, -1) in 1 s; J = integral of a^2 / 2

    Args:
        wall: where it stands [m]; for wall <= 1/6 the cart slows down along it, J = 4 / (9 wall).
    """
    x, v = Variable("x", "m", nominal=wall), Variable("v", "m/s", start=1.0)
    a = Variable("a", "m/s^2", nominal=10.0)
    cart = Model("bryson_denham", x=(x, v), u=(a,), ode=ca.vertcat(v.symbol, a.symbol))
    return Problem(
        Phase(cart, 1.0, end={"x": 0.0, "v": -1.0}),
        integral(lambda s: 0.5 * s.a**2),
        bounds={"x": (None, wall)},
    )


@ready(
    OTHERS,
    "a rocket flies as high as it can",
    -1.01283692,
    1e-8,
    "1.01283 in Dolan, More and Munson, Benchmarking Optimization Software with COPS 3.0, "
    "2004, 10; further digits by 800 intervals here, 3e-9 from those by 200",
)
def goddard() -> Problem:
    """Highest flight of a rocket with 40 % fuel: full thrust, a singular arc against drag, none.

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
    return Problem(
        Phase(rocket, Free(0.05, 1.0), end={"m": 0.6}),
        -1.0 * at_end(lambda s: s.h),
        bounds={"h": (1.0, None)},
    )


@ready(
    OTHERS,
    "a hang glider flies as far as it can through a thermal",
    -1248.03,
    5e-3,
    "Dolan, More and Munson, COPS 3.0, 2004, 11; Betts, Practical Methods, 2010, 6.5",
)
def hang_glider() -> Problem:
    """Farthest flight of a hang glider through a thermal, by its lift coefficient.

    From 1000 m down to 900 m, in steady glide at both ends.
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
    ode = ca.vertcat(
        vx.symbol,
        vy.symbol,
        (-L * sink - D * vx.symbol) / mass,
        (L * vx.symbol - D * sink) / mass - g,
    )
    glider = Model("hang_glider", x=(x, y, vx, vy), u=(lift,), ode=ode)
    end = {"y": 900.0, "vx": 13.227567500, "vy": -1.2875005200}
    return Problem(
        Phase(glider, Free(50.0, 200.0), end=end),
        -1.0 * at_end(lambda s: s.x),
        bounds={"x": (0.0, None), "vx": (0.0, None)},
    )


@ready(
    OTHERS,
    "stiff and unstable states ride over four peaks",
    2030.85609,
    1e-5,
    "Betts, Practical Methods for Optimal Control and Estimation, 2010, 6.14",
)
def alp_rider() -> Problem:
    """Four stiff states, two of them unstable together, ride over four peaks that grow from below.

    |y|^2 >= 3 p(t, 3, 12) + 3 p(t, 6, 10) + 3 p(t, 10, 6) + 8 p(t, 15, 4) + 0.01,
    p(t, a, b) = exp(-b (t - a)^2);  J = integral of 100 |y|^2 + 0.01 |u|^2 over 20 s

    Errors of a simulation grow by e^40 over the ride: no control that is only held lands it.
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
    return Problem(
        Phase(rider, 20.0, end={"y1": 2.0, "y2": 3.0, "y3": 1.0, "y4": -2.0}),
        integral(
            lambda s: 100.0 * (s.y1**2 + s.y2**2 + s.y3**2 + s.y4**2) + 0.01 * (s.u1**2 + s.u2**2)
        ),
        bounds={"clearance": (0.0, None)},
    )
