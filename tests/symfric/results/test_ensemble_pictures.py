"""Bands of many runs."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from symfric import BrownMcPhee, rabinowicz, simulate_many
from symfric.results.pictures import plot_many

T = np.linspace(0.0, 1.0, 11)


def test_bands_hold_the_percentiles_and_leave_out_who_has_ended() -> None:
    values = np.arange(101.0)[:, None] + np.zeros(11)
    values[:, 8:] = np.nan
    values[50:, 5:] = np.nan
    axis = plot_many("a", T, {"x": values}, {"x": "N"}).axes[0]
    outer, inner = (c for c in axis.collections if isinstance(c, PolyCollection))
    for band, low, high in ((outer, 5.0, 95.0), (inner, 25.0, 75.0)):
        y = band.get_paths()[0].vertices[:, 1]
        assert (y.min(), y.max()) == pytest.approx((min(low, 49 * low / 100), high))
    (median,) = axis.lines
    assert median.get_ydata() == pytest.approx([50.0] * 5 + [24.5] * 3)
    assert axis.get_title(loc="left") == "a, 101 members"


def test_few_members_are_drawn_one_by_one() -> None:
    axis = plot_many("a", T, {"x": np.array([T, 2 * T])}, {"x": "m"}).axes[0]
    assert [line.get_label() for line in axis.lines] == ["member 0", "member 1"]
    assert axis.lines[1].get_ydata() == pytest.approx(2 * T)


def test_an_ensemble_shows_its_ends_where_it_has_no_more() -> None:
    model = rabinowicz(BrownMcPhee(), free=["mu_s"])
    runs = simulate_many(model, 0.05, p={"mu_s": np.linspace(0.1, 0.2, 12)}, backend="vm")
    figure = runs.plot("x", "v")
    assert [axis.get_ylabel() for axis in figure.axes] == ["members", "members"]
    assert figure.axes[0].get_xlabel() == "x [mm] at the end"
    assert sum(patch.get_height() for patch in figure.axes[0].patches) == 12
    with pytest.raises(ValueError, match="did you mean friction"):
        runs.plot("frictoin")
