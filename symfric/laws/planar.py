"""Any isotropic law for slip in a plane."""

from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.laws.base import Law, State, check_law
from symfric.numeric import Scalar, column, empty, sqrt
from symfric.parameters import Parametric, param


@final
@dataclass(frozen=True, eq=False)
class Planar(Parametric):
    """An isotropic friction law for two-dimensional slip.

        w = sqrt(v_x^2 + v_y^2 + v_eps^2)
        F = F(w, N)/w v

    for a law without states. For one whose force and rates are affine in its states, as of LuGre
    or Dahl, each state becomes a vector and F = F(w, N, 0)/w v + dF/dz z, likewise its rate. In
    components: states of the law along x, then along y.
    Limits: slip along a line beyond 20 v_eps is the law itself. Equivariant under rotations.
    Source: isotropy; LuGre in two dimensions: Velenis, Tsiotras, Canudas de Wit, Vehicle Syst. Dyn.
    43(1), 2005.

    Raises:
        ValueError: a law that is not odd, needs further inputs, has modes, or depends on its
            states in another way than affinely (`Bristle2D` has a planar form of its own).
    """

    law: Law
    v_eps: Scalar = param(1e-9, unit="m/s", doc="smoothing of the speed", lower=1e-15)

    def __post_init__(self) -> None:
        check_law("Planar", self.law)
        super().__post_init__()
        if not self.law.facts.odd or self.law.inputs or not _is_affine(self.law):
            raise ValueError(
                "Planar: expected an odd law of v and N that is affine in its states, got "
                f"{type(self.law).__name__}; Bristle2D, LuGre or Dahl serve in the plane"
            )

    @property
    def states(self) -> tuple[State, ...]:
        """The states of the law along x, then those along y."""
        return tuple(
            State(f"{s.name}_{axis}", s.unit, s.nominal) for axis in "xy" for s in self.law.states
        )

    def _speed(self, v: Scalar) -> Scalar:
        return sqrt(v[0] ** 2 + v[1] ** 2 + self.v_eps**2)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N], shape (2, 1), for the sliding velocity v, shape (2, 1)."""
        w, n = self._speed(v), len(self.law.states)
        radial = self.law.force(w, N, [0.0] * n)
        parts = [z[:n], z[n:]] if n else [(), ()]
        bent = [self.law.force(w, N, part) - radial if n else 0.0 for part in parts]
        return column(*(radial / w * v[i] + bent[i] for i in range(2)))

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rates of the states, shape (2n, 1)."""
        w, n = self._speed(v), len(self.law.states)
        if not n:
            return empty(v[0])
        radial = self.law.rate(w, N, [0.0 * w] * n)
        rows: list[Scalar] = []
        for i, part in enumerate((z[:n], z[n:])):
            bent = self.law.rate(w, N, part)
            rows += [radial[k] / w * v[i] + (bent[k] - radial[k]) for k in range(n)]
        return column(*rows)

    def steady_state(self, v: Scalar, N: Scalar) -> Scalar:
        """States after long sliding along `v`, shape (2n, 1)."""
        if not self.law.states:
            return empty(v[0])
        w = self._speed(v)
        radial = self.law.steady_state(w, N)
        count = len(self.law.states)
        return column(*(radial[k] / w * v[i] for i in range(2) for k in range(count)))


def _is_affine(law: Law) -> bool:
    v, N = ca.SX.sym("v"), ca.SX.sym("N")
    z = ca.SX.sym("z", len(law.states))
    slope = ca.jacobian(ca.vertcat(law.force(v, N, z), law.rate(v, N, z)), z)
    return not ca.depends_on(slope, z) and not law.switches(v, N, z)
