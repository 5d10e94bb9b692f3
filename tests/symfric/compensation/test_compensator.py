"""Friction compensators as blocks, stage by stage."""

from math import exp, inf, pi

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES
from one_program import Stepper, block_of
from tables import sampled

import symfric as sf
from symfric.codegen import law_block
from symfric.compensation import compensator, settings_from_text
from symfric.foundation.graph import graph
from symfric.scenes import Drive

H = 1e-3
BARE = {"velocity": "reference", "scales": (), "ramp": None}
CURVE = {"mu_s": 6.0, "mu_d": 4.0, "v_s": 5e-3, "sigma_2": 20.0}
STEP = sf.Stribeck(v_eps=1e-9, **CURVE)
"""With N = 1 N the coefficients are newtons, and sign(v) is one at any speed."""


class Machine(Stepper):
    """Stepper with `enable` = 1 that returns the force."""

    def __call__(self, **inputs: float) -> float:
        self.found = super().__call__(**({"enable": 1.0} | inputs))
        return self.found["F"]


def machine(law: sf.Law | Drive, **settings: object) -> Machine:
    return Machine(compensator(law, **(BARE | settings)))


def force(law: sf.Law, inputs: dict[str, float], steps: int = 1, **settings: object) -> float:
    """Force after some steps with held inputs."""
    go = machine(law, **settings)
    return [go(**inputs) for _ in range(steps)][-1]


VISCOUS = sf.Stribeck(mu_s=0.0, mu_d=0.0, sigma_2=1.0, v_eps=1e-3)
"""Law whose force equals its velocity."""


@pytest.mark.parametrize(
    "law", [STEP, sf.LuGre(), sf.GMS(form="event"), sf.Dahl(), sf.BrownMcPhee()]
)
def test_without_features_a_compensator_is_the_block_of_its_law(law: sf.Law) -> None:
    """It has the same bits, and no further operation except the limit of its states."""
    alone, bare = law_block(law), compensator(law, **BARE)
    wanted = ca.vertcat(ca.SX(0, 1), alone.next, alone.outputs["F"].expression)
    inputs = ca.vertcat(*(v.symbol for v in (*alone.states, *alone.parameters, *alone.inputs)))
    nodes = len(graph(ca.Function("f", [inputs], [wanted])).nodes)
    assert nodes <= len(graph(bare.step).nodes) <= nodes + 8 * len(law.states)
    one, other, random = Machine(bare), Machine(alone), np.random.default_rng(1)
    for v in 0.02 * random.standard_normal(50):
        assert one(v_ref=v) == other(v=v, N=1.0)


def test_the_scales_are_those_of_the_terms_of_the_law() -> None:
    for law, names in (
        (STEP, {"coulomb", "stribeck", "viscous"}), (sf.Coulomb(), {"coulomb"}),
        (sf.Viscous(2.0), {"viscous"}), (sf.SelfTuning(), {"force"}),
        (sf.Table((0.0, 1.0), (0.1, 0.2)), {"force"}),
    ):  # fmt: skip
        found = {p.name for p in compensator(law).parameters if p.name.startswith("scale")}
        assert found == {f"scale_{name}" for name in names}


