"""What makes a law smooth, and where laws are compared."""

from dataclasses import replace

import numpy as np
import pytest

from symfric import (
    ALL_LAWS,
    Asymmetric,
    BlimanSorine,
    BrownMcPhee,
    Coulomb,
    DuanSingh,
    ElastoPlastic,
    LuGre,
    MaxwellSlip,
    Specker,
    parameters,
    rabinowicz,
)
from symfric.figures.regularisation import distance, machine_of, regularisation, sample
from symfric.laws import Law
from symfric.scenes import PendulumBox, Rabinowicz


@pytest.mark.parametrize(
    ("law", "names"),
    [
        (BrownMcPhee(), ("v_t",)),
        (Coulomb(), ("v_eps",)),
        (Specker(), ("v_t",)),
        (Asymmetric(BrownMcPhee(), BrownMcPhee()), ("v_t_pos", "v_t_neg", "v_blend")),
        (LuGre(), ("sigma_0", "sigma_1")),
        (LuGre(sigma_1=0.0), ("sigma_0",)),
        (ElastoPlastic(), ("sigma_0", "sigma_1", "z_ba")),
        (BlimanSorine(), ("s_f",)),
        (MaxwellSlip(), ("k_1", "k_2", "k_3", "k_4")),
    ],
)
def test_roles_say_what_makes_a_law_smooth(law: Law, names: tuple[str, ...]) -> None:
    assert tuple(regularisation("here", law).powers) == names


def test_stiffness_and_inverse_velocity_grow_where_widths_shrink() -> None:
    soft = regularisation("here", LuGre(sigma_0=1e4, sigma_1=10.0))
    wide = regularisation("here", BrownMcPhee())
    slope = regularisation("here", DuanSingh(sigma=50.0), "sigma")
    assert soft.values(0.01) == pytest.approx({"sigma_0": 1e6, "sigma_1": 100.0})
    assert wide.values(0.1) == pytest.approx({"v_t": 1e-4})
    assert slope.values(0.5) == pytest.approx({"sigma": 100.0})
    for knob in (soft, wide, slope):
        name = next(iter(knob.powers))
        assert parameters(knob.at(0.3))[name].value == knob.values(0.3)[name]


def test_every_law_either_says_or_asks() -> None:
    for law in ALL_LAWS.values():
        try:
            assert regularisation("here", law()).powers
        except ValueError as error:
            said = ("parameter: expected what makes", "is it dry already", "rests exactly")
            assert any(text in str(error) for text in said)


def test_a_machine_is_a_scene_its_class_or_a_function() -> None:
    law = BrownMcPhee()
    for scene, t_end in ((Rabinowicz(law), None), (Rabinowicz, None), (rabinowicz, 20.0)):
        machine = machine_of("here", scene, t_end, None, None, law)
        assert machine.model(law).name == "rabinowicz"
        assert machine.t_end == 20.0
    assert machine_of("here", Rabinowicz(law, m=2.0), 3.0, None, None, law).t_end == 3.0


def test_motions_are_compared_by_positions_relative_to_how_far_they_go() -> None:
    wide, narrow = (BrownMcPhee(v_t=v_t) for v_t in (1e-2, 1e-3))
    machine = machine_of("here", PendulumBox, 1.0, None, None, wide)
    one, other = (sample(machine, law, 1e-6) for law in (wide, narrow))
    assert one.motion.shape[0] == 2
    off = np.abs(one.motion - other.motion).max(axis=1)
    assert distance(one, other) == pytest.approx((off / np.ptp(other.motion, axis=1)).max())
    assert distance(other, other) == 0.0
    named = machine_of("here", PendulumBox, 1.0, ("phi",), None, wide)
    assert sample(named, wide, 1e-6).motion.shape[0] == 1
    last = replace(machine, of=lambda run: run["phi"][-1:])
    assert sample(last, wide, 1e-6).motion.shape == (1, 1)
