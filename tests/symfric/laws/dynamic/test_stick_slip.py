"""Stick-slip law of Cha: holds loads, slips at the velocity law, dip of the published branch."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import drive, simulate
from symfric.laws import StickSlip, VelocityBased

LOAD = 7.848


@given(v=st.floats(1e-3, 0.1), D=st.floats(-1.5e-6, 1.5e-6))
def test_in_slip_the_force_is_that_of_the_velocity_law(v: float, D: float) -> None:
    z = np.array([D])
    expected = LOAD * (0.15 if v <= 1e-3 else 0.1 if v >= 1.5e-3 else np.nan)
    if np.isfinite(expected):
        assert StickSlip().force(v, LOAD, z) == pytest.approx(expected, rel=1e-12)
        assert StickSlip().force(-v, LOAD, z) == pytest.approx(-expected, rel=1e-12)
    law = VelocityBased()
    assert abs(law.force(v, LOAD)) <= 0.15 * LOAD * (1 + 1e-12)


@pytest.mark.parametrize("share", [0.5, 0.99])
@pytest.mark.parametrize("branch", ["plateau", "published"])
def test_slowly_applied_load_is_held(share: float, branch: str) -> None:
    top = share * 0.15 * LOAD
    # the spring at rest is undamped: load within many periods of 4 ms
    pull = {"force": lambda t: ca.fmin(t, 1) ** 2 * (3 - 2 * ca.fmin(t, 1)) * top}
    run = simulate(drive(StickSlip(branch=branch)), 3.0, u=pull, rtol=1e-8)
    assert abs(run.final["x"]) < 2e-6
    assert np.abs(run["v"]).max() < 1e-4


def test_load_above_the_static_level_breaks_away() -> None:
    run = simulate(drive(StickSlip()), 1.0, u={"force": 1.05 * 0.15 * LOAD}, rtol=1e-8)
    assert run.final["v"] > 0.1


def test_published_branch_dips_below_the_static_level_and_the_plateau_does_not() -> None:
    v, full = np.linspace(1e-5, 1e-3, 1001), np.array([1e-6])
    published, plateau = (
        np.array([StickSlip(branch=b).force(x, LOAD, full) for x in v])
        for b in ("published", "plateau")
    )
    assert published.min() < 0.9 * 0.15 * LOAD
    assert plateau == pytest.approx(0.15 * LOAD, rel=1e-12)


def test_deformation_is_forgotten_in_slip() -> None:
    assert StickSlip().rate(0.1, LOAD, np.array([1e-6]))[0] == pytest.approx(-0.1)
    assert StickSlip().rate(1e-5, LOAD, np.array([0.0]))[0] == pytest.approx(1e-5, rel=1e-4)
