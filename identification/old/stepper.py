"""Fast fixed-step simulation of a drive: one implicit step, mapped over the samples.

    v1 = v0 + h a(v1, force),   x1 = x0 + h (v0 + v1)/2

A friction law that takes power out never turns the velocity round by itself, so v1 lies between 0
and the velocity v0 + h a(0, force) the mass would have without friction. Inside this bracket a
guarded Newton iteration finds it for any slope at rest: sticking needs no events and no small
steps, and for Coulomb friction without smoothing it is the exact impulse clamp.
"""

from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.model import Model

Array = NDArray[np.float64]

ITERATIONS = 8
"""Newton or bisection steps; started at the last velocity, one or two do the work."""


@final
@dataclass(frozen=True, eq=False)
class Motion:
    """A simulated motion at the sample times.

    Attributes:
        t, x, v: time [s], position [m], velocity [m/s], shape (n,).
        a: mean acceleration from each sample to the next [m/s^2].
        force: driving force held from each sample to the next [N].
    """

    t: Array
    x: Array
    v: Array
    a: Array
    force: Array


def acceleration(model: Model) -> ca.Function:
    """a(v, force) [m/s^2] of a drive without free parameters: states x, v; input force.

    Raises:
        ValueError: a model with other states, inputs or free parameters.
    """
    names = [[variable.name for variable in getattr(model, letter)] for letter in "xzup"]
    if names != [["x", "v"], [], ["force"], []] or model.ode is None:
        raise ValueError(
            f"model '{model.name}': expected states x, v, the input force and no free parameters, "
            f"got x = {names[0]}, z = {names[1]}, u = {names[2]}, p = {names[3]}"
        )
    return ca.Function("acceleration", [model.x[1].symbol, model.u[0].symbol], [model.ode[1]])


def plant(model: Model, step: float, substeps: int = 4) -> ca.Function:
    """(x, v, force) -> (x, v) after `step` [s] with constant force, in `substeps` implicit steps.

    First order in the viscous part, error h sigma_2 / (2 m substeps) relative.
    """
    h = step / substeps
    motion = acceleration(model)
    x, v, force = ca.SX.sym("x"), ca.SX.sym("v"), ca.SX.sym("force")
    new = _implicit_velocity(motion, h)(v, force)
    one = ca.Function("substep", [x, v, force], [x + h * (v + new) / 2, new])
    at: list[ca.SX] = [x, v]
    for _ in range(substeps):
        at = list(one(*at, force))
    return ca.Function("plant", [x, v, force], at, ["x", "v", "force"], ["x1", "v1"])


def _implicit_velocity(motion: ca.Function, h: float) -> ca.Function:
    """(v0, force) -> v1 with v1 = v0 + h a(v1, force), bracketed by 0 and the frictionless v."""
    v0, force, v1 = ca.SX.sym("v0"), ca.SX.sym("force"), ca.SX.sym("v1")
    gap = v1 - v0 - h * motion(v1, force)
    residual = ca.Function("residual", [v1, v0, force], [gap, ca.jacobian(gap, v1)])
    free = v0 + h * motion(0, force)
    low, high = ca.fmin(free, 0), ca.fmax(free, 0)
    guess = ca.fmin(ca.fmax(v0, low), high)
    for _ in range(ITERATIONS):
        value, slope = residual(guess, v0, force)
        low = ca.if_else(value < 0, guess, low)
        high = ca.if_else(value > 0, guess, high)
        newton = guess - value / slope
        inside = ca.logic_and(newton >= low, newton <= high)
        guess = ca.if_else(inside, newton, (low + high) / 2)
    return ca.Function("implicit", [v0, force], [guess])


def open_loop(model: Model, force: Array, step: float, x0: float, v0: float) -> Motion:
    """The motion under measured `force` [N], linear between the samples.

    Args:
        model: a drive without free parameters.
        force: samples, shape (n,).
        step: sample interval [s].
        x0, v0: start [m], [m/s].
    """
    held = np.append((force[1:] + force[:-1]) / 2, force[-1])
    x, v, f = ca.SX.sym("x"), ca.SX.sym("v"), ca.SX.sym("f")
    state = ca.vertcat(*plant(model, step)(x, v, f))
    advance = ca.Function("advance", [ca.vertcat(x, v), f], [state]).mapaccum(force.size)
    states = np.hstack([[[x0], [v0]], advance([x0, v0], held[None, :]).full()])
    return motion_of(states, held, step)


def motion_of(states: Array, force: Array, step: float) -> Motion:
    """A `Motion` from states (x, v) at n + 1 samples and the n forces held between them."""
    return Motion(
        t=np.arange(force.size, dtype=float) * step,
        x=states[0, :-1],
        v=states[1, :-1],
        a=np.diff(states[1]) / step,
        force=force,
    )
