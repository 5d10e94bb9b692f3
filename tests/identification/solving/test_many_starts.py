"""Weighted least squares from many starts against closed forms, counts and other processes."""

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from identification.residuals.evaluation import THRESHOLD, Channel, Evaluation, shaped
from identification.solving.descent import Start, best_of, descend, many_starts
from identification.solving.task import Task, is_white, objective, task, triangle
from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import unknowns_of
from symfric.foundation.status import SolveError, Status

Array = NDArray[np.float64]


@dataclass(eq=False)
class Decay:
    """y = a exp(-b t) + c, measured twice: as it is, and three times as large with other noise."""

    y: Array
    z: Array
    calls: int = 0
    limit: float = 50.0
    interrupt: int = 0
    squares: list[float] = field(default_factory=list[float])

    names: ClassVar[tuple[str, ...]] = ("a", "b", "c")
    own: ClassVar[tuple[Unknown, ...]] = ()

    @property
    def t(self) -> Array:
        return np.linspace(0, 4, self.y.size)

    @property
    def channels(self) -> tuple[Channel, ...]:
        n = self.y.size
        first = Channel(0, "y", "m", slice(0, n), self.t, self.y, {})
        if not self.z.size:
            return (first,)
        return first, Channel(0, "z", "m", slice(n, 2 * n), self.t, self.z, {})

    def at(self, values: Array) -> Evaluation | str:
        self.calls += 1
        if self.interrupt and self.calls >= self.interrupt:
            raise KeyboardInterrupt
        a, b, c = values
        self.squares.append(np.inf)
        if b > self.limit:
            return f"b = {b:g} cannot be simulated"
        e = np.exp(-b * self.t)
        J = np.stack([e, -a * self.t * e, np.ones_like(e)], axis=1)
        r = a * e + c
        self.squares[-1] = float(np.sum((r - self.y) ** 2))
        if not self.z.size:
            return Evaluation(r - self.y, J)
        return Evaluation(np.concatenate([r - self.y, 3 * r - self.z]), np.vstack([J, 3 * J]))


TRUTH = np.array([2.0, 1.5, 0.3])
UNKNOWNS = [
    Unknown("a", "m", 1.0, 0.0, np.inf),
    Unknown("b", "1/s", 0.1, logarithmic=True),
    Unknown("c", "m", 0.0),
]


def decay(seed: int = 0, noise: float = 0.01, other: float | None = None, n: int = 400) -> Decay:
    rng = np.random.default_rng(seed)
    y = 2 * np.exp(-1.5 * np.linspace(0, 4, n)) + 0.3
    z = np.zeros(0) if other is None else 3 * y + other * rng.standard_normal(n)
    return Decay(y + noise * rng.standard_normal(n), z)


def problem(residuals: Decay, **given: object) -> Task:
    return task(residuals, unknowns_of(UNKNOWNS, {}, Decay.names), **given)  # pyright: ignore[reportArgumentType]


def starts(at: Task, count: int = 6) -> list[Array]:
    rng = np.random.default_rng(0)
    first = at.unknowns.start
    return [first, *(first + rng.uniform(-2, 2, 3) for _ in range(count - 1))]


def down(at: Task, **how: Any) -> Start:
    return descend(at, at.unknowns.start, **how)


def made(names: tuple[str, ...], channel: Channel, at: Callable[..., object]) -> Any:
    """Residuals of a function."""
    return SimpleNamespace(names=names, own=(), channels=(channel,), at=at)


def test_the_triangle_has_the_cost_and_the_normal_equations_of_all_rows() -> None:
    rng = np.random.default_rng(0)
    for rows, k in ((5000, 7), (3, 7), (900, 60)):
        A = rng.standard_normal((rows, k))
        R = triangle(A)
        assert R.shape == (k, k)
        assert pytest.approx(A.T @ A, abs=1e-10 * rows) == R.T @ R


