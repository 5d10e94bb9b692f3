"""Scenes take any law, free parameters by name, and refuse what they cannot use."""

from itertools import product
from math import inf
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES
from refusing import not_refused
from tables import table

import symfric as sf
from symfric.laws.catalogue import DYNAMIC_LAWS
from symfric.scenes import ALL_SCENES, MECHANISMS, Drive, FourMass, Robot, Scene, SliderCrank
from symfric.scenes.linkages import MechanismScene
from symfric.scenes.rigs import ANY

SINGLE = {name: kind for name, kind in ALL_SCENES.items() if name not in MECHANISMS}
"""Scenes that write their own equations; mechanisms are tested in test_mechanism.py."""

TABLE = table(__file__)
STATES: dict[str, int] = TABLE["states"]
OFFERED = {name: {"F_e"} for name in STATES} | {
    "quarter_car": {"F_e", "x_rel", "v_rel"},
    "prescribed": {i.name for law in CASES.values() for i in law.inputs} - {"F_e"},
}


SOME = ("coulomb", "lugre", "gms", "karnopp, event", "wojewoda", "bam", "quarter_car_general")
"""Laws without and with states, modes and inputs: tried in every scene, the others in one."""


@pytest.mark.parametrize("scene", SINGLE)
def test_every_law_gives_a_model_of_its_size_that_starts_or_is_refused(scene: str) -> None:
    refused = 0
    for law in CASES.values() if scene == "drive" else map(CASES.__getitem__, SOME):
        if not {i.name for i in law.inputs} <= OFFERED[scene]:
            refused += 1
            reported = (
                r"law (that needs no more than v, N, .*F_e|of motion and load, got .* the force)"
            )
            with pytest.raises(ValueError, match=reported):
                SINGLE[scene](law).model()
            continue
        model = SINGLE[scene](law).model()
        assert len(model.x) == STATES[scene] + len(model.contacts) * len(law.states)
        assert model.initial_state().shape == (len(model.x),)
        assert model.p == ()
    assert refused


@pytest.mark.parametrize("kind", ALL_SCENES.values(), ids=[*ALL_SCENES])
def test_every_parameter_can_be_free_and_costs_less_as_a_constant(kind: type[Scene]) -> None:
    scene = kind(sf.LuGreNormalised())
    known = sf.parameters(scene)
    free, fixed = scene.model(known), scene.model()
    assert {p.name: p.start for p in free.p} == {n: q.value for n, q in known.items()}
    assert [p.name for p in free.p] == [*known]
    assert free.initial_state() == pytest.approx(fixed.initial_state(), abs=1e-12)
    costs = [model.function("signals").n_instructions() for model in (fixed, free)]
    assert costs[0] < costs[1]
    if fixed.sketch is not None:
        marks = fixed.sketch().marks
        slips = [slip for mark in marks for slip, _ in mark.slips]
        assert len(slips) == len(fixed.contacts)
        assert set(slips) <= {*fixed.signals, *fixed.further}
    for law, got in ((sf.LuGre, "the class LuGre"), ("lugre", "'lugre'"), (None, "None")):
        with pytest.raises(ValueError, match=rf"{kind.__name__}: expected a law .* got {got}"):
            kind(law)  # type: ignore[arg-type]


def test_bad_arguments_are_refused() -> None:
    table, names = Path(__file__).with_name("refusals.toml"), {"v": sf.Variable("v", "m/s")}
    assert not_refused(table, sf, sf.laws, sf.scenes, **names) == []  # pyright: ignore


def test_error_control_watches_the_sliding_velocity_on_the_scale_of_the_law() -> None:
    for kind, law in product(SINGLE.values(), (sf.Coulomb(v_eps=2e-3), sf.Viscous())):
        model = kind(law).model()  # a quarter car watches the reach of its strut, too
        found = [m.nominal for m in model.monitors if m.nominal != ANY]
        assert found == [2e-3] * isinstance(law, sf.Coulomb) * len(model.contacts)


def test_scale_of_a_free_parameter_follows_it() -> None:
    """It used to stay at the start value, so that another one was not resolved."""
    model = sf.rabinowicz(sf.Coulomb(v_eps=2e-3), free=["v_eps", "mu_d"])
    (monitor,) = model.monitors
    nominal = ca.Function("nominal", [model.vector("p")], [monitor.nominal])
    assert float(nominal(model.values("p", {"v_eps": 1e-5}))) == 1e-5


def test_bristle_starts_loaded_for_the_given_start_velocity() -> None:
    model = sf.drive(sf.LuGre())
    assert model.initial_state()[2] == 0.0
    assert model.initial_state({"v": 0.3})[2] == pytest.approx(0.1 * 0.8 * 9.81 / 1e5)
    assert model.initial_state({"v": 0.3, "z": 2e-6})[2] == 2e-6
    assert sf.drive(sf.LuGre(v_eps=0.0)).initial_state() == pytest.approx([0.0, 0.0, 0.0])


