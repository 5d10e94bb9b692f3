"""Frictional lag."""

import numpy as np
import pytest

from symfric import LuGre, law_from_text
from symfric.figures import lag


@pytest.mark.parametrize("name", ["lugre", "gms", "leuven", "elasto_plastic", "armstrong"])
@pytest.mark.parametrize("case", ["2 Hz", "5 Hz", "10 Hz"])
def test_force_lags_so_it_is_higher_while_the_velocity_rises(name: str, case: str) -> None:
    curve = lag(law_from_text(name))[case]
    v, F = curve["v"], curve["F"]
    up = np.diff(v, append=v[-1]) > 0
    at = np.linspace(1e-3, 3e-3, 21)
    rising, falling = (
        np.interp(at, v[side][np.argsort(v[side])], F[side][np.argsort(v[side])])
        for side in (up, ~up)
    )
    assert (rising > falling).all()


def test_lag_of_lugre_lies_around_the_steady_curve_and_grows_with_the_frequency() -> None:
    data = lag(LuGre())
    areas = [abs(np.trapezoid(data[f]["F"], data[f]["v"])) for f in ("2 Hz", "5 Hz", "10 Hz")]
    assert areas == sorted(areas)
    assert data["steady"]["F"][[0, -1]] == pytest.approx(
        [7.848 * (0.1 + 0.05 * np.exp(-0.25)), 0.7848], rel=1e-6
    )