@pytest.mark.parametrize(
    "law",
    sampled(
        [
            sf.GMS(C=400.0, **CURVE, form="event"),
            STEP,
            sf.Asymmetric(STEP, STEP),
            sf.LuGre(**CURVE),
        ],
        of=2,
    ),
)
def test_scaled_terms_add_up_to_the_closed_form(law: sf.Law) -> None:
    """Long sliding at 3 mm/s: s_c 4 + s_s 2 exp(-0.36) + s_v 20 v."""
    v, block = 3e-3, compensator(law, **(BARE | {"scales": ("coulomb", "stribeck", "viscous")}))
    parts = {"coulomb": 4.0, "stribeck": 2.0 * exp(-((v / 5e-3) ** 2)), "viscous": 20.0 * v}
    for scales in (
        {"coulomb": 0.5},
        {"stribeck": 0.3},
        {"viscous": 0.0},
        dict.fromkeys(parts, 0.0),
    ):
        wanted = sum(value * scales.get(term, 1.0) for term, value in parts.items())
        go = Machine(block, **{f"scale_{term}": scale for term, scale in scales.items()})
        assert [go(v_ref=v) for _ in range(400)][-1] == pytest.approx(wanted, rel=1e-6)
    assert force(law, {"v_ref": v}, 400, without=[*parts]) == 0.0
    wanted = sum(parts.values()) - parts["viscous"]
    assert force(law, {"v_ref": v}, 400, without=["viscous"]) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(
    ("law", "terms"), [(sf.LuGre(**CURVE), ["bristle"]), (sf.GMS(**CURVE, form="event"), None)]
)
def test_without_a_load_there_is_no_force_until_it_returns(law: sf.Law, terms) -> None:
    go = Machine(compensator(law, ramp=None, N="input", without=["viscous"], scales=terms))
    for load, steps, low, high in (
        (1.0, 900, 3.0, inf),
        (0.0, 5, -1e-6, 1e-6),
        (1.0, 900, 3.0, inf),
    ):
        assert low < [go(v_ref=1e-3, N=load) for _ in range(steps)][-1] < high


@pytest.mark.heavy
@pytest.mark.parametrize("name", sampled(CASES, of=10))
def test_the_terms_of_every_law_add_up_to_its_force(name: str) -> None:
    law = CASES[name]
    try:
        alone = block_of(law)
    except ValueError:
        return  # a law without a step has no compensator either
    if len(alone.inputs) > 2:
        with pytest.raises(ValueError, match="expected a law of v and N only"):
            compensator(law)
        return
    block = compensator(law, velocity="reference", ramp=None)
    scales = [p.name for p in block.parameters if p.name.startswith("scale_")]
    machines = Machine(alone), Machine(block), Machine(block, **dict.fromkeys(scales, 0.0))
    for v in np.cumsum(2e-3 * np.random.default_rng(0).standard_normal(40)):
        wanted, found, none = (go(v=v, v_ref=v, N=1.0) for go in machines)
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-14)
        assert none == 0.0


def test_scales_act_at_once_and_do_not_change_the_states() -> None:
    block = compensator(sf.LuGre(**CURVE), **(BARE | {"scales": {"coulomb": 1.0, "stribeck": 1.0}}))
    whole, half = Machine(block), Machine(block, scale_coulomb=0.5, scale_stribeck=0.5)
    for _ in range(5):
        whole(v_ref=2e-3)
    half.x[:] = whole.x
    dry = whole(v_ref=2e-3) - 20.0 * 2e-3
    assert half(v_ref=2e-3) == pytest.approx(dry / 2 + 20.0 * 2e-3)
    assert half.x.tolist() == whole.x.tolist()


def test_without_bristles_the_force_is_the_steady_curve() -> None:
    law, v = sf.LuGre(**CURVE), 3e-3
    steady = 4.0 + 2.0 * exp(-((v / 5e-3) ** 2)) + 20.0 * v
    none, all_of_them, plain = (
        force(law, {"v_ref": v}, **s)
        for s in ({"scales": {"bristle": 0.0}}, {"scales": {"bristle": 1.0}}, {})
    )
    assert none == pytest.approx(steady)
    assert all_of_them == pytest.approx(plain)
    assert plain < 0.5 * steady


def test_the_velocity_of_the_law_is_desired_near_rest_and_measured_beyond() -> None:
    blend = machine(VISCOUS, velocity="blend", v_blend=0.01)
    for v, wanted in ((0.0, 0.3), (-0.0099, 0.3), (0.0201, 0.0201), (-0.5, -0.5)):
        assert blend(v_ref=0.3, v=v) == pytest.approx(wanted)
    between = [blend(v_ref=0.3, v=v) for v in np.linspace(0.01, 0.02, 9)]
    assert (np.diff(between) < 0).all()
    assert between[4] == pytest.approx((0.3 + 0.015) / 2)
    found = force(VISCOUS, {"v_ref": 0.1, "a_ref": 5.0, "e": 1e-3}, delay=2e-3, error_gain=20.0)
    assert found == pytest.approx(0.1 + 5.0 * 2e-3 + 20.0 * 1e-3)
    for v, wanted in ((5e-4, 0.0), (-1e-3, 0.0), (1.5e-3, 5e-4), (-3e-3, -2e-3)):
        assert force(VISCOUS, {"v_ref": v}, dead_zone=1e-3) == pytest.approx(wanted)


