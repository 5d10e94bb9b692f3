"""Scenes as figures."""

from symfric import LuGre
from symfric.figures.scene import DEFAULT_T_END, PANELS, scene_figure
from symfric.scenes import ALL_SCENES


def test_every_scene_has_a_time_that_shows_it() -> None:
    assert set(DEFAULT_T_END) == set(ALL_SCENES)


def test_a_mechanism_is_a_figure_with_its_first_signals_drawn() -> None:
    data = scene_figure({"LuGre": LuGre()}, "pendulum")
    assert data.panels[0] == ("t", "phi")
    assert len(data.panels) == PANELS
    assert data["LuGre"]["t"][-1] == DEFAULT_T_END["pendulum"]
