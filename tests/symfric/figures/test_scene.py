"""Scenes as figures."""

from symfric import LuGre
from symfric.figures.scene import PANELS, scene_figure
from symfric.scenes import Pendulum


def test_a_mechanism_is_a_figure_with_its_first_signals_drawn() -> None:
    data = scene_figure({"LuGre": LuGre()}, "pendulum")
    assert data.panels[0] == ("t", "phi")
    assert len(data.panels) == PANELS
    assert data["LuGre"]["t"][-1] == Pendulum.t_end
