"""The C of compensators in the loop of a drive whose friction is another one than theirs."""

import pytest

from symfric import GMS, ElastoPlastic, Element, ExactCoulomb, Law, LuGre, drive
from symfric.compensation import Cascade, Comparison, close_loop, compensator, sine

CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
"""With N = 1 N the coefficients are newtons."""
BELIEVED = LuGre(sigma_0=1e5, sigma_1=300.0, **CURVE)
SOFT = Cascade(kp=20.0, kv=60.0, ki=10.0)
PLANTS: dict[str, Law] = {
    "bristles": LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "elasto-plastic": ElastoPlastic(sigma_0=2e5, sigma_1=400.0, **CURVE),
    "springs": GMS(
        elements=tuple(Element(k, 0.25) for k in (1.5e5, 7.5e4, 4.5e4, 3e4)),
        C=400.0, form="event", **CURVE,
    ),
    "Coulomb": ExactCoulomb(form="stribeck", **CURVE),
}  # fmt: skip


def compared(law: Law, reference: object, **cases: dict[str, float]) -> Comparison:
    block = compensator(BELIEVED, v_blend=0.02, error_gain=20.0)
    return close_loop(
        drive(law, m=1.0, N=1.0), reference, block, controller=SOFT, cases=cases or None
    )


@pytest.mark.parametrize("name", ["bristles", "elasto-plastic", "Coulomb"])
def test_the_rms_tracking_error_is_five_times_smaller(name: str) -> None:
    found = compared(PLANTS[name], sine(0.02, 0.5, 2.0))
    assert found.reduction("compensated") > 5.0