@pytest.mark.parametrize("loss", list(THRESHOLD))
def test_loss_has_its_own_derivative_and_leaves_small_residuals_alone(loss: str) -> None:
    r = np.array([-30.0, -2.0, -1e-3, 1e-9, 0.4, 1.344, 1.346, 8.0])
    e, slope = shaped(r, loss)
    h = 1e-6
    numeric = (shaped(r + h, loss)[0] - shaped(r - h, loss)[0]) / (2 * h)
    assert slope == pytest.approx(numeric, rel=1e-4)
    assert e[2:4] == pytest.approx(r[2:4], rel=1e-4)
    if loss != "squares":
        assert abs(e[0]) < 30


def test_gradient_and_cost_are_those_of_the_rows() -> None:
    at = problem(decay(other=0.5), loss="cauchy")
    w = at.unknowns.start
    point = at.at(w)
    f, J = point.reduced
    assert f @ f == pytest.approx(point.cost)
    h = 1e-6
    for i, step in enumerate(np.eye(3) * h):
        above, below = at.at(w + step), at.at(w - step)
        assert 2 * (J.T @ f)[i] == pytest.approx((above.cost - below.cost) / (2 * h), rel=1e-5)


def test_one_signal_is_fitted_as_by_linear_algebra_at_its_minimum() -> None:
    at = problem(decay())
    end = best_of(many_starts(at, starts(at)))
    assert end.status is Status.SOLVED
    point = at.at(end.w)
    step = np.linalg.lstsq(point.J, point.r, rcond=None)[0]
    error = np.sqrt(np.diag(np.linalg.inv(point.J.T @ point.J))) * np.std(point.r)
    assert np.all(np.abs(step) < 2e-3 * error)
    assert end.noise["y"] == pytest.approx(0.01, rel=0.1)


def test_a_noisy_signal_never_makes_the_estimate_worse() -> None:
    alone, both = np.zeros((2, 12, 3))
    for seed in range(12):
        one, two = decay(seed), decay(seed, other=3.0)
        two.y = one.y
        for found, data in ((alone, one), (both, two)):
            at = problem(data)
            found[seed] = at.unknowns.values(down(at).w) - TRUTH
    worse = np.sqrt((both**2).mean(axis=0) / (alone**2).mean(axis=0))
    assert worse.max() < 1.1


@pytest.mark.parametrize(("given", "z"), [("estimate", 1.0), ({"z": 0.5}, 0.5)])
def test_noise_levels_are_given_or_those_of_the_data(given: object, z: float) -> None:
    end = down(problem(decay(other=1.0), noise=given))
    assert end.noise == pytest.approx({"y": 0.01, "z": z}, rel=0.1)
    assert end.noise["z"] == 0.5 or given == "estimate"


def test_data_without_noise_are_fitted_to_rounding() -> None:
    at = problem(decay(noise=0.0))
    end = down(at)
    assert end.status is Status.SOLVED
    assert at.unknowns.values(end.w) == pytest.approx(TRUTH, rel=1e-7)


def test_outliers_hardly_move_a_robust_fit() -> None:
    data = decay()
    data.y[::25] += 1.0
    errors = {}
    for loss in ("squares", "huber", "cauchy"):
        at = problem(data, loss=loss)
        errors[loss] = np.abs(at.unknowns.values(down(at).w) - TRUTH).max()
        if loss != "squares":
            assert down(at).noise["y"] == pytest.approx(0.01, rel=0.2)
    assert errors["huber"] < errors["squares"] / 5
    assert errors["cauchy"] < errors["squares"] / 5


def test_a_trial_that_cannot_be_simulated_shortens_the_step() -> None:
    data = decay()
    data.limit = 1.6
    at = problem(data)
    end = descend(at, at.unknowns.of({"a": 1.0, "b": 0.02, "c": 0.0}))
    assert np.inf in data.squares
    assert at.unknowns.values(end.w) == pytest.approx(TRUTH, rel=0.05)


