"""Verdict and intervals of a task that was solved: a decay with noise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from linear_fits import STEP, Decay, ar1, coulomb, fitted, motion, solved
from tables import sampled

from identification.data.findings import Finding, Findings
from identification.residuals.evaluation import THRESHOLD
from identification.unknowns.spec import Unknown
from identification.verdict.covariance import Covariance, Levels, covariance
from identification.verdict.judge import judge
from identification.verdict.minimum import Minimum, minimum
from identification.verdict.profile import Profile, profile
from symfric.foundation.status import Status

T = STEP * np.arange(300)
TRUE = 2.0 * np.exp(-T / 1.5) + 0.3


def least(y: np.ndarray, loss: str = "squares") -> Minimum:
    """The minimum of a fit of a decay to `y`."""
    return minimum(*solved(Decay(T, y), loss=loss))


def test_right_model_is_good() -> None:
    verdict = judge(least(TRUE + 0.02 * ar1(300, 0.0, 1)))
    assert verdict.good
    assert verdict.status(Status.SOLVED) is Status.SOLVED
    assert verdict.status(Status.MAX_ITERATIONS, gain=0.05) is Status.MAX_ITERATIONS
    assert verdict.effective == {"x": 300.0}


def test_coloured_noise_alone_is_not_doubtful_and_widens() -> None:
    found = least(TRUE + 0.02 * ar1(300, 0.9, 1))
    verdict, errors = judge(found), covariance(found)
    assert verdict.good
    assert any("not white" in s for s in verdict.sentences)
    assert (errors.standard_errors > 2 * errors.white_errors).all()


def test_wrong_model_is_doubtful() -> None:
    verdict = judge(least(TRUE + 0.05 * np.sin(T) + 0.02 * ar1(300, 0.0, 1)))
    for solved_as, gain, status in (
        ("SOLVED", np.inf, "DOUBTFUL"), ("MAX_ITERATIONS", np.inf, "MAX_ITERATIONS"),
        ("MAX_ITERATIONS", 0.05, "DOUBTFUL"), ("MAX_ITERATIONS", 0.5, "MAX_ITERATIONS"),
        ("NO_DESCENT", 0.05, "NO_DESCENT"),
    ):  # fmt: skip
        assert verdict.status(Status[solved_as], gain) is Status[status]
    assert any("past of force" in s for s in verdict.sentences)


@pytest.mark.parametrize(("noise", "at_bound", "good"), [
    (2.8, False, False), (1.2, True, False), (1.2, False, True), (0.5, True, True),
])  # fmt: skip
def test_a_fit_that_explains_little_is_doubtful_even_if_what_is_left_is_white(
    noise: float, at_bound: bool, good: bool
) -> None:
    """Noise of s spreads of the signal leaves s / sqrt(1 + s^2): 94 %, 77 %, 45 % of it."""
    found = least(TRUE + noise * np.std(TRUE) * ar1(300, 0.0, 1))
    held = np.arange(found.held.size) == (0 if at_bound else -1)
    verdict = judge(replace(found, held=held))
    assert not verdict.nonsense
    assert verdict.status(Status.SOLVED) is (Status.SOLVED if good else Status.DOUBTFUL)
    reported = " ".join(verdict.sentences)
    assert ("unexplained" in reported and "lower cut-off" in reported) == (noise > 1 and not good)
    assert ("at a bound" in reported.lower()) == at_bound


def test_no_physics_is_implausible() -> None:
    noise = ar1(300, 0.0, 1)
    verdict = judge(least(noise))
    assert verdict.status(Status.SOLVED) is Status.IMPLAUSIBLE
    assert "unexplained" in verdict.sentences[0]
    found = least(TRUE + 0.02 * noise)
    error = Finding("frozen", 0, "x", "x stands still.", 1.0, 2.0, "error")
    assert judge(found, Findings((error,))).nonsense == ("x stands still.",)
    assert judge(found, Findings((replace(error, severity="warning"),))).good


@pytest.mark.parametrize("loss", sampled(["squares", "cauchy", "huber"], of=2))
def test_robust_losses_have_the_errors_of_their_influence(loss: str) -> None:
    """Scatter over seeds, a twentieth of the samples far off."""
    found, errors = list[float](), list[float]()
    for seed in range(16):
        r = np.random.default_rng(1000 + seed)
        noise = np.where(r.random(300) < 0.05, 20.0, 1.0) * ar1(300, 0.0, seed)
        one = least(TRUE + 0.01 * noise, loss)
        found.append(float(one.values[2]))
        errors.append(float(covariance(one).standard_errors[2]))
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(found), rel=0.35)


def profiled(rows: slice, noise: np.ndarray, name: str) -> tuple[Profile, Covariance]:
    task, point = solved(Decay(T[rows], TRUE[rows] + noise))
    linear = covariance(minimum(task, point))
    return profile(task, point, linear, name), linear


def test_profile_agrees_with_its_linear_interval_where_the_model_is_linear() -> None:
    found, linear = profiled(slice(300), 0.02 * ar1(300, 0.9, 1), "b")
    width = (linear.high - linear.low)[linear.names.index("b")]
    assert found.high - found.low == pytest.approx(width, rel=0.15)
    assert found.sentences == ()
    assert found.plot().axes


def test_profile_is_crooked_where_the_model_is() -> None:
    """A record of a third of the time constant: it may be far longer, not far shorter."""
    found, _ = profiled(slice(25), 0.05 * ar1(25, 0.0, 4), "tau")
    assert found.high is None and found.low is not None
    assert "tau is open above" in found.sentences[0]
    rise = found.rise[found.values > found.best]
    assert (np.diff(rise) > -1e-6).all()
    with pytest.raises(ValueError, match="profile: name"):
        profiled(slice(25), 0.05 * ar1(25, 0.0, 4), "c")


def test_no_mass_is_no_physics() -> None:
    names = (("m", "kg"), ("c", "N"), ("d", "N s/m"), ("offset", "N"))
    unknowns = tuple(Unknown(n, unit, 1.0, 0.0, 5.0) for n, unit in names)
    J = coulomb(300)
    made = fitted(J, J @ [2.0, 3.0, 1.0, 0.5] + ar1(300, 0.0, 1), unknowns)
    held = np.array([True, False, False, False])
    least, most = (replace(made, values=made.values * 0 + m, held=held) for m in (0.0, 5.0))
    assert "m is at its lower bound, 0 kg" in judge(least).nonsense[0]
    assert judge(most).nonsense == judge(made).nonsense == ()
    other = replace(least, held=np.array([False, True, False, False]))
    assert judge(other).nonsense == ()


def test_outliers_tell_nothing_of_where_the_others_lie() -> None:
    """Of Huber's loss the influence function rises for as many as lie within its threshold."""
    noise = ar1(300, 0.0, 1) + np.where(np.arange(300) % 10 == 0, 20.0, 0.0)
    task, point = solved(Decay(T, TRUE + 0.01 * noise), loss="huber")
    inside = np.abs(point.r) < THRESHOLD["huber"]
    assert 0.5 < np.mean(inside) < 0.9
    np.testing.assert_allclose(minimum(task, point).gain, np.mean(inside), atol=0.01)