def test_friction_builds_up_over_a_travel_and_remembers_short_reversals() -> None:
    """From -4 N to 4 N over 0.1 mm in steps of 1 um, as in a Maxwell element."""
    go = machine(sf.Coulomb(mu_d=4.0), build_up=1e-4)
    forth = [go(v_ref=1e-3) for _ in range(200)]
    assert forth[0] == pytest.approx(0.5 * 8.0 / 100)  # the mean of the first step
    assert np.allclose(np.diff(forth[:49]), 8.0 / 100)
    assert forth[-1] == pytest.approx(4.0)
    assert [go(v_ref=-1e-3) for _ in range(20)][-1] == pytest.approx(4.0 - 19.5 * 8.0 / 100)
    assert [go(v_ref=1e-3) for _ in range(20)][-1] == pytest.approx(4.0 - 0.5 * 8.0 / 100)
    assert go() == pytest.approx(4.0)  # held at rest
    viscous = sf.Stribeck(mu_s=4.0, mu_d=4.0, sigma_2=20.0, v_eps=1e-9)
    assert force(viscous, {"v_ref": 0.01}, 200, build_up=1e-4) == pytest.approx(4.2)
    table = ((0.0, 0.0), (0.25, 0.75), (1.0, 1.0))
    go = machine(sf.Coulomb(mu_d=4.0), build_up=1e-4, build_up_table=table)
    for _ in range(200):
        go(v_ref=-1e-3)
    forth = np.array([go(v_ref=1e-3) for _ in range(100)])
    shares = np.interp((np.arange(100) + 0.5) / 100, *np.array(table).T)
    assert np.allclose(forth, 4.0 * (2 * shares - 1))
    sides = sf.Asymmetric(sf.Coulomb(mu_d=4.0, v_eps=1e-9), sf.Coulomb(mu_d=2.0, v_eps=1e-9))
    go = machine(sides, build_up=1e-4)
    for v, wanted in ((1e-3, 4.0), (-1e-3, -2.0)):
        assert [go(v_ref=v) for _ in range(300)][-1] == pytest.approx(wanted)


def test_a_stuck_axis_receives_an_additional_force_until_it_moves() -> None:
    go, between = (machine(VISCOUS, stick=(2.0, 0.1, 1e-3)) for _ in range(2))
    stuck = [go(v_ref=0.1) - 0.1 for _ in range(150)]
    assert stuck[49] == pytest.approx(1.0)
    assert stuck[99] == stuck[-1] == pytest.approx(2.0)
    free = [go(v_ref=0.1, v=0.1) - 0.1 for _ in range(150)]
    assert free[49] == pytest.approx(1.0)
    assert free[-1] == 0.0
    assert go(v_ref=-0.1) + 0.1 < 0.0
    found = [between(v_ref=1.5e-3, v=1.2e-3) for _ in range(200)][-1] - 1.5e-3
    assert found == pytest.approx(2.0 * 0.5 * 0.8)


def test_the_force_fades_in_and_out_smoothly() -> None:
    go, half = (Machine(compensator(STEP, velocity="reference", ramp=0.1)) for _ in range(2))
    full = force(STEP, {"v_ref": 0.1})
    course = [go(v_ref=0.1, enable=float(100 <= k < 300)) for k in range(500)]
    assert course[99] == course[-1] == 0.0
    assert course[149] == pytest.approx(full / 2)
    assert course[199] == course[299] == pytest.approx(full)
    assert np.abs(np.diff(course)).max() < 1.6 * full * H / 0.1
    assert np.abs(np.diff(course, 2)).max() < 0.1 * full * H / 0.1  # no corner at its ends
    assert [half(v_ref=0.1, enable=0.5) for _ in range(50)][-1] == 0.0


