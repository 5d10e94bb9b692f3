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


@pytest.mark.parametrize(
    ("make", "law", "chosen", "message"),
    [
        (0, BRISTLES, {"noise": 1e-4}, "mass: expected the moving mass"),
        (0, BRISTLES, {"mass": 1.0}, r"noise: expected the deviation of the velocity.*count /"),
        (0, BRISTLES, {"mass": -1.0, "noise": 1e-4}, "mass: expected a number > 0"),
        (0, BRISTLES, {"mass": 1.0, "noise": 1e-4, "free": ["mu_d"]}, "is linear, got mu_d; take"),
        (1, BRISTLES, {"mass": 1.0, "noise": 1e-4, "free": ["mu"]}, "got mu; did you mean mu_"),
        (1, BRISTLES, {"mass": 1.0, "noise": 1e-4, "free": []}, "have an effect, got none"),
        (1, sf.LuGre(), {"mass": 1.0, "noise": 1e-4, "free": ["scale_viscous"]},
         "have an effect, got scale_viscous without an effect"),
        (1, BRISTLES, {"mass": 1.0, "noise": 1e-4, "spread": {"offset": 0}}, "spread of 'offset'"),
        (1, BRISTLES, {"mass": 1.0, "noise": 1e-4, "bounds": {"offset": (1.0, 2.0)}},
         r"bounds of 'offset': expected \(low, high\) around 0"),
        (1, BRISTLES, {"mass": 1.0, "noises": 1e-4}, "got noises; did you mean noise"),
        (0, sf.Karnopp(), {"mass": 1.0, "noise": 1e-4}, "a law of v and N, got one with F_e"),
    ],
)  # fmt: skip
def test_bad_input_is_refused(make, law, chosen, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        MAKE[make](law, **chosen)


def test_close_loop_refuses_estimators_and_values_that_do_not_fit() -> None:
    plant, reference = sf.drive(BRISTLES, m=1.0, N=1.0, free=["mu_d"]), sine(0.02, 0.5, 0.1)
    estimator = recursive_estimator(BRISTLES, mass=1.0, noise=COUNTS, free=["inertia"])
    with pytest.raises(ValueError, match="expected outputs that are parameters of blocks, got ine"):
        close_loop(plant, reference, COMPENSATOR, estimator=estimator)
    with pytest.raises(ValueError, match="mu_d: expected a number or 100 values"):
        close_loop(plant, reference, COMPENSATOR, p={"mu_d": np.ones(99)})
    with pytest.raises(ValueError, match="p: expected"):
        close_loop(plant, reference, COMPENSATOR, p={"mu_x": np.ones(100)})


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


def test_follow_refuses_bad_records() -> None:
    block, one = recursive_estimator(STATIC, mass=1.0, noise=1e-4, h=H), np.ones(10)
    for arguments, message in (
        ((COMPENSATOR, one, one), "expected the block of an estimator"),
        ((block, one, one[:5]), "expected force and v of one length >= 2, got 10 and 5"),
        ((block, one, np.nan * one), "v: expected finite numbers, got nan at 0"),
    ):
        with pytest.raises(ValueError, match=message):
            follow(*arguments)
    with pytest.raises(ValueError, match=r"h: expected that of the block, 0\.001 s, got 0\.01"):
        follow(block, one, one, h=0.01)
    with pytest.raises(ValueError, match="learn: expected a number or 10 numbers"):
        follow(block, one, one, learn=one[:5])
