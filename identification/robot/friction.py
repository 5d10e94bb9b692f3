"""Static friction laws of the joints, as functions of velocity and free parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.record import Array
from identification.fit import Fit
from identification.residuals.points import Points
from identification.robot.dynamics import WHERE, RobotModel
from symfric.foundation import checks
from symfric.foundation.numeric import is_number
from symfric.foundation.parameters import check_names, parameters, with_values
from symfric.foundation.shown import brief
from symfric.foundation.units import turned
from symfric.laws import Law, law_from_text, law_name

USUAL = "coulomb+viscous"
FITTED = ("level", "viscous", "velocity scale")
"""Roles of the parameters that are fitted."""
SHARP = 1e-3
"""Smoothing width of a law, relative to the root mean square of the velocity."""


@final
@dataclass(frozen=True, eq=False)
class JointLaw:
    """Friction law of one joint with k free parameters, under the normal force 1.

    Attributes:
        joint: name of the joint.
        law: law with values for all parameters; those of the free ones are starts.
        names, units: free parameters.
        logarithmic: parameters that are fitted by their logarithms, shape (k,).
        linear: True if the force is linear in the free parameters.
        function: CasADi function (v, x) -> F, dF/dx of one sample; x are the coordinates.
    """

    joint: str
    law: Law
    names: tuple[str, ...]
    units: tuple[str, ...]
    logarithmic: NDArray[np.bool_]
    linear: bool
    function: ca.Function

    __repr__ = brief

    @classmethod
    def of(cls, joint: str, law: Law, turning: bool) -> "JointLaw":
        """Return the functions of a static law."""
        known = parameters(law)
        free = [
            p for p in known.values() if p.role in FITTED and not p.width and is_number(p.value)
        ]
        x, v = ca.SX.sym("x", len(free)), ca.SX.sym("v")
        logarithmic = np.array([p.role == "velocity scale" for p in free], dtype=bool)
        values = [ca.exp(x[k]) if log else x[k] for k, log in enumerate(logarithmic)]
        given = dict(zip((p.name for p in free), values, strict=True))
        F = ca.SX(with_values(law, given).force(v, 1.0))
        J = ca.jacobian(F, x)
        units = ("N" if p.role == "level" else p.unit for p in free)
        return cls(
            joint, law, tuple(p.name for p in free),
            tuple(turned(u) if turning else u for u in units), logarithmic,
            not ca.depends_on(J, x), ca.Function("friction", [v, x], [F, ca.densify(J)]),
        )  # fmt: skip

    @property
    def start(self) -> Array:
        """Coordinates of the values of the law, shape (k,)."""
        known = parameters(self.law)
        values = np.array([float(known[name].value) for name in self.names])
        return np.where(self.logarithmic, np.log(np.maximum(values, 1e-12)), values)

    def values(self, x: Array) -> Array:
        """Return the parameters for coordinates x, shape (k,)."""
        return np.where(self.logarithmic, np.exp(np.clip(x, -30.0, 30.0)), x)

    def at(self, v: Array, x: Array) -> tuple[Array, Array]:
        """Return the friction (R,) and its derivatives by the coordinates (R, k)."""
        if not v.size:
            return np.zeros(0), np.zeros((0, x.size))
        F, J = self.function.map(v.size)(v[None, :], np.repeat(x[:, None], v.size, axis=1))
        return F.full().ravel(), J.full().reshape(v.size, -1)

    def fitted(self, v: Array, F: Array, turning: bool) -> "JointLaw":
        """Return the law fitted to friction forces F at velocities v, both shape (R,)."""
        units = {"v": "rad/s", "F": "N m"} if turning else {"v": "m/s", "F": "N"}
        points = Dataset.of(v=v, F=F, units=units, points=True, name=self.joint)
        found = Fit(Points(offset=True), self.law, points, starts=3).solve(throw=False)
        known = parameters(self.law)
        values = {n: e.value for n, e in found.parameters.items() if n in known}
        return JointLaw.of(self.joint, with_values(self.law, values), turning)


def laws_of(
    model: RobotModel, law: Law | str | Mapping[str, Law | str], speeds: Array
) -> tuple[JointLaw, ...]:
    """Return the law of each joint.

    Args:
        model: the robot.
        law: one law for all joints, or laws by joint; others are `coulomb+viscous`.
        speeds: root mean squares of the velocities, which determine smoothing widths, shape (n,).

    Raises:
        ValueError: an unknown joint, or a law that needs states or other inputs.
    """
    given = law if isinstance(law, Mapping) else dict.fromkeys(model.names, law)
    check_names(f"{WHERE}: law", given, model.names)
    found = list[JointLaw]()
    for joint, unit, speed in zip(model.names, model.units, speeds, strict=True):
        one = given.get(joint, USUAL)
        one = law_from_text(one) if isinstance(one, str) else one
        checks.kind(f"{WHERE}: law of '{joint}'", one, Law, "a law or its text")
        if one.states or one.inputs:
            raise ValueError(
                f"{WHERE}: law of '{joint}': expected a law without states, got {law_name(one)}; "
                f"fit it afterwards by Fit(Points(offset=True), law, fit.friction_data('{joint}'))"
            )
        widths = {n: (SHARP * max(float(speed), 1e-9)) ** power for n, power in one.widths.items()}
        found.append(JointLaw.of(joint, with_values(one, widths), unit == "rad"))
    return tuple(found)


def coordinates(laws: Sequence[JointLaw]) -> Array:
    """Return the coordinates of all laws, shape (sum of k,)."""
    return np.concatenate([law.start for law in laws])
