"""Long records: one evaluation of linear laws, blocks that agree with the whole, verdicts."""

import tracemalloc
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from identification import Dataset, Fit, Fitted, InverseDynamics, Points
from identification.data import filters
from identification.data.filters import lowpass, spectrum
from identification.data.record import LONG
from identification.residuals import inverse
from identification.residuals.inverse import InverseRows
from identification.residuals.points import PointRows
from identification.result.parts import expanded
from symfric.foundation.status import Status

Array = NDArray[np.float64]
STEP, M, NOISE = 1e-3, 2.0, 0.05
TRUTH = {"m": M, "mu_d": 5.0, "sigma_2": 3.0}


def stage(n: int, seed: int = 0, peak: float = 0.0, late: int = 0) -> Dataset:
    """Return a drive with Coulomb and viscous friction, and a Stribeck peak [N] at 0.02 m/s."""
    t, rng = STEP * np.arange(n), np.random.default_rng(seed)
    w, size = np.array([[np.pi], [3.1 * np.pi]]), np.array([[0.05], [0.02]])
    x = np.sum(size * np.sin(w * t), axis=0)
    v, a = np.sum(size * w * np.cos(w * t), axis=0), -np.sum(size * w**2 * np.sin(w * t), axis=0)
    level = TRUTH["mu_d"] + peak * np.exp(-((v / 0.02) ** 2))
    force = M * a + level * np.sign(v) + TRUTH["sigma_2"] * v
    force = np.roll(force, late) + NOISE * rng.standard_normal(n)
    return Dataset.of(t=t, x=x, v=v, force=force)


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that receives the number of rows of each evaluation."""
    found, old = list[int](), InverseRows.blocks

    def blocks(self: InverseRows, p: Array, own: Array) -> Iterator[tuple[Array, Array] | str]:
        found.append(self.channels[-1].rows.stop)
        yield from old(self, p, own)

    monkeypatch.setattr(InverseRows, "blocks", blocks)
    return found


def test_a_linear_law_is_evaluated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = counted(monkeypatch)
    fit = Fit(InverseDynamics(), "coulomb+viscous", stage(LONG)).solve()
    assert (len(calls), len(fit.starts), fit.status) == (1, 1, Status.SOLVED)
    for name, value in TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-3)
    assert gauss_newton(fit) < 1e-2


def gauss_newton(fit: Fitted) -> float:
    """Return the largest change of a coordinate in a Gauss-Newton step, in standard errors."""
    assert fit.live is not None
    r, J = fit.live.point.r, fit.live.point.J
    step = np.linalg.lstsq(J, r, rcond=None)[0]
    return float(np.abs(step / np.sqrt(np.diag(np.linalg.inv(J.T @ J)))).max())


def test_linear_points_are_those_of_least_squares() -> None:
    rng = np.random.default_rng(0)
    v = rng.uniform(-1.0, 1.0, 2 * LONG)
    F = 5 * np.sign(v) + 3 * v + 0.1 * rng.standard_normal(v.size)
    fit = Fit(Points(), "coulomb+viscous", Dataset.of(v=v, F=F, points=True)).solve(throw=False)
    expected = np.linalg.lstsq(np.column_stack([np.sign(v), v]), F, rcond=None)[0]
    assert [fit.values["mu_d"], fit.values["sigma_2"]] == pytest.approx(expected, rel=5e-3)
    assert len(fit.starts) == 1 and gauss_newton(fit) < 1e-2


@pytest.mark.slow
def test_a_nonlinear_law_is_searched_on_part_of_the_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = counted(monkeypatch)
    fit = Fit(InverseDynamics(), "stribeck", stage(3 * LONG, peak=2.0)).solve(throw=False)
    whole = [rows for rows in calls if rows == max(calls)]
    assert max(calls) > LONG and max(r for r in calls if r != whole[0]) <= inverse.PART
    assert len(whole) <= 8
    assert gauss_newton(fit) < 1e-2


def test_the_part_has_rows_of_the_whole() -> None:
    rng = np.random.default_rng(1)
    v = rng.uniform(-1.0, 1.0, 3 * LONG)
    curve = Dataset.of(v=v, F=v + np.sign(v), points=True)
    for kind, data in ((InverseDynamics(), stage(5 * LONG // 2)), (Points(), curve)):
        asked = Fit(kind, "stribeck", data).prepared()
        rows = asked.task.residuals
        part = asked.task.part.residuals
        assert isinstance(part, InverseRows | PointRows) and isinstance(rows, type(part))
        values = asked.task.unknowns.values(asked.centre)
        whole, some = rows.at(values), part.at(values)
        assert not isinstance(whole, str) and not isinstance(some, str)
        known = {row.tobytes(): i for i, row in enumerate(whole.J)}
        at = np.array([known[row.tobytes()] for row in some.J])
        assert np.array_equal(rows.channels[0].measured[at], part.channels[0].measured)
        assert 0.1 * inverse.PART < at.size <= LONG and np.ptp(at) > 0.8 * len(known)


def test_white_noise_of_the_force_gives_no_dead_time() -> None:
    """Interpolation between samples attenuates the noise and must not look like a better fit."""
    fit = Fit(InverseDynamics(), "stribeck", stage(15_000, 1, peak=2.0)).solve(throw=False)
    assert fit.status is Status.SOLVED
    assert abs(fit.values.get("dead_time[0]", 0.0)) < 0.05 * STEP
    assert fit.values["m"] == pytest.approx(M, rel=5e-4)


def test_blocks_of_the_filter_agree_with_one_transform(monkeypatch: pytest.MonkeyPatch) -> None:
    y = np.cumsum(np.random.default_rng(2).standard_normal(3 * LONG)) * 1e-3
    long, level = lowpass(y, 20.0, STEP), spectrum(np.diff(y)).mean()
    monkeypatch.setattr(filters, "LONG", 10 * LONG)
    np.testing.assert_allclose(long, lowpass(y, 20.0, STEP), atol=1e-9)
    assert level == pytest.approx(1e-6, rel=0.02)


@pytest.mark.slow
def test_memory_of_a_fit_is_bounded_for_each_row() -> None:
    data = stage(2 * LONG)
    tracemalloc.start()
    try:
        Fit(InverseDynamics(), "coulomb+viscous", data).solve()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak / data.size < 700


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_verdicts_of_long_records(seed: int) -> None:
    """Right laws are solved; a missing Stribeck peak of 10 % and a late force are found."""
    kind, n = InverseDynamics(), 3 * LONG // 2
    assert Fit(kind, "coulomb+viscous", stage(n, seed)).solve().status is Status.SOLVED
    assert Fit(kind, "stribeck", stage(n, seed, peak=2.0)).solve().status is Status.SOLVED
    wrong = Fit(kind, "coulomb+viscous", stage(n, seed, peak=0.5)).solve(throw=False)
    assert wrong.status is Status.DOUBTFUL
    late = Fit(kind, "coulomb+viscous", stage(n, seed, late=2)).solve(throw=False)
    assert late.values["dead_time[0]"] == pytest.approx(-2e-3, abs=2e-4)
    assert late.values["sigma_2"] == pytest.approx(TRUTH["sigma_2"], rel=0.01)


def test_small_dead_times_enter_linearly() -> None:
    """The residuals linear in the dead time against those of the interpolated force."""
    asked = Fit(InverseDynamics(), "coulomb+viscous", stage(20_000)).prepared()
    rows = asked.task.residuals
    assert isinstance(rows, InverseRows)
    exact, late = rows.delayed(0.0, 5e-3), 2e-5
    small = expanded(exact)
    assert small.names == exact.names and small.linear and not exact.linear
    values = np.append(asked.task.unknowns.values(asked.centre), late)
    one, two = exact.at(values), small.at(values)
    assert not isinstance(one, str) and not isinstance(two, str)
    change = np.sqrt(np.mean((late * one.J[:, -1]) ** 2))
    assert np.sqrt(np.mean((one.r - two.r) ** 2)) < 0.05 * change
