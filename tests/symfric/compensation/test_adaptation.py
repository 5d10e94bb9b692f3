"""Compensators that adapt in closed loops, estimates along records, and bad input."""

from dataclasses import replace

import numpy as np
import pytest
from slides import BRISTLES, CURVE, MAKE, NOISE, STATIC, H, slid

import symfric as sf
from symfric.compensation import (
    Cascade,
    Comparison,
    close_loop,
    compensator,
    follow,
    recursive_estimator,
    sine,
)

CONTROLLER = Cascade(kp=20.0, kv=60.0, ki=10.0)
COMPENSATOR = compensator(BRISTLES, v_blend=0.02, error_gain=20.0, offset=0.0, without=["stribeck"])
COUNTS = 1e-6 / H / np.sqrt(6)
"""Deviation of the velocity from an encoder of 1 um."""


def worn(make, t_end: float, **settings) -> tuple[Comparison, np.ndarray]:
    """Loops whose friction doubles, with an estimator and with the true level at each sample."""
    plant = sf.drive(
        sf.LuGre(sigma_0=2e5, sigma_1=400.0, **CURVE), m=1.0, N=1.0, free=["mu_s", "mu_d"]
    )
    reference = sine(0.02, 0.5, t_end)
    true = 1 + reference.t / t_end
    levels = {"p": {"mu_s": 6.0 * true, "mu_d": 4.0 * true}, "controller": CONTROLLER}
    right = close_loop(
        plant, reference, COMPENSATOR, cases={"right": {"scale_coulomb": true}}, **levels
    )
    estimator = make(BRISTLES, mass=1.0, noise=COUNTS)
    found = close_loop(plant, reference, COMPENSATOR, estimator=estimator, **levels, **settings)
    return replace(found, loops=dict(found.loops) | {"right": right["right"]}), true


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKE)
def test_friction_that_doubles_within_a_minute_is_followed(make) -> None:
    """The RMS error is 1.2 (recursive) and 1.1 (filter) times that with the true levels."""
    found, true = worn(make, 60.0)
    loop = found["compensated"]
    assert loop.rms < 1.5 * found["right"].rms
    error = (loop.estimates["scale_coulomb"] - true)[5000:]
    assert np.abs(error).max() < 0.25
    assert (np.abs(error) < 2 * loop.estimates["scale_coulomb_sd"][5000:]).mean() > 0.95
    assert loop.status == 0


@pytest.mark.parametrize("make", MAKE[1:])
def test_the_loop_in_the_vm_has_the_bits_of_that_in_c(make, compiler) -> None:
    del compiler
    one, other = (worn(make, 0.3, backend=b)[0]["compensated"] for b in ("c", "vm"))
    assert (one.x == other.x).all()
    for name, row in one.estimates.items():
        assert (row == other.estimates[name]).all()


@pytest.mark.parametrize("make", MAKE)
def test_what_a_record_determines_is_said_before_the_estimator_starts(make) -> None:
    """Nothing at rest; a sum at one speed; all in sliding in both directions."""
    block, one = make(BRISTLES, mass=1.0, noise=NOISE), np.ones(4000)
    rest = follow(block, 2.0 * one, 0.0 * one)
    assert rest.rank == 0
    assert len(rest.unobservable) == 3
    steady = follow(block, 6.0 * one, 0.1 * one)
    assert steady.rank == 1
    motion = slid(STATIC, 4000, share=1.5)
    full = follow(block, motion["force"], motion["v"])
    assert full.rank == 3
    assert full.unobservable == ()
    assert "determine all 3 parameters" in full.verdict
    forward = np.abs(motion["v"]) + 0.05
    force = np.diff(np.append(0.0, forward)) / H + 4.0 + 20.0 * forward
    one_way = follow(
        block, force, forward, learn=1.0 * (np.arange(4000) > 100)
    )  # without the start
    assert one_way.rank == 2
    assert "slide in both directions" in one_way.verdict
    assert "offset" in one_way.unobservable[0]


def test_the_information_of_a_record_is_the_gramian_of_its_regressors(tmp_path) -> None:
    """Without forgetting: sum of phi phi'/R over the windows that are used, and its rank."""
    block = recursive_estimator(STATIC, mass=1.0, noise=1e-4, accuracy=0.2, window=20 * H)
    motion = slid(STATIC, 3000)
    found = follow(block, motion["force"], motion["v"])
    v, spread = motion["v"], np.array([1.0, 1.0, 6.0])
    law = np.array([float(STATIC.force(x, 1.0)) for x in v]) - 20.0 * v
    phi = spread * np.column_stack([law, 20.0 * v, np.ones(v.size)])
    rows = phi.reshape(-1, 20, 3).mean(axis=1)[found.used[19::20]]
    gramian = rows.T @ rows / (0.2**2 + 2 * (1e-4 / (20 * H)) ** 2)
    assert found.information == pytest.approx(gramian, rel=1e-3)
    assert found.rank == np.linalg.matrix_rank(rows)
    assert found.condition == pytest.approx(np.linalg.cond(gramian), rel=1e-2)
    found.plot(path=tmp_path / "estimates.png")
    assert (tmp_path / "estimates.png").stat().st_size > 1000
