"""Pictures of laws carry names and units and choose their scales."""

import pytest

from symfric import BrownMcPhee, Viscous
from symfric.figures.pictures import plot_catalogue, plot_laws


def test_laws_are_plotted_near_rest_and_over_decades() -> None:
    figure = plot_laws({"a": BrownMcPhee(), "b": Viscous()}, N=2.0)
    near, far = figure.axes
    assert near.get_xlabel() == far.get_xlabel() == "v [m/s]"
    assert near.get_ylabel().endswith("[N]")
    assert far.get_xscale() == "log"
    assert near.lines[0].get_ydata().max() == pytest.approx(0.3, rel=1e-2)


def test_catalogue_has_a_panel_of_its_own_scale_for_every_law() -> None:
    laws = {f"law {k}": BrownMcPhee(v_t=10.0**-k) for k in range(7)}
    shown = [axis for axis in plot_catalogue(laws, N=2.0).axes if axis.get_visible()]
    assert [axis.get_title() for axis in shown] == list(laws)
    for k, axis in enumerate(shown):
        assert axis.lines[0].get_xdata().max() == pytest.approx(5 * 10.0**-k)
        assert axis.lines[0].get_ydata().max() == pytest.approx(0.3, rel=1e-2)
