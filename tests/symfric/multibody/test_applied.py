"""Laws that ask for the applied force, in joints: rest by modes against all modes tried."""

from collections.abc import Callable

import numpy as np
import pytest
from dry import DryMotion, pendulum_box
from stored import stored

from symfric import simulate
from symfric.laws import Awrejcewicz, ExactCoulomb, Karnopp, Law, Stribeck
from symfric.multibody import functions
from symfric.scenes import PendulumBox

pytestmark = pytest.mark.heavy
TIMES = np.linspace(0.02, 3.0, 150)


@pytest.mark.parametrize(("mu_s", "mu_d"), [(0.15, 0.1), (0.15, 0.15), (0.5, 0.3)])
def test_pendulum_box_is_the_motion_of_the_valid_modes(mu_s: float, mu_d: float) -> None:
    """Box and hinge stick and slip, and each changes what presses and loads the other."""

    def computed() -> np.ndarray:
        start = np.array([0.0, np.pi / 6, 0.0, 0.0])
        return DryMotion(pendulum_box(mu_d), mu_s).run(start, 3.0).at(TIMES)[:2]

    x, phi = stored(f"dry_pendulum_box_{mu_s}_{mu_d}", computed)
    law = ExactCoulomb(mu_s=mu_s, mu_d=mu_d)
    run = simulate(PendulumBox(law).model(), 3.0, rtol=1e-10, t_eval=TIMES)
    assert run["x"] == pytest.approx(x, abs=1e-8)
    assert run["phi"] == pytest.approx(phi, abs=1e-8)


def test_functions_of_a_mechanism_refuse_what_they_cannot_know() -> None:
    with pytest.raises(ValueError, match="joint 'x' > friction > law: expected one that needs v"):
        functions(PendulumBox(ExactCoulomb()).mechanism())


@pytest.mark.parametrize(
    "law",
    [
        lambda w: Karnopp(D_v=w),
        lambda w: Awrejcewicz(epsilon=w, v_s=w),
        lambda w: Stribeck(v_s=w, v_eps=w / 10),
    ],
    ids=["Karnopp", "Awrejcewicz", "Stribeck"],
)
def test_smooth_laws_tend_to_dry_friction_with_their_width(law: Callable[[float], Law]) -> None:
    """To first order: a tenth of the width, a tenth of the error."""
    dry = simulate(PendulumBox(ExactCoulomb()).model(), 3.0, rtol=1e-9, t_eval=TIMES)
    errors: list[float] = []
    for width in (1e-4, 1e-5):
        run = simulate(PendulumBox(law(width)).model(), 3.0, rtol=1e-8, t_eval=TIMES)
        errors.append(float(np.abs(run["x"] - dry["x"]).max()))
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.02)
    assert errors[1] < 3e-6
