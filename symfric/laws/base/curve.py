"""What static laws share: two levels, or one formula in the direction of slip and a fall."""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial

from symfric.foundation.numeric import Scalar, tanh
from symfric.laws.base import smooth
from symfric.laws.base.law import StaticLaw

Fall = Callable[[Scalar, Scalar, Scalar], Scalar]
"""(v, v_s, delta) -> the Stribeck weight exp(-|v / v_s|^delta)."""


class TwoLevels(StaticLaw):
    """A law without states that holds mu_s N at rest and tends to mu_d N in sliding."""

    mu_s: Scalar
    mu_d: Scalar

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.mu_d * N

    def static_level(self, N: Scalar, side: int = 1) -> Scalar:
        """The force [N] of break-away, mu_s N."""
        return self.mu_s * N


@dataclass(frozen=True, eq=False)
class Curve(StaticLaw):
    """A law without states that is written once, with the direction s of slip and a fall.

        F = formula(v, N, s, fall)

    `force` takes s = tanh(v / v_eps), and a fall that rounds |v| over 1e-4 v_eps; `outside` takes
    s = 1 and the fall on one side of rest. v_eps is the first parameter that is a width, or the
    inverse of a steepness.
    """

    @abstractmethod
    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Friction force [N] at the velocity `v` with the direction `s`."""

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return self.formula(speed, N, 1.0, smooth.fall)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        width = next(item for item in fields(self) if item.metadata.get("width"))
        value = getattr(self, width.name)
        if width.metadata["width"] > 0:
            s, corner = smooth.sign(v, value), smooth.CORNER * value
        else:
            s, corner = tanh(value * v), smooth.CORNER / value
        return self.formula(v, N, s, partial(smooth.stribeck, eps=corner))
