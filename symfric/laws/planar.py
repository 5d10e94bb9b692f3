"""Any isotropic law for slip in a plane or in space."""

from dataclasses import dataclass
from typing import ClassVar, final

import casadi as ca

from symfric.laws.base import Law, State, Switch, check_law
from symfric.numeric import Scalar, column, empty, sqrt
from symfric.parameters import Parametric, param


@dataclass(frozen=True, eq=False)
class Isotropic(Parametric):
    """A friction law for slip v in two or three dimensions d.

        w = sqrt(v'v + v_eps^2)
        F = F(w, N)/w v

    for a law without states. For one whose force and rates are affine in its states, as of LuGre
    or Dahl, each state becomes a vector and F = F(w, N, 0)/w v + dF/dz z, likewise its rate. In
    components: states of the law along x, then along y, then along z.
    Limits: slip along a line beyond 20 v_eps is the law itself. Equivariant under rotations.

    Raises:
        ValueError: a law that is not odd, needs further inputs, has modes, or depends on its
            states in another way than affinely (`Bristle2D` has a planar form of its own).
    """

    axes: ClassVar[str] = ""
    """Names of the dimensions."""

    law: Law
    v_eps: Scalar = param(1e-9, unit="m/s", doc="smoothing of the speed", lower=1e-15)

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_law(name, self.law)
        super().__post_init__()
        if not is_isotropic(self.law):
            raise ValueError(
                f"{name}: expected an odd law of v and N that is affine in its states, got "
                f"{type(self.law).__name__}; Bristle2D (in the plane), LuGre or Dahl serve"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """The states of the law along x, then those along y, then those along z."""
        return tuple(
            State(f"{s.name}_{axis}", s.unit, s.nominal)
            for axis in self.axes
            for s in self.law.states
        )

    def _speed(self, v: Scalar) -> Scalar:
        return sqrt(sum(v[i] ** 2 for i in range(len(self.axes))) + self.v_eps**2)

    def _parts(self, z: Scalar) -> list[Scalar]:
        """The states of the law along each axis."""
        n = len(self.law.states)
        return [z[i * n : (i + 1) * n] if n else () for i in range(len(self.axes))]

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N], shape (d, 1), for the sliding velocity v, shape (d, 1)."""
        w, n = self._speed(v), len(self.law.states)
        radial = self.law.force(w, N, [0.0] * n)
        bent = [self.law.force(w, N, part) - radial if n else 0.0 for part in self._parts(z)]
        return column(*(radial / w * v[i] + along for i, along in enumerate(bent)))

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the states, shape (d n, 1)."""
        w, n = self._speed(v), len(self.law.states)
        if not n:
            return empty(v[0])
        radial = self.law.rate(w, N, [0.0 * w] * n)
        rows: list[Scalar] = []
        for i, part in enumerate(self._parts(z)):
            bent = self.law.rate(w, N, part)
            rows += [radial[k] / w * v[i] + (bent[k] - radial[k]) for k in range(n)]
        return column(*rows)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """States after long sliding along `v`, shape (d n, 1)."""
        if not self.law.states:
            return empty(v[0])
        w, n = self._speed(v), len(self.law.states)
        radial = self.law.steady_state(w, N)
        return column(*(radial[k] / w * v[i] for i in range(len(self.axes)) for k in range(n)))

    def switches(self, v: Scalar, N: Scalar, z: Scalar = ()) -> tuple[Switch, ...]:
        """None: laws with modes are refused."""
        return ()


@final
@dataclass(frozen=True, eq=False)
class Planar(Isotropic):
    """An isotropic friction law for slip in a plane, d = 2: see `Isotropic`.

    Source: isotropy; LuGre in two dimensions: Velenis, Tsiotras, Canudas de Wit, Vehicle Syst. Dyn.
    43(1), 2005.
    """

    axes: ClassVar[str] = "xy"


@final
@dataclass(frozen=True, eq=False)
class Spatial(Isotropic):
    """An isotropic friction law for slip in space, d = 3, as of a ball in its socket: `Isotropic`.

    Limits: bristles have the direction they have in the axes in which v is given.
    Source: isotropy.
    """

    axes: ClassVar[str] = "xyz"


def is_isotropic(law: Law) -> bool:
    """Whether a law has a form in several dimensions by isotropy alone."""
    return law.facts.odd and not law.inputs and _is_affine(law)


def _is_affine(law: Law) -> bool:
    v, N = ca.SX.sym("v"), ca.SX.sym("N")
    z = ca.SX.sym("z", len(law.states))
    slope = ca.jacobian(ca.vertcat(law.force(v, N, z), law.rate(v, N, z)), z)
    return not ca.depends_on(slope, z) and not law.switches(v, N, z)
