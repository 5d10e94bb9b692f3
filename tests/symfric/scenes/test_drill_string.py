"""The drill string against its equations in angles, dry stick-slip and steady drilling."""

from math import atan, pi, sqrt

import numpy as np
import pytest
from mechanics import brown_mcphee
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from symfric import BrownMcPhee, ExactCoulomb, Stribeck, Viscous, simulate
from symfric.scenes import DrillString

Array = NDArray[np.float64]
J_BIT, J_STRING, K, C, C_B, R = 471.9698, 100.0, 861.5336, 172.3067, 50.0, 0.155575


def in_angles(n: int, w_top: float, N: float, times: Array) -> Array:
    """Speed of the bit and torque of the top, by absolute angles of top and lumps."""
    J = np.full(n, J_STRING / n)
    J[-1] = J_BIT + J_STRING / n / 2

    def torques(t: float, y: Array) -> Array:
        angle, speed = np.r_[w_top * t, y[:n]], np.r_[w_top, y[n:]]
        return -n * (K * np.diff(angle) + C * np.diff(speed))

    def rates(t: float, y: Array) -> Array:
        above = torques(t, y)
        below = np.r_[above[1:], R * N * brown_mcphee(R * y[-1], 0.15, 0.1, 0.01) + C_B * y[-1]]
        return np.r_[y[n:], (above - below) / J]

    run = solve_ivp(rates, (0.0, times[-1]), np.zeros(2 * n), "LSODA", times, rtol=1e-9, atol=1e-11)
    assert run.success
    top = [torques(t, y)[0] for t, y in zip(times, run.y.T, strict=True)]
    return np.array([run.y[-1], top])


def test_string_agrees_with_absolute_angles() -> None:
    lumps, times = 3, np.linspace(1.0, 15.0, 15)
    bit, top = in_angles(lumps, 0.3, 97347.0, times)
    scene = DrillString(BrownMcPhee(v_t=0.01), lumps=lumps)
    run = simulate(scene.model(), 15.0, u={"w_top": 0.3}, t_eval=times, rtol=1e-9)
    assert run["w_bit"] == pytest.approx(bit, abs=1e-6)
    assert run["torque_top"] == pytest.approx(top, rel=1e-6)


def test_one_inertia_without_damping_sticks_and_slips_with_the_period_of_dry_friction() -> None:
    """As a block on a belt: 2 A/w_top + 2 (pi - atan(A w/w_top))/w with A half the fall."""
    law, w_top = ExactCoulomb(mu_s=0.15, mu_d=0.1), 0.5
    scene = DrillString(law, lumps=1, J_string=0.0, c=0.0, c_b=0.0)
    run = simulate(scene.model(), 60.0, u={"w_top": w_top}, rtol=1e-10)
    A, w = 0.05 * 97347.0 * R / K, sqrt(K / J_BIT)
    period = 2 * A / w_top + 2 * (pi - atan(A * w / w_top)) / w
    slips = [t for t, name in run.happened if name == "slip"]
    assert len(slips) > 3
    assert np.diff(slips)[1:] == pytest.approx(period, rel=1e-7)
    peak = 0.1 * 97347.0 * R + K * sqrt(A * A + (w_top / w) ** 2)
    assert run["torque_top"].max() == pytest.approx(peak, rel=1e-4)


def test_after_a_hundred_thousand_turns_the_twist_is_as_exact_as_after_one() -> None:
    """It was a torsion spring that wrapped at pi; here angles are not even subtracted."""
    w_top, law = 12.0, Viscous(sigma_2=500.0)
    scene = DrillString(law, lumps=2)
    run = simulate(scene.model(), 6e4, u={"w_top": w_top}, samples=11)
    torque = (C_B + R * R * 500.0) * w_top
    assert run["phi"][-1] == pytest.approx(w_top * 6e4, abs=20.0)
    assert [run["twist_1"][-1], run["twist_2"][-1]] == pytest.approx([torque / K / 2] * 2, rel=1e-8)
    assert run["torque_top"][-1] == pytest.approx(torque, rel=1e-8)


@pytest.mark.parametrize(("w_top", "sticks"), [(3.0, True), (8.0, False)])
def test_rock_of_the_paper_sticks_at_low_speed_only(w_top: float, sticks: bool) -> None:
    run = simulate(
        DrillString.preset("navarro_lopez", Stribeck()).model(), 60.0, u={"w_top": w_top}
    )
    late = run["w_bit"][run.t > 40]
    assert bool(late.min() < 1e-2) is sticks
    if not sticks:
        assert late == pytest.approx(w_top, rel=5e-3)
        rock = 97347.0 * R * (0.5 + 0.3 * np.exp(-0.9 * w_top))  # as the paper writes it
        assert run["torque_top"][-1] == pytest.approx(rock + C_B * w_top, rel=5e-3)


def test_a_string_without_inertia_has_one_lump() -> None:
    with pytest.raises(ValueError, match=r"J_string: expected above 0 .* lumps = 1 is a string"):
        DrillString(Viscous(), J_string=0.0)
    for lumps in (0, 1.5, True):
        with pytest.raises(ValueError, match="DrillString: lumps: expected a whole number"):
            DrillString(Viscous(), lumps=lumps)  # type: ignore[arg-type]
