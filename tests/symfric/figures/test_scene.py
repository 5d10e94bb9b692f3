"""Scenes as figures."""

from symfric import GMS, LuGre
from symfric.figures.catalogue import in_scene, scene_figure
from symfric.scenes import Pendulum


def test_a_mechanism_is_drawn_by_position_friction_and_energy() -> None:
    data = scene_figure("pendulum", {"LuGre": in_scene(LuGre(), "pendulum")})
    assert data.panels == (("t", "phi"), ("t", "phi_friction"), ("t", "energy"))
    assert data["LuGre"]["t"][-1] == Pendulum.t_end


def test_a_law_of_many_states_does_not_push_its_friction_out() -> None:
    data = scene_figure("rabinowicz", {"gms": in_scene(GMS(), "rabinowicz")})
    assert data.panels == (("t", "x"), ("t", "friction"), ("t", "power"))
    assert {"F_1", "F_4"} <= set(data["gms"].columns)