def test_dither_limit_slew_offset_and_inertia_have_their_closed_forms() -> None:
    found = force(STEP, {"a_ref": 2.0}, offset=-0.5, inertia=3.0)
    assert found == pytest.approx(-0.5 + 6.0)
    lower = {p.name: p.lower for p in compensator(STEP, offset=-0.5).parameters}
    assert lower["offset"] == -inf  # otherwise the guards reject it
    go = machine(VISCOUS, dither=(0.5, 40.0))
    wanted = 0.5 * np.sin(2 * pi * 40.0 * H * np.arange(1, 101))
    assert np.allclose([go() for _ in range(100)], wanted)
    assert [force(STEP, {"v_ref": v}, limit=3.0) for v in (1.0, -1.0)] == [3.0, -3.0]
    go = machine(STEP, slew=100.0)
    forth = [go(v_ref=0.1) for _ in range(100)]
    assert np.allclose(np.diff([0.0, *forth])[:59], 0.1)
    assert forth[-1] == pytest.approx(force(STEP, {"v_ref": 0.1}))
    back = [go(v_ref=-0.1) for _ in range(100)]
    assert np.allclose(np.diff([forth[-1], *back]), -0.1)


def test_the_limit_is_the_last_operation() -> None:
    """A wrong state, a lower limit and fading do not lead beyond it."""
    go = machine(STEP, slew=100.0, limit=5.0, ramp=0.1)
    for _ in range(200):
        go(v_ref=0.1)
    go.x[:] = 5000.0
    assert go(v_ref=0.1) == 5.0
    go.x[:] = -5000.0
    fading = np.array([go(v_ref=0.1, enable=0.0) for _ in range(200)])
    assert (fading[0], fading[-1]) == (-5.0, 0.0)
    assert np.all(np.diff(fading) <= 100.0 * H * (1 + 1e-9))
    go.x[:] = 5000.0
    go.p[[v.name for v in go.block.parameters].index("F_max")] = 0.5
    assert go(v_ref=0.1) == 0.5


@pytest.mark.parametrize(
    "law", [sf.LuGre(**CURVE), sf.GMS(C=400.0, **CURVE, form="event"), sf.Dahl()]
)
def test_a_wrong_state_causes_no_force_above_stiction(law: sf.Law) -> None:
    go = machine(law, N=2.0)
    go.x[:] = 1e3
    most = float(law.most_held(2.0)) * len(law.states)
    assert 0.5 * most <= go() <= most * 1.0011


def test_the_integrator_is_held_at_rest_near_the_goal() -> None:
    go = Machine(compensator(STEP, hold=(1e-5, 1e-3)))
    for given, wanted in (
        ({"e": 9e-6}, 1.0), ({"e": -1.1e-5}, 0.0), ({"v": 2e-3}, 0.0), ({"v_ref": -2e-3}, 0.0)
    ):  # fmt: skip
        go(**given)
        assert go.found["hold"] == wanted


def test_a_drive_defines_load_offset_and_units() -> None:
    block = compensator(Drive(STEP, N=2.0, offset=0.3, turning=True))
    starts = {p.name: float(p.start) for p in block.parameters}
    assert (starts["N"], starts["offset"]) == (2.0, 0.3)
    assert {v.name: v.unit for v in block.inputs}["v_ref"] == "rad/s"
    assert block.outputs["F"].unit == "N m"
    assert "offset" not in {p.name for p in compensator(Drive(STEP)).parameters}


def test_settings_are_read_from_texts() -> None:
    s = settings_from_text(
        ["v_blend=0.02", "scales=coulomb:0.9,stribeck:0", "without=viscous", "stick=1,0.1,1e-3",
         "N=input", "build_up_table=0:0,1:1", "build_up=1e-4"]
    )  # fmt: skip
    assert (s.v_blend, s.N, s.stick) == (0.02, "input", (1.0, 0.1, 1e-3))
    assert s.scales == {"coulomb": 0.9, "stribeck": 0.0}
    assert tuple(s.without) == ("viscous",)
    assert s.build_up_table == ((0.0, 0.0), (1.0, 1.0))