def test_few_effective_samples_are_doubtful() -> None:
    """A walk is worth a few samples: slow noise and a model error look alike."""
    found = judge(fitted(coulomb(200), np.cumsum(np.cumsum(ar1(200, 0.5, 2)))))
    assert any("samples for 4 unknowns" in s for s in found.sentences)
    assert not found.good


@pytest.mark.parametrize("rho", sampled([0.9, 0.0], of=2))
@pytest.mark.parametrize(
    ("missing", "named"),
    [
        (lambda J, t, m: J[:, 2] * t, "time"),
        (lambda J, t, m: J[:, 1] * np.cos(100 * m["x"]), "position"),
        (lambda J, t, m: np.gradient(J @ [2.0, 3.0, 1.0, 0.5]), "rate"),
    ],
)
def test_slow_model_errors_are_found_although_they_look_like_coloured_noise(
    missing: Callable[..., np.ndarray], named: str, rho: float
) -> None:
    """Viscous friction that drifts, an uneven track, and a delay of one sample."""
    J = coulomb(2000)
    error = missing(J, STEP * np.arange(2000), motion(2000))
    level = 3 * np.std(ar1(2000, rho, 1)) / np.std(error)
    found = judge(fitted(J, J @ [2.0, 3.0, 1.0, 0.5] + ar1(2000, rho, 1) + level * error))
    failed = {t.name for t in found.tests if t.decides and not t.passed}
    assert f"independence of the {named}" in {name[: 20 + len(named)].rstrip() for name in failed}


def test_a_law_far_beyond_the_measured_forces_is_doubtful() -> None:
    found = least(TRUE + 0.02 * ar1(300, 0.0, 1))
    assert judge(found, None, Levels({}, 100.0, "N", 250.0)).good
    far = judge(found, None, Levels({}, 100.0, "N", 9000.0))
    assert not far.good
    assert "reaches 9e+03 N" in far.sentences[0]


def test_a_right_model_of_a_noisy_signal_is_physics() -> None:
    right = (J := coulomb(1000)) @ [2.0, 3.0, 1.0, 0.5]
    assert judge(fitted(J, right + 2 * np.std(right) * ar1(1000, 0.0, 1))).good


def test_a_twentieth_of_the_variance_is_no_other_model() -> None:
    J, m = coulomb(1500), motion(1500)
    right = J @ [2.0, 3.0, 1.0, 0.5] + ar1(1500, 0.0, 1)
    little, much = (judge(fitted(J, right + a * np.roll(m["force"], 8))) for a in (0.25, 1.0))
    assert little.good
    assert any(t.decides and t.p < t.limit for t in little.tests)
    assert not much.good


def test_a_narrow_profile_shows_the_digits_that_tell_its_ends_apart() -> None:
    none = np.zeros(0)
    made = Profile("k", "N/m", 4e9, none, none, none, (), 4.0, 3.99979e9, 4.00022e9, False, ())
    assert str(made) == "k: 4e+09 N/m, 95 %: 3.99979e+09 to 4.00022e+09."
