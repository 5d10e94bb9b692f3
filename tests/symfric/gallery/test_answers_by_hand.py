"""What the gallery compares with: exact dry friction on the belt, and machines written by hand."""

import numpy as np
import pytest
from oracles import rabinowicz_coulomb, rabinowicz_motion

from symfric import SteadyStateLuGre
from symfric.gallery.generalized_maxwell_slip.laws import SIGMA_0, SIGMA_1, bristle
from symfric.gallery.laminator_nips import sled
from symfric.gallery.self_tuning import machines
from symfric.gallery.self_tuning.machines import fixed_steps, solve
from symfric.gallery.shared import Belt


def test_the_belt_has_the_period_and_the_extremes_of_the_closed_form() -> None:
    belt = Belt(m=0.8, k=2.1, v_belt=0.1, F_S=1.1772, F_C=0.7848)
    times = np.linspace(0.0, 40.0, 40001)
    motion = belt.motion(times)
    known = rabinowicz_coulomb(0.15, 0.1, 0.8, 2.1, 0.1, 9.81)
    assert np.allclose(np.diff(belt.leaves), known.period, rtol=1e-12)
    assert motion["x"].max() == pytest.approx(known.x_max, rel=1e-6)
    assert motion["x"][20000:].min() == pytest.approx(known.x_min, rel=1e-6)
    assert motion["friction"].min() == pytest.approx(-1.1772, rel=1e-3)
    slips = motion["v_rel"] < -0.05
    assert np.allclose(motion["friction"][slips], -0.7848)
    a = np.gradient(np.gradient(motion["x"], times), times)
    inside = np.convolve(slips, np.ones(9), "same") == 9  # away from stops and starts
    assert np.allclose(a[inside], motion["a"][inside], atol=1e-4)
    for t in (0.5, 7.0, 33.3):
        x, _ = rabinowicz_motion(0.0, t, (0.15, 0.1, 0.8, 2.1, 0.1, 9.81))
        assert motion["x"][round(1000 * t)] == pytest.approx(x, rel=1e-10)


def test_fixed_steps_are_of_order_four() -> None:
    machine = machines.slider_crank(lambda v, _: 0 * v)
    exact = solve(machine, np.array([0.0, 0.02]))["crank"][-1]
    coarse, fine = (abs(fixed_steps(machine, h, 0.02)["crank"][-1] - exact) for h in (4e-3, 2e-3))
    assert coarse / fine == pytest.approx(16, rel=0.1)


def test_the_sled_under_coulomb_friction_is_the_block_on_the_belt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A curve that falls at once from 4 N to 3 N: amplitude and mean are those of `Belt`."""
    jump = SteadyStateLuGre(F_S=4.0, F_C=3.0, v_s=1e-11, sigma_2=0.0)
    monkeypatch.setitem(sled.PRINTED, "jump", jump)
    Z, speed = 50.0, 600.0
    (amplitude,), (mean,) = sled.swept("jump", (Z, 0.0), np.array([speed]))
    belt = Belt(m=1.0, k=Z**2, v_belt=speed / 60e3, F_S=4.0, F_C=3.0)
    times = np.linspace(0.0, 1.0, 100001)
    force = Z**2 * belt.motion(times)["x"]
    first, last = (belt.leaves[k] for k in (1, -2))
    whole = (times >= first) & (times <= last)
    assert amplitude == pytest.approx(2 * np.hypot(1.0, Z * speed / 60e3), rel=1e-5)
    assert amplitude == pytest.approx(np.ptp(force[whole]), rel=1e-5)
    assert mean == pytest.approx(np.mean(force[whole]), rel=1e-4)


def test_a_slack_wire_does_not_push() -> None:
    """A heavy sled under the main study's curve overtakes the wire."""
    _, force = sled.cycle("main", (300.0, 0.0), 500 / 60e3)
    assert force.min() == 0.0
    assert np.mean(force == 0.0) > 0.1


def test_bristle_is_damped_before_it_slides_and_holds_its_level_after() -> None:
    v, level = 1e-3, 2.0
    z, damped = bristle(np.array(0.0), v, 1e-12, level)
    assert damped == pytest.approx(SIGMA_1 * v, rel=1e-3)
    assert z == pytest.approx(v * 1e-12, rel=1e-3)
    z, slides = bristle(np.array(0.0), -v, 1e6, level)
    assert slides == pytest.approx(SIGMA_0 * z) == pytest.approx(-level)
