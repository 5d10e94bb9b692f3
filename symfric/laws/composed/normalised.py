"""A law whose states do not follow the load, for normal forces that vary."""

from dataclasses import dataclass
from typing import ClassVar, final

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param
from symfric.laws.base.law import Facts, Law, check_law
from symfric.laws.composed.wrapper import Wrapper


@final
@dataclass(frozen=True, eq=False)
class LoadNormalised(Wrapper):
    """A law under one load, whose force is scaled with the load there is.

        F     = N / N_0 F_law(v, N_0, z)
        dz/dt = rate_law(v, N_0, z)

    Bristles of laws in newtons deflect with the load; where it falls they keep what they have, and
    in joints with friction from reactions that ends in no solution. Here the deflection does not
    depend on the load, the force follows the load at once, and N = 0 gives none.
    Limits: N = N_0 is the law itself, and so is any N for a law whose force is proportional to the
    load and without states; `LuGre` becomes `LuGreNormalised` with sigma_i / N_0. All of the force
    is scaled, viscous friction too. A load that grows over a bent bristle does work.
    Source: LuGre in coefficients of friction, Canudas de Wit and Tsiotras, CDC 1999; for other laws
    constructed.
    """

    facts: ClassVar[Facts] = Facts(
        (), "that of its law", "constructed", "Canudas de Wit and Tsiotras, CDC 1999"
    )

    law: Law
    N_0: Scalar = param(
        0.8 * 9.81, unit="N", role="load", doc="load at which it is the law itself", lower=1e-12
    )

    def __post_init__(self) -> None:
        check_law("LoadNormalised", self.law)
        super().__post_init__()
        if self.law.inputs:
            raise ValueError(
                "LoadNormalised: expected a law of v and N, got "
                f"{type(self.law).__name__}, which needs {self.law.inputs[0].name}; it holds a "
                "contact at rest whatever the load does"
            )

    @property
    def inner(self) -> Law:
        """The law whose force is scaled."""
        return self.law

    def load(self, N: Scalar) -> Scalar:
        """N_0 [N], whatever the load is."""
        return self.N_0

    def force(self, v: Scalar, N: Scalar, z: Scalar = (), **inputs: Scalar) -> Scalar:
        """Friction force [N]."""
        return N / self.N_0 * super().force(v, N, z)

    def sliding(self, v: Scalar, N: Scalar, side: int, **inputs: Scalar) -> Scalar:
        """Sliding force [N] on one side."""
        return N / self.N_0 * super().sliding(v, N, side)

    def static_level(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """Largest force [N] at rest."""
        return N / self.N_0 * super().static_level(N, side)

    def most_held(self, N: Scalar, side: int = 1, **inputs: Scalar) -> Scalar:
        """That at N_0, scaled."""
        return N / self.N_0 * super().most_held(N, side)
