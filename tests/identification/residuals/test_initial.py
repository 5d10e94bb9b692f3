"""Windows of records, the choice of their length, and start values from samples."""

from collections.abc import Mapping

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.initial import Sensed, cut, local, noise_of, rates
from identification.residuals.shooting import Shooting, choose
from identification.unknowns.subject import subject
from symfric import LuGre, Model
from symfric.foundation.parameters import Variable
from symfric.scenes import Drive, SliderCrank

T = np.linspace(0.0, 2.0, 401)


@pytest.mark.parametrize("k", [0, 7, 200, 400])
def test_a_cubic_is_met_exactly(k: int) -> None:
    y = 1 - 2 * T + 3 * T**2 - T**3
    found = local(T, y, k, 0.0)
    assert found.value == pytest.approx(y[k], abs=1e-9)
    assert found.rate == pytest.approx(-2 + 6 * T[k] - 3 * T[k] ** 2, abs=1e-7)


@pytest.mark.parametrize("k", [0, 200])
def test_errors_are_as_large_as_they_say(k: int) -> None:
    noise, rng = 1e-3, np.random.default_rng(0)
    errors = list[float]()
    for _ in range(200):
        y = np.sin(2 * T) + noise * rng.standard_normal(T.size)
        found = local(T, y, k, noise)
        errors.append((found.rate - 2 * np.cos(2 * T[k])) / found.rate_error)
    assert 0.7 < np.std(errors) < 1.5


def test_noise_is_seen_behind_a_motion() -> None:
    y = np.sin(6 * T) + 1e-4 * np.random.default_rng(0).standard_normal(T.size)
    assert noise_of(y) == pytest.approx(1e-4, rel=0.1)
    assert noise_of(np.ones(50)) == 0.0


def test_states_that_are_rates_of_others_are_found_in_the_equations() -> None:
    law = LuGre()
    assert rates(Drive(law).model()) == {"v": "x"}
    assert rates(SliderCrank(law).model())["crank_rate"] == "crank"


def test_bristles_start_steadily_where_a_window_starts_fast() -> None:
    sensed = Sensed.of(Drive(LuGre()).model(), T, {"x": np.sin(2 * T)})
    assert sensed.at(0)["z"].value == 0.0
    assert sensed.at(300)["z"].value is None  # cos(3) m/s: as the model says
    assert sensed.at(157)["z"].value == 0.0  # it turns round there


LONG = np.linspace(0.0, 10.0, 1001)


@pytest.mark.parametrize(("length", "count"), [(None, 1), (20.0, 1), (10.0, 1), (2.5, 4), (3.0, 3)])
def test_windows_follow_each_other(length: float | None, count: int) -> None:
    windows = cut(LONG, length)
    assert len(windows) == count
    assert [w.start for w in windows[1:]] == [w.stop for w in windows[:-1]]
    assert (windows[0].start, windows[-1].stop) == (0, LONG.size)


def test_cuts_move_to_where_the_motion_is_fast() -> None:
    speed = np.abs(np.sin(np.pi * LONG / 2.5))  # slowest where equal windows end
    for window in cut(LONG, 2.5, speed)[1:]:
        assert speed[window.start] > 0.5


X, RATE = Variable("x", "m", start=1.0), Variable("rate", "1/s", start=1.0, lower=0.1)
DECAY = Model("decay", x=(X,), p=(RATE,), ode=-RATE.symbol * X.symbol)
TIMES = np.linspace(0.0, 4.0, 401)
DATA = Dataset.of(t=TIMES, x=np.exp(-0.7 * TIMES), units={"x": "m"})


def test_the_length_whose_fits_predict_is_taken() -> None:
    requested = list[tuple[object, int]]()

    def solve(kind: Shooting, data: Dataset) -> Mapping[str, float]:
        requested.append((kind.windows, sum(r.size for r in data)))
        return {"rate": 0.7 if kind.windows == 1.0 else 0.9}

    found = choose(Shooting(windows="choose"), subject(DECAY), DATA, solve)
    assert found.windows == 1.0
    assert [windows for windows, _ in requested[::4]] == [None, 2.0, 1.0, 0.5, 0.25]
    assert {size for _, size in requested} <= {300, 301}  # three quarters
    assert len(requested) == 4 * 5


@pytest.mark.slow
def test_a_fit_chooses_for_itself() -> None:
    fit = Fit(Shooting(windows="choose"), DECAY, DATA, starts=1).solve(throw=False)
    assert fit.values["rate"] == pytest.approx(0.7, rel=1e-6)
