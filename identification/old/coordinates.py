"""Coordinates of the fit: scaled, logarithmic or as an excess, so that only boxes are left."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np

from identification.old.choice import VELOCITIES, Choice, is_coefficient, is_velocity, parts
from identification.old.data import Array
from symfric.foundation.parameters import parameters, symbolise
from symfric.model import Model


@final
@dataclass(frozen=True, eq=False)
class Coordinates:
    """Dimensionless coordinates w of the free parameters p.

        p = scale w            levels, masses, viscous coefficients, offsets
        p = exp(w)             velocity scales, positive by nature
        p = p_low + scale w    the upper one of an ordered pair (mu_d <= mu_s), w >= 0

    Attributes:
        names: free parameters, in the order of p.
        model: the drive with p as symbols.
        w: SX symbols (n, 1).
        p: SX expressions (n, 1) in w.
        lower, upper: bounds of w, shape (n,).
        linear: whether a coordinate is a level (mass, force, coefficient), shape (n,).
    """

    names: tuple[str, ...]
    model: Model
    w: ca.SX
    p: ca.SX
    lower: Array
    upper: Array
    linear: Array
    scale: Array
    low_of: dict[int, ca.SX]

    def values(self, w: Array) -> Array:
        """The parameters at w, shape (n,)."""
        return np.asarray(ca.Function("p", [self.w], [self.p])(w).full()).ravel()

    def slope(self, w: Array) -> Array:
        """dp/dw at w, shape (n, n)."""
        found = ca.Function("slope", [self.w], [ca.jacobian(self.p, self.w)])(w)
        return np.asarray(found.full())

    def of(self, values: Mapping[str, float]) -> Array:
        """Coordinates of parameters by name, moved inside the bounds."""
        p = np.array([values[name] for name in self.names])
        symbols = self.model.vector("p")
        w = np.empty(p.size)
        for i, name in enumerate(self.names):
            if i in self.low_of:
                low = ca.Function("low", [symbols], [self.low_of[i]])(p)
                w[i] = (p[i] - float(low)) / self.scale[i]
            else:
                w[i] = p[i] / self.scale[i] if self.linear[i] else np.log(values[name])
        return self.inside(w)

    def inside(self, w: Array) -> Array:
        """`w` moved inside the bounds by a hundredth of their distance or of one."""
        margin = 0.01 * np.minimum(1.0, self.upper - self.lower)
        return np.clip(w, self.lower + margin, self.upper - margin)


def coordinates(choice: Choice, force: float, speed: float, mass: float) -> Coordinates:
    """Coordinates of the free parameters of `choice`.

    Args:
        choice: drive and free names.
        force, speed, mass: typical level of friction [N], speed [m/s] and mass [kg].
    """
    scene, variables = symbolise(choice.drive, *choice.free)
    known = parameters(choice.drive)
    w = ca.SX.sym("w", len(variables))
    low_of = {
        i: ca.SX(getattr(part, low))
        for part in parts(scene)
        for low, high in type(part).ordered
        for i, v in enumerate(variables)
        if getattr(part, high) is v.symbol
    }
    p: list[ca.SX] = []
    lower, upper, linear, scale = (np.zeros(len(variables)) for _ in range(4))
    N = float(choice.drive.N)
    typical = {"kg": mass, "N": force, "N s/m": force / speed, "s/m": force / N / speed}
    for i, v in enumerate(variables):
        parameter = known[v.name]
        logarithmic = is_velocity(parameter)
        linear[i] = not logarithmic
        size = typical.get(v.unit, max(abs(float(parameter.value)), 1.0))
        scale[i] = force / N if is_coefficient(parameter) else size
        if logarithmic:
            bounds = _window(parameter.unit, parameter.role == "width", choice.v_max)
            lower[i], upper[i] = np.log([max(v.lower, bounds[0]), min(v.upper, bounds[1])])
            p.append(ca.exp(w[i]))
        elif i in low_of:
            upper[i] = np.inf
            p.append(scale[i] * w[i])
        else:
            lower[i], upper[i] = v.lower / scale[i], v.upper / scale[i]
            p.append(scale[i] * w[i])
    column = ca.vertcat(*p)
    symbols = ca.vertcat(*(v.symbol for v in variables))
    for i, low in low_of.items():
        column[i] += ca.substitute(low, symbols, column)
    model = scene.equations(variables)
    return Coordinates(choice.free, model, w, column, lower, upper, linear, scale, low_of)


def _window(unit: str, smoothing: bool, v_max: float) -> tuple[float, float]:
    """Range of a velocity scale that the data can tell, in its unit."""
    low, high = (1e-5 if smoothing else 2e-3) * v_max, v_max
    return (low, high) if unit in VELOCITIES else (1 / high, 1 / low)
