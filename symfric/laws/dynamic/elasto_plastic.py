"""Elasto-plastic friction: a bristle that is elastic up to break-away, so nothing drifts."""

from dataclasses import dataclass
from math import pi
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar, column, equals, is_number, sin
from symfric.foundation.parameters import param
from symfric.laws.base import smooth
from symfric.laws.base.law import Facts
from symfric.laws.dynamic.bristle import Bristle
from symfric.laws.dynamic.element import ahead


@final
@dataclass(frozen=True, eq=False)
class ElastoPlastic(Bristle):
    """Elasto-plastic friction (one state).

        g     = N [mu_d + (mu_s - mu_d) exp(-|v/v_s|^delta)],   z_ss = g / sigma_0
        r     = (z sign(v) - z_ba) / (z_ss - z_ba)
        alpha = 0 for r <= 0,  1 for r >= 1,  between them a step of r
        dz/dt = v - alpha sigma_0 |v| z / g
        F     = sigma_0 z + sigma_1 dz/dt + sigma_2 v

    Below the break-away deflection z_ba [m] the bristle is a spring: it returns exactly and does
    not drift under vibration. The step is 10r^3 - 15r^4 + 6r^5; v_eps = 0 is the original, with
    sign(v), |v| and the step (1 + sin(pi (r - 1/2))) / 2. In the printed original z stands for
    z sign(v), which is wrong for z < 0.
    Limits: steady state g sign(v) + sigma_2 v, approached more slowly than by `LuGre` (0.997 of
    it after 3.4 z_ss); z_ba -> 0 is not `LuGre`, since alpha still rises with z. Passivity and the
    choice of v_eps as in `LuGre`. Needs z_ba < mu_d N / sigma_0, hence not valid for small N.
    Source: Dupont, Hayward, Armstrong, Altpeter, IEEE TAC 47(5), 2002, 787-792.

    Raises:
        ValueError: from `rate` and `force`: z_ba beyond what the load, a number, allows.
    """

    facts: ClassVar[Facts] = Facts(
        phenomena=("D", "S", "St", "V", "P", "L", "B", "N"),
        smoothness="C2 (C0 at v = 0 and C1 in z as v_eps -> 0)",
        confidence="two sources",
        checked="jchristopherson/FrictionModels.jl ElastoPlasticModels.jl; MBDyn",
        source="Dupont, Hayward, Armstrong, Altpeter, IEEE TAC 47(5), 2002",
    )

    z_ba: Scalar = param(1e-7, unit="m", role="length", doc="break-away deflection", lower=0.0)

    def sliding_share(self, v: Scalar, N: Scalar, z: Scalar) -> Scalar:
        """alpha: 0 while the bristle is elastic, 1 when it slides."""
        z_ss = self.level(v, N) / self.sigma_0
        elastic = self.z_ba / z_ss

        def step(share: Scalar) -> Scalar:
            r = (share - elastic) / (1 - elastic)
            if equals(self.v_eps, 0.0):
                return (1 + sin(pi * (smooth.clip(r, 0.0, 1.0) - 0.5))) / 2
            return smooth.step5(r)

        return ahead(step, smooth.sign(v, self.v_eps), z[0] / z_ss)

    def rate(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        """Rate of the bristle deflection [m/s], shape (1, 1)."""
        self._check_load(N)
        relaxation = self.sigma_0 * smooth.magnitude(v, self.v_eps) / self.level(v, N)
        return column(v - self.sliding_share(v, N, z) * relaxation * z[0])

    def _check_load(self, N: Scalar) -> None:
        numbers = (self.mu_d, N, self.sigma_0, self.z_ba)
        if all(map(is_number, numbers)) and self.z_ba >= self.mu_d * N / self.sigma_0:
            raise ValueError(
                "ElastoPlastic: expected z_ba < mu_d N / sigma_0 = "
                f"{self.mu_d * N / self.sigma_0:g} m, got z_ba = {self.z_ba:g} m; "
                "the bristle would have to slide before it breaks away"
            )
