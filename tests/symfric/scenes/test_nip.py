"""The laminator nip against its equations in speeds, steady lamination and an open nip."""

import numpy as np
import pytest
from mechanics import brown_mcphee
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from symfric import BrownMcPhee, ExactCoulomb, LuGre, Stribeck, simulate
from symfric.scenes import Nip

Array = NDArray[np.float64]
J, R, K, D, LAG = 0.2, 0.1, 200.0, 0.5, 0.015


def plain(times: Array) -> Array:
    """Speeds of line and roller and torque of the shaft, in the speed of the roller itself."""

    def load(t: float) -> float:
        return 1.0 + 500 + 25 * np.sin(5 * t)

    def rates(t: float, y: Array) -> Array:
        line, w, twist = y
        w_0 = (1 - LAG) * line / R
        friction = load(t) * brown_mcphee(line - R * w, 0.15, 0.1, 0.01)
        shaft = K * twist + D * (w_0 - w)
        return np.array([(0.125 * min(t, 4.0) - line) / 0.1, (R * friction + shaft) / J, w_0 - w])

    run = solve_ivp(
        rates, (0.0, times[-1]), np.zeros(3), "Radau", times, rtol=1e-9, atol=1e-12, max_step=0.1
    )
    assert run.success
    return run.y


def test_nip_agrees_with_its_equations_in_speeds() -> None:
    times = np.linspace(0.1, 3.9, 20)  # the ramp ends at 4 s
    line, w, twist = plain(times)
    scene = Nip(BrownMcPhee(v_t=0.01))
    inputs = {n: given.function for n, given in scene.inputs.items()}
    run = simulate(scene.model(), 3.9, u=inputs, t_eval=times, rtol=1e-9)
    for name, values in (("v_line", line), ("w_roller", w), ("twist", twist)):
        assert run[name] == pytest.approx(values, abs=1e-6), name


def test_far_from_the_fall_of_the_curve_the_web_slips_by_the_lag() -> None:
    law = Stribeck(sigma_2=50.0, v_s=1e-4)
    run = simulate(Nip(law, d=20.0).model(), 20.0, u={"v_set": 0.5, "load": 300.0})
    slip = LAG * 0.5
    friction = 301.0 * 0.1 + 50.0 * slip
    assert run["v_rel"][-1] == pytest.approx(slip, rel=1e-4)
    assert run["friction"][-1] == pytest.approx(friction, rel=1e-4)
    assert run["torque"][-1] == pytest.approx(-R * friction, rel=1e-4)


def test_a_web_that_carries_the_roller_winds_up_its_shaft_to_the_static_level() -> None:
    """At constant line speed the shaft winds by lag v_line / R a second, up to mu_s N R / k."""
    law = ExactCoulomb(mu_s=0.15, mu_d=0.1)
    scene = Nip(law, d=0.0)
    x0 = {"v_line": 0.5, "v_rel": 0.0, "twist": 0.0}
    run = simulate(scene.model(), 1.0, x0=x0, u={"v_set": 0.5, "load": 499.0}, rtol=1e-9)
    breaks = next(t for t, name in run.happened if name == "slip" and t > 0)
    assert breaks == pytest.approx((0.15 * 500.0 * R / K) / (LAG * 0.5 / R), rel=1e-7)


def test_an_open_nip_leaves_the_roller_to_its_drive() -> None:
    law = LuGre()
    run = simulate(Nip(law).model(), 30.0, u={"v_set": 0.5, "load": -200.0})
    assert run["N"].max() == 1.0
    assert run["v_rel"][-1] == pytest.approx(LAG * 0.5, rel=1e-3)