def test_every_scene_owns_the_time_and_the_input_that_show_it() -> None:
    """A table in the figures knew them; a scene of one's own had neither."""
    for kind in (*ALL_SCENES.values(), Robot):
        assert 0 < kind.t_end < inf, kind
    assert set(Drive.inputs) == {u.name for u in sf.drive(sf.Viscous()).u}
    assert float(ca.DM(ca.SX(Drive.inputs["force"].function(ca.SX(0.5))))) == 2.0


def test_no_load_runs_or_is_refused_where_the_law_divides_by_it() -> None:
    """Bouc-Wen ended in a ZeroDivisionError, others in NaN at t = 0."""
    refused = 0
    for name, kind in sf.ALL_LAWS.items():
        law = kind()
        if not {i.name for i in law.inputs} <= {"F_e"}:
            continue
        try:
            model = sf.drive(law, N=0.0)
        except ValueError as error:
            refused += 1
            with pytest.raises(ValueError, match="expected a normal force above 0 N"):
                Drive(law, N=0.0).model(free=tuple(sf.parameters(law)))
            assert "expected a normal force above 0 N" in str(error), name
            assert law.states, name
            continue
        ode = model.function("ode")
        x, u = model.initial_state(), model.values("u", {"force": 1.0})
        for v in (0.0, 1e-9, -0.1):
            x[1] = v
            assert ode(0.0, x, [], u, []).is_regular(), (name, v)
        if law.states:
            Drive(law, N=0.0).model(free=tuple(sf.parameters(law)))
    assert refused == 7


@pytest.mark.parametrize("name", sorted(DYNAMIC_LAWS.keys() - {"lugre_tyre"}))
def test_block_is_carried_as_far_as_stated(name: str) -> None:
    law: sf.Law = DYNAMIC_LAWS[name]()
    # unloaded at first, as the published runs were
    start = {"z": 0.0, "s_dw": 0.0} if name == "gonthier" else {}
    run = sf.simulate(sf.rabinowicz(law), 20.0, x0=start, rtol=1e-6, samples=8001)
    reach, error = TABLE["reach"][name]
    assert run["x"].max() == pytest.approx(reach, abs=error)


def belt(law: sf.Law) -> sf.Model:
    """Rabinowicz's block, written by a user."""
    x, v = sf.Variable("x", "m", nominal=0.1), sf.Variable("v", "m/s", nominal=0.1)
    pull = -2.1 * x.symbol
    slip = sf.contact("belt", law, v.symbol - 0.1, 0.8 * 9.81, rest={"v": 0.1}, F_e=pull)
    rate = (pull - slip.force) / 0.8
    outputs = {"friction": sf.Output(slip.force, "N")}
    ode = ca.vertcat(v.symbol, rate)
    return sf.Model("own", x=(x, v), ode=ode, contacts=(slip,), outputs=outputs)


def test_user_equations_run_as_the_scene_does() -> None:
    for name in ("brown_mcphee", "lugre", "exact_coulomb", "karnopp"):
        own, scene = belt(sf.ALL_LAWS[name]()), sf.rabinowicz(sf.ALL_LAWS[name]())
        one, other = (sf.simulate(model, 3.0, samples=51) for model in (own, scene))
        assert one.statistics.steps == other.statistics.steps, name
        np.testing.assert_array_equal(one["x"], other["x"])
        np.testing.assert_array_equal(one["friction"], other["friction"])


def test_a_sled_slides_as_the_closed_form() -> None:
    x, v, pull = sf.Variable("x", "m"), sf.Variable("v", "m/s"), sf.Variable("pull", "N")
    slip = sf.contact("floor", sf.Coulomb(mu_d=0.1, v_eps=1e-5), v.symbol, 10.0)
    ode = ca.vertcat(v.symbol, (pull.symbol - slip.force) / 2.0)
    model = sf.Model("sled", x=(x, v), u=(pull,), ode=ode, contacts=(slip,))
    run = sf.simulate(model, 1.0, u={"pull": 3.0}, rtol=1e-9)
    assert run.final["v"] == pytest.approx(1.0, rel=1e-4)


def test_two_contacts_have_states_of_their_own_names() -> None:
    v = sf.Variable("v", "m/s")
    pairs = [("left", True), ("right", True)]
    with pytest.raises(ValueError, match="got z; contacts made with bare=False call their states"):
        bare = tuple(sf.contact(n, sf.LuGre(), v.symbol, 1.0, bare=b) for n, b in pairs)
        sf.Model("two", x=(v,), ode=-bare[0].force - bare[1].force, contacts=bare)
    both = tuple(sf.contact(n, sf.LuGre(), v.symbol, 1.0, bare=False) for n, _ in pairs)
    model = sf.Model("two", x=(v,), ode=-both[0].force - both[1].force, contacts=both)
    assert [s.name for s in model.x] == ["v", "left_z", "right_z"]


