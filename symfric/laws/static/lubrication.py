"""Lubricated contact: friction over the Hersey number."""

from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import param, parametric
from symfric.laws.base import fields
from symfric.laws.base.families import Curve, Fall
from symfric.laws.base.law import Facts


@parametric
class MixedLubrication(Curve):
    """Stribeck curve over the Hersey number: boundary, mixed and hydrodynamic friction.

        p  = N / A,   H = eta |v| / p
        mu = mu_b / (1 + (H/H_m)^2) + H / h
        F  = N mu sign(v)

    The Hersey number H [m] is viscosity times sliding velocity over pressure. The first term is the
    share of the load on asperities, the second is shear of a film of the thickness h. The force of
    the film, eta A v / h, does not depend on the load. In a plain bearing of radius r, length L and
    radial clearance c, v = omega r, A = 2 r L, and Petroff's equation is h = c / pi. sign(v) is
    smooth over v_eps. N^2 is rounded by N_eps^2 in the first term, so that N = 0 is valid; the
    float N_eps = 0 is the equation itself.
    The viscosity eta has the role "viscous": `TemperatureDependent` makes it Reynolds' function of
    the temperature.
    Limits: mu_b at rest; mu_b/2 + H_m/h at H = H_m; mu_b = 0 is `Viscous` with eta A / h. The
    friction has a minimum only if h > 1.54 H_m / mu_b. The film thickness is constant, so mu rises
    linearly in the hydrodynamic regime. Creeps under load.
    Source: Hersey, J. Wash. Acad. Sci. 4, 1914; Petroff 1883; the mixed regime as in Hess and Soom,
    ASME J. Tribol. 112(1), 1990 (not read).
    Checked: Petroff's equation; the first term is from memory.
    """

    facts = Facts(("D", "S", "St", "V"), "C∞", "unverified", load="by the Hersey number")

    mu_b: Scalar = fields.COEFFICIENT(0.1, doc="boundary friction coefficient")
    eta: Scalar = fields.SIGMA_2(0.05, unit="Pa s", doc="dynamic viscosity")
    A: Scalar = param(
        1e-3, unit="m^2", role="geometry", doc="projected area of the contact", lower=1e-12
    )
    H_m: Scalar = fields.SHAPE(1e-8, unit="m", doc="Hersey number of the mixed regime", lower=1e-18)
    h: Scalar = fields.ANGLE(2e-5, unit="m", doc="film thickness", lower=1e-12)
    v_eps: Scalar = fields.V_EPS(1e-4)
    N_eps: Scalar = fields.WIDTH(1e-3, unit="N", doc="rounding of the load", lower=0.0)

    def formula(self, v: Scalar, N: Scalar, s: Scalar, fall: Fall) -> Scalar:
        """Return the friction force [N] in the direction `s`."""
        drag = self.eta * self.A * v
        film = drag / self.H_m  # load at which H = H_m
        loaded = N * N + self.N_eps * self.N_eps
        return self.mu_b * N * s * loaded / (loaded + film * film) + drag / self.h
