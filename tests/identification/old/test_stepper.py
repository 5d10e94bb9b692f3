from dataclasses import replace

import numpy as np
import pytest

from identification.old.stepper import acceleration, open_loop, plant
from symfric import Coulomb, Linear, LuGre, Stribeck, Sum, Viscous, drive, rabinowicz, simulate


def test_a_thrown_block_stops_where_the_closed_form_says() -> None:
    model = drive(Coulomb(mu_d=4.0, v_eps=1e-9), m=2.0, N=1.0)
    motion = open_loop(model, np.zeros(2001), 1e-3, 0.0, 1.0)
    # x = m v^2 / (2 F), t = m v / F
    assert motion.x[-1] == pytest.approx(2.0 / 8.0, rel=1e-6)
    assert np.abs(motion.v[501:]).max() < 1e-9
    assert motion.v[498] > 0


@pytest.mark.parametrize("v_eps", [1e-2, 1e-6, 1e-12])
def test_a_loaded_block_sticks_at_any_stiffness(v_eps: float) -> None:
    model = drive(Coulomb(mu_d=4.0, v_eps=v_eps), m=2.0, N=1.0)
    motion = open_loop(model, np.full(1000, 3.0), 1e-3, 0.0, 0.0)
    assert motion.v[-1] == pytest.approx(v_eps * np.arctanh(0.75), rel=1e-6)


def test_open_loop_agrees_with_the_adaptive_simulation() -> None:
    law = Sum((Stribeck(mu_s=3.0, mu_d=2.0, v_s=0.05, v_eps=1e-3), Viscous(1.0)))
    model = drive(law, m=1.5, N=1.0, offset=-0.4)
    t = np.arange(3001) * 1e-3
    force = 5 * np.sin(2 * np.pi * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    exact = simulate(model, 3.0, u={"force": Linear(t, force)}, rtol=1e-9, t_eval=t)
    motion = open_loop(model, force, 1e-3, 0.0, 0.0)
    assert np.abs(motion.x - exact["x"]).max() < 2e-3 * np.ptp(exact["x"])
    assert np.abs(motion.v - exact["v"]).max() < 5e-3 * np.ptp(exact["v"])


def test_the_step_is_of_first_order() -> None:
    model = drive(Viscous(5.0), m=1.0)
    errors = [abs(float(plant(model, 0.1, n)(0.0, 1.0, 0.0)[1]) - np.exp(-0.5)) for n in (4, 8, 16)]
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2.0, rtol=0.1)


@pytest.mark.parametrize(
    "model",
    [
        drive(LuGre()),
        rabinowicz(Coulomb()),
        drive(Coulomb(), free=["m"]),
        replace(drive(Coulomb()), name="other", ode=None),
    ][:3],
)
def test_other_models_are_refused(model: object) -> None:
    with pytest.raises(ValueError, match="expected states x, v, the input force and no free"):
        acceleration(model)  # type: ignore[arg-type]
