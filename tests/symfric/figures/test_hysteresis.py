"""Hysteresis in pre-sliding and its memory."""

import numpy as np
import pytest

from symfric import LuGre
from symfric.figures import hysteresis
from symfric.laws import GMS, MaxwellSlip


def test_maxwell_slip_draws_one_curve_at_every_speed() -> None:
    data = hysteresis(MaxwellSlip(form="event"))
    slow = data["1x"]["F"]
    for case in ("5x", "20x"):
        assert data[case]["F"] == pytest.approx(slow, abs=1e-4)


@pytest.mark.parametrize("law", [MaxwellSlip(form="event"), MaxwellSlip(), GMS(form="event")])
def test_non_local_memory_returns_to_the_force_of_each_turning_point(law: MaxwellSlip) -> None:
    curve = hysteresis(law, speeds=(1.0,))["1x"]
    F = curve["F"][::200]  # at the turning points 0, 2, -2, 1, -1, 1, -2, 2 stretches
    assert F[5] == pytest.approx(F[3], rel=0.01)  # the smooth form yields a little early
    assert F[6] == pytest.approx(F[2], rel=0.01)


def test_lugre_has_no_such_memory() -> None:
    F = hysteresis(LuGre(), speeds=(1.0,))["1x"]["F"][::200]
    assert abs(F[5] - F[3]) > 0.05


def test_virgin_curve_and_reversal_of_maxwell_slip_obey_masing() -> None:
    law = MaxwellSlip(form="event")
    curve = hysteresis(law, speeds=(1.0,))["1x"]
    k, limit = np.array([5e4, 2.5e4, 1.5e4, 1e4]), 0.025 * 7.848

    def virgin(x: np.ndarray) -> np.ndarray:
        return np.minimum(np.outer(np.abs(x), k), limit).sum(axis=1)

    first, back = slice(0, 201), slice(200, 401)
    assert curve["F"][first] == pytest.approx(virgin(curve["x"][first]), abs=1e-4)
    x, branch = curve["x"][back], curve["F"][back]
    assert branch == pytest.approx(branch[0] - 2 * virgin((x[0] - x) / 2), abs=1e-4)


def test_a_route_is_gone_through() -> None:
    route = (0.0, 1.5e-6, 0.2e-6, 1.1e-6)
    curve = hysteresis(MaxwellSlip(), speeds=(1.0,), route=route).curves[0]
    turns = [int(np.argmin(np.abs(curve["t"] - 8.0 * k / 3))) for k in range(4)]
    assert np.allclose(curve["x"][turns], route, atol=1e-11)
    with pytest.raises(ValueError, match="route: expected at least two turning points"):
        hysteresis(MaxwellSlip(), route=(0.0,))
