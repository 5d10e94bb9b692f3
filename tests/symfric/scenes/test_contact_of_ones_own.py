"""`contact` puts any law into equations that a user writes."""

import casadi as ca
import numpy as np
import pytest

import symfric
from symfric import (
    ALL_LAWS,
    Coulomb,
    Law,
    LuGre,
    Model,
    Output,
    Variable,
    contact,
    rabinowicz,
    simulate,
)  # fmt: skip


def belt(law: Law) -> Model:
    """Rabinowicz's block, written by a user."""
    x, v = Variable("x", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
    pull = -2.1 * x.symbol
    slip = contact("belt", law, v.symbol - 0.1, 0.8 * 9.81, rest={"v": 0.1}, F_e=pull)
    rate = (pull - slip.force) / 0.8
    outputs = {"friction": Output(slip.force, "N")}
    ode = ca.vertcat(v.symbol, rate)
    return Model("own", x=(x, v), ode=ode, contacts=(slip,), outputs=outputs)


def test_equations_of_ones_own_run_as_the_scene_does() -> None:
    for name in ("brown_mcphee", "lugre", "exact_coulomb", "karnopp"):
        own, scene = belt(ALL_LAWS[name]()), rabinowicz(ALL_LAWS[name]())
        one, other = (simulate(model, 3.0, samples=51) for model in (own, scene))
        assert one.statistics.steps == other.statistics.steps, name
        np.testing.assert_array_equal(one["x"], other["x"])
        np.testing.assert_array_equal(one["friction"], other["friction"])


def test_a_sled_slides_as_the_closed_form_says() -> None:
    x, v, pull = Variable("x", "m"), Variable("v", "m/s"), Variable("pull", "N")
    slip = contact("floor", Coulomb(mu_d=0.1, v_eps=1e-5), v.symbol, 10.0)
    ode = ca.vertcat(v.symbol, (pull.symbol - slip.force) / 2.0)
    model = Model("sled", x=(x, v), u=(pull,), ode=ode, contacts=(slip,))
    run = simulate(model, 1.0, u={"pull": 3.0}, rtol=1e-9)
    assert run.final["v"] == pytest.approx(1.0, rel=1e-4)


def test_two_contacts_have_states_of_their_own_names() -> None:
    v = Variable("v", "m/s")
    pairs = [("left", True), ("right", True)]
    with pytest.raises(ValueError, match="got z; contacts made with bare=False call their states"):
        bare = tuple(contact(n, LuGre(), v.symbol, 1.0, bare=b) for n, b in pairs)
        Model("two", x=(v,), ode=-bare[0].force - bare[1].force, contacts=bare)
    both = tuple(contact(n, LuGre(), v.symbol, 1.0, bare=False) for n, _ in pairs)
    model = Model("two", x=(v,), ode=-both[0].force - both[1].force, contacts=both)
    assert [s.name for s in model.x] == ["v", "left_z", "right_z"]


def test_a_contact_that_turns_has_its_units() -> None:
    w = Variable("w", "rad/s")
    hub = contact("hub", LuGre(mu_s=1.4, mu_d=0.9), w.symbol, 1.0, rest={"w": 0.0}, turning=True)
    model = Model("hub", x=(w,), ode=-hub.force / 0.01, contacts=(hub,))
    assert [state.unit for state in model.x] == ["rad/s", "rad"]


def test_the_front_door_names_all_that_it_hands_out() -> None:
    said = symfric.__doc__ or ""
    laws = {kind.__name__ for kind in ALL_LAWS.values()}
    for name in symfric.__all__:
        thing = getattr(symfric, name)
        is_law = isinstance(thing, type) and issubclass(thing, Law | symfric.Population)
        assert name in said or name in laws or is_law, name
    with pytest.raises(AttributeError) as error:
        symfric.Lugre  # noqa: B018  # pyright: ignore
    assert (error.value.name, error.value.obj) == ("Lugre", symfric)  # Python offers LuGre by these
