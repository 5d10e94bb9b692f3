"""Start values from samples: exact for cubics, honest about noise, and whose rate is what."""

import numpy as np
import pytest

from identification.residuals.initial import Sensed, local, noise_of, rates
from symfric import LuGre
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