def test_a_contact_that_turns_has_its_units() -> None:
    w = sf.Variable("w", "rad/s")
    hub = sf.contact(
        "hub", sf.LuGre(mu_s=1.4, mu_d=0.9), w.symbol, 1.0, rest={"w": 0.0}, turning=True
    )
    model = sf.Model("hub", x=(w,), ode=-hub.force / 0.01, contacts=(hub,))
    assert [state.unit for state in model.x] == ["rad/s", "rad"]


def test_the_docstring_of_the_package_names_all_public_objects() -> None:
    reported = sf.__doc__ or ""
    laws = {kind.__name__ for kind in sf.ALL_LAWS.values()}
    for name in sf.__all__:  # pyright: ignore
        thing = getattr(sf, name)
        is_law = isinstance(thing, type) and issubclass(thing, sf.Law | sf.Population)
        assert name in reported or name in laws or is_law, name
    with pytest.raises(AttributeError) as error:
        sf.Lugre  # noqa: B018  # pyright: ignore
    assert (error.value.name, error.value.obj) == ("Lugre", sf)  # Python offers LuGre by these


RUBS = {(scene, place): joint for scene, place, joint in TABLE["rubs"]}
"""Scene and place -> the joint whose friction it is."""

WITHOUT = {"guide", "pin"}
"""Places that do not rub where no law is given."""


def test_every_place_is_tested() -> None:
    """That of the second block by its own oracle."""
    there = {(name, place) for name, kind in ALL_SCENES.items() for place in kind.places()}
    assert there == {*RUBS, ("coupled_blocks", "block_2")}
    for kind in ALL_SCENES.values():
        assert all(kind.places().values())


ONE_OF_THE_ARM = [at for at in RUBS if at[0] != "arm" or at[1] == "q4"]


@pytest.mark.parametrize(("name", "place"), ONE_OF_THE_ARM)
def test_a_law_of_a_place_rubs_there_and_nowhere_else(name: str, place: str) -> None:
    scene = MECHANISMS[name](sf.Viscous(sigma_2=0.0), **{place: sf.Coulomb(mu_d=0.3, v_eps=0.01)})
    run = sf.simulate(scene.model(), 0.01, samples=11)
    rubbed = {n for n in run.units if n.endswith("_friction") and abs(run[n]).max() > 1e-3}
    assert rubbed == {f"{RUBS[name, place]}_friction"}


@pytest.mark.parametrize("kind", MECHANISMS.values(), ids=[*MECHANISMS])
def test_without_laws_of_their_own_places_have_that_of_the_scene(
    kind: type[MechanismScene],
) -> None:
    law = sf.BrownMcPhee(v_t=0.05)
    laws = {place: law for place in kind.places() if place not in WITHOUT}
    given, own = kind(law, **laws).model(), kind(law).model()
    assert [v.name for v in given.x] == [v.name for v in own.x]
    rates = [
        model.function("ode")(0.0, model.initial_state(), np.zeros(len(model.z)), [], []).full()
        for model in (given, own)
    ]
    np.testing.assert_array_equal(*rates)


def test_parameters_of_places_have_endings_where_they_share_a_name() -> None:
    scene = FourMass(sf.BrownMcPhee(), guide_3=sf.Coulomb(mu_d=0.2), guide_4=sf.LuGre(mu_s=0.4))
    found = {n: p.value for n, p in sf.parameters(scene).items()}
    assert (found["mu_d_1"], found["mu_d_2"], found["mu_d_3"]) == (0.1, 0.2, 0.1)
    assert (found["mu_s_1"], found["mu_s_3"], found["sigma_0"]) == (0.15, 0.4, 1e5)


def test_the_guide_of_the_slider_takes_its_share_of_the_energy() -> None:
    """And it is the law at the speed and the normal force of the guide."""
    law = sf.BrownMcPhee(mu_s=0.1, mu_d=0.08, v_t=0.01)
    run = sf.simulate(SliderCrank.preset("haug_with_guide", law).model(), 0.25, rtol=1e-9)
    alone = sf.simulate(SliderCrank.preset("haug", law).model(), 0.25, rtol=1e-9)
    assert run["slider_friction"] == pytest.approx(
        [law.force(v, N) for v, N in zip(run["slider_rate"], run["slider_N"], strict=True)],
        abs=1e-8,
    )
    assert run["slider_N"].min() > 0
    assert run.energy_balance().relative < 1e-6
    assert run["energy"][-1] < alone["energy"][-1] - 10.0