def test_a_start_without_residuals_is_reported_and_others_continue() -> None:
    data = decay()
    at = problem(data)
    bad = at.unknowns.of({"a": 1.0, "b": 1e3, "c": 0.0})
    first, second = many_starts(at, [bad, at.unknowns.start])
    assert first.status is Status.NOT_FINITE and "cannot be simulated" in first.message
    assert second.status is Status.SOLVED


def test_evaluations_are_counted_and_limited() -> None:
    data = decay()
    at = problem(data)
    end = down(at, evaluations=3)
    assert end.status is Status.MAX_ITERATIONS
    assert end.evaluations == data.calls == 3
    (more,) = many_starts(at, [at.unknowns.start], evaluations=3)
    assert 3 < more.evaluations <= 6
    assert more.cost < end.cost


def test_an_interruption_keeps_the_best_so_far() -> None:
    data = decay()
    data.interrupt = 5
    at = problem(data)
    (end,) = many_starts(at, starts(at))
    assert end.status is Status.INTERRUPTED
    assert end.cost < np.inf and data.calls == 5


def test_an_interruption_between_starts_is_reported_for_the_best() -> None:
    at = problem(decay())
    bad = at.unknowns.of({"a": 1.0, "b": 1e3, "c": 0.0})

    def interrupt(text: str, done: float) -> None:
        del text
        if done >= 0.5:
            raise KeyboardInterrupt

    first = many_starts(at, [bad, bad], progress=interrupt)
    assert [s.status for s in first] == [Status.INTERRUPTED]
    good = many_starts(at, [at.unknowns.start, bad], progress=interrupt, agree=0)
    assert [s.status for s in good] == [Status.SOLVED]


def test_any_executor_gives_the_same_bits() -> None:
    at = problem(decay(other=1.0))
    here = many_starts(at, starts(at), agree=0)
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2) as processes:
        for executor in (threads, processes):
            there = many_starts(at, starts(at), executor, agree=0)
            assert [s.number for s in there] == list(range(6))
            for a, b in zip(here, there, strict=True):
                assert (a.w == b.w).all() and a.cost == b.cost


def test_a_worker_that_dies_is_reported() -> None:
    at = problem(decay(other=1.0))
    with (
        ProcessPoolExecutor(1, initializer=os._exit, initargs=(1,)) as dying,  # pyright: ignore
        pytest.raises(SolveError, match=r"fit: a worker process ended after 0 of 6 starts"),
    ):
        many_starts(at, starts(at), dying)


def test_white_residuals_end_the_starts_and_wrong_models_go_on() -> None:
    for wave, count in ((0.0, 1), (0.1, 3)):
        data = decay()
        data.y += wave * np.sin(data.t)
        assert len(many_starts(problem(data), starts(problem(data)))) == count


def test_residuals_that_exist_only_at_the_start_end_there(recwarn: pytest.WarningsRecorder) -> None:
    data = decay()
    at = problem(data)
    first = at.unknowns.start
    data.limit = float(at.unknowns.values(first)[1])  # every trial with a larger b fails

    calls = list[Array]()

    def alone(values: Array) -> object:
        calls.append(values)
        here = np.array_equal(values, at.unknowns.values(first))
        return data.at(values) if here else "nothing here"

    end = descend(task(made(data.names, data.channels[0], alone), at.unknowns), first)
    assert end.status is Status.NO_DESCENT and "nothing here" in end.message
    assert len(calls) < 80
    assert not recwarn.list


