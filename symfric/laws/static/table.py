"""Friction by a table of measured coefficients."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import final

import numpy as np

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.laws.base import fields, smooth
from symfric.laws.base.law import Facts, StaticLaw


@final
@dataclass(frozen=True, eq=False)
class Table(StaticLaw):
    """Friction coefficients measured at some speeds, interpolated without overshoot.

        F = N mu(|v|) sign(v)

    `mu` passes through (speeds, coefficients) as a monotone cubic (PCHIP of Fritsch and Carlson)
    and is constant outside them; sign(v) is smooth over v_eps. One cubic per interval, all of them
    evaluated: for tens of points, not for thousands.
    Limits: between two equal coefficients mu is constant; a table of two points is nearly a ramp.
    Creeps under load.
    Source: Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980, in the form of Fritsch and Butland
    1984 (harmonic mean of slopes); tables as in Modelica's SupportFriction.
    """

    facts = Facts(
        phenomena=("D", "S", "St", "V"),
        smoothness="C1 at the speeds of the table",
        confidence="two sources",
        checked="Fritsch and Butland 1984, as in SciPy",
        source="Fritsch and Carlson 1980; Fritsch and Butland 1984",
    )

    speeds: tuple[float, ...]
    coefficients: tuple[float, ...]
    v_eps: Scalar = fields.V_EPS(1e-4, lower=1e-12)

    def __post_init__(self) -> None:
        super().__post_init__()
        v = checks.array("Table: speeds", self.speeds)
        mu = checks.array("Table: coefficients", self.coefficients)
        if v.shape != mu.shape or v.size < 2:
            raise ValueError(
                "Table: expected as many coefficients as speeds, two or more, got "
                f"{v.size} speeds and {mu.size} coefficients"
            )
        if not ((np.diff(v) > 0).all() and v[0] >= 0):
            raise ValueError(f"Table: speeds: expected 0 <= rising numbers, got {self.speeds}")
        if not (mu >= 0).all():
            raise ValueError(f"Table: coefficients: expected numbers >= 0, got {self.coefficients}")

    def outside(self, speed: Scalar, N: Scalar) -> Scalar:
        """Sliding force [N] at a speed >= 0 as the widths vanish."""
        return N * self.coefficient(speed)

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Friction force [N]."""
        mu = self.coefficient(smooth.magnitude(v, 0.0))
        return N * mu * smooth.sign(v, self.v_eps)

    def coefficient(self, speed: Scalar) -> Scalar:
        """The coefficient mu at a speed >= 0."""
        mu = self.coefficients[0]
        pieces = zip(pairwise(self.speeds), pairwise(self.coefficients), self._slopes, strict=True)
        for (a, b), (low, high), (left, right) in pieces:
            t = smooth.clip((speed - a) / (b - a), 0.0, 1.0)
            rise, left, right = high - low, left * (b - a), right * (b - a)
            bend = left + right - 2 * rise
            mu = mu + t * (left + t * (rise - left - bend + t * bend))
        return mu

    @cached_property
    def _slopes(self) -> list[tuple[float, float]]:
        """Slopes at both ends of every interval: weighted harmonic means, zero at the ends."""
        h = np.diff(self.speeds)
        secant = np.diff(self.coefficients) / h
        before, after = secant[:-1], secant[1:]
        near, far = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
        turning = before * after <= 0
        one, other = (np.where(turning, 1.0, s) for s in (before, after))
        inner = np.where(turning, 0.0, (near + far) / (near / one + far / other))
        return list(pairwise([0.0, *inner.tolist(), 0.0]))