def test_a_value_that_drifts_off_ends_at_a_number_one_can_read() -> None:
    """1 - 1 / k of data that lie a little above one: the stiffer the better."""
    y = 1.002 + 0.01 * np.random.default_rng(1).standard_normal(200)
    channel = Channel(0, "x", "m", slice(0, 200), 0.1 * np.arange(200), y, {})
    data = made(
        ("k",), channel, lambda v: Evaluation(1 - 1 / v[0] - y, np.full((200, 1), v[0] ** -2.0))
    )
    for upper, end, noise in (
        (np.inf, 2e12, "estimate"),
        (np.inf, 2e12, {"x": 1e-4}),  # a hundredth of the noise of the data
        (1e10, 1e10, "estimate"),
    ):
        k = Unknown("k", "1", 2.0, lower=0.0, upper=upper, logarithmic=True)
        box = unknowns_of((k,), {}, data.names)
        found = descend(task(data, box, noise), box.of({"k": 1e14}) + 300.0)
        assert found.status is Status.SOLVED
        assert box.values(found.w)[0] == pytest.approx(end, rel=1e-5)
        assert box.values(found.w)[0] < upper
        assert box.at_bound(found.w).all()


def test_noise_levels_count_what_the_fit_has_taken() -> None:
    """Nine samples and three unknowns: without it the mean variance would be two thirds."""
    found = [down(problem(decay(seed, n=9))).noise["y"] for seed in range(60)]
    assert np.mean(np.square(found)) == pytest.approx(1e-4, rel=0.15)


def test_the_objective_is_that_of_the_likelihood() -> None:
    at = problem(decay(other=1.0), noise={"y": 0.02, "z": 3.0})
    point = at.at(at.unknowns.start)
    r = point.evaluation.r
    parts = zip((r[:400], r[400:]), (0.02, 3.0), strict=True)
    expected = -2 * sum(float(norm.logpdf(part, scale=s).sum()) for part, s in parts)
    assert objective(at, point) + 800 * np.log(2 * np.pi) == pytest.approx(expected)


def test_noise_that_skips_its_neighbours_is_not_white() -> None:
    for lag in (1, 2, 4):
        data, e = decay(), np.random.default_rng(1).standard_normal(410)
        data.y = data.y + 0.05 * (e[:400] + e[lag : 400 + lag])
        at = problem(data)
        point = at.at(down(at).w)
        assert not is_white(at, point)


def test_at_a_bound_nothing_is_left_to_gain() -> None:
    box = [UNKNOWNS[0], UNKNOWNS[1], Unknown("c", "m", 0.0, -1.0, 0.2)]
    at = task(decay(), unknowns_of(box, {}, Decay.names))  # pyright: ignore[reportArgumentType]
    end = down(at)
    assert end.status is Status.SOLVED
    assert at.unknowns.at_bound(end.w).tolist() == [False, False, True]


def test_only_starts_that_end_in_the_lowest_minimum_agree() -> None:
    """(p^2 - 1, p - 1) over twenty times, with a wave that nothing explains: minima near -1, 1."""
    t, wave = np.arange(40.0), 0.3 * np.sin(np.arange(40.0))

    def wells(values: Array) -> Evaluation:
        (p,), first = values, t < 20
        r = np.where(first, p**2 - 1, 0.2 * (p - 1)) - wave
        return Evaluation(r, np.where(first, 2 * p, 0.2)[:, None])

    data = made(("p",), Channel(0, "y", "m", slice(0, 40), t, wave, {}), wells)
    at = task(data, unknowns_of([Unknown("p", "m", 2.0)], {}, ("p",)), {"y": 0.1})
    done = many_starts(at, [np.array([p]) for p in (-2.0, 2.0, -2.0, 2.0, 2.0, 2.0)])
    assert [s.status for s in done] == [Status.SOLVED] * 5
    assert [bool(s.w[0] > 0) for s in done] == [False, True, False, True, True]
    assert done[0].cost > done[1].cost + 1


def test_the_end_is_the_best_trial_wherever_the_search_stops() -> None:
    last_is_worse = list[bool]()
    for n in range(3, 8):
        data = decay()
        at = problem(data, noise={"y": 0.01})
        end = descend(at, at.unknowns.of({"a": 20.0, "b": 0.5, "c": -5.0}), evaluations=n)
        assert end.cost == pytest.approx(min(data.squares) / 1e-4, rel=1e-9)
        last_is_worse.append(data.squares[-1] > min(data.squares))
    assert any(last_is_worse)
