"""Contacts of a model: closed by their laws, open with the forces as inputs, closed otherwise."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import symfric as sf
from symfric.scenes import ALL_SCENES, Drive, QuarterCar

LAWS: dict[str, sf.Law] = {
    "brown_mcphee": sf.BrownMcPhee(), "lugre": sf.LuGre(), "exact": sf.ExactCoulomb(sigma_2=0.3),
}  # fmt: skip


def behind_spring(law: sf.Law, **contact: Any) -> sf.Model:
    """A load on a guide, moved through a spring: the motor at x1, the load at x."""
    x1, x = sf.Variable("x1", "m"), sf.Variable("x", "m")
    v1, v = sf.Variable("v1", "m/s"), sf.Variable("v", "m/s")
    force = sf.Variable("force", "N", nominal=10.0)
    K = 200.0 * (x1.symbol - x.symbol) + 2.0 * (v1.symbol - v.symbol)
    guide = sf.Contact("guide", v.symbol, 9.81, law, given={"F_e": K}, rest={"v": 0.0}, **contact)
    return sf.Model(
        "behind_spring",
        x=(x1, x, v1, v),
        u=(force,),
        ode=ca.vertcat(v1.symbol, v.symbol, (force.symbol - K) / 0.5, K - guide.force),
        outputs={"friction": sf.Output(guide.force, "N"), "spring": sf.Output(K, "N")},
        contacts=(guide,),
    )


def by_hand(law: sf.Law, x: np.ndarray, u: float) -> np.ndarray:
    """The right-hand side of the same, without a model."""
    x1, at, v1, v = x[:4]
    K = 200.0 * (x1 - at) + 2.0 * (v1 - v)
    F_e = {"F_e": K} if law.inputs else {}
    F = law.force(v, 9.81, x[4:], **F_e)
    rates = np.ravel(law.rate(v, 9.81, x[4:], **F_e))
    return np.array([v1, v, (u - K) / 0.5, K - float(F), *rates])


@pytest.mark.parametrize("name", LAWS)
def test_a_model_closes_itself_with_the_law_of_its_contact(name: str) -> None:
    law, rng = LAWS[name], np.random.default_rng(0)
    model = behind_spring(law)
    assert [v.name for v in model.x[4:]] == [f"guide_{s.name}" for s in law.states]
    f = model.function("ode")
    for _ in range(5):
        x = rng.standard_normal(4 + len(law.states)) * ([1e-3] * 4 + [1e-6] * len(law.states))
        if name == "exact":
            x[4] = rng.integers(-1, 2)
        wanted = by_hand(law, x, 3.0)
        np.testing.assert_allclose(f(0.0, x, [], 3.0, []).full()[:, 0], wanted, rtol=1e-13)
    assert [m.nominal for m in model.monitors] == [1e-3] * (name != "exact")


def test_modes_of_a_user_model_stick_and_slip() -> None:
    """Pulled slowly through its spring the load stands until the spring carries mu_s N."""
    model = behind_spring(sf.ExactCoulomb(mu_s=0.2, mu_d=0.1))
    assert [e.name for e in model.events] == ["guide_stick", "guide_slip"]
    run = sf.simulate(model, 1.0, u={"force": lambda t: 4.0 * t})
    broken = run.t[np.flatnonzero(run["v"] > 0)[0]]
    before = run.t < broken
    assert np.max(np.abs(run["x"][before])) == 0.0
    assert np.interp(broken, run.t, run["spring"]) == pytest.approx(0.2 * 9.81, rel=1e-3)


@pytest.mark.parametrize("scene", ALL_SCENES)
def test_closing_an_open_model_by_the_same_law_gives_the_same_equations(scene: str) -> None:
    model = ALL_SCENES[scene](sf.Stribeck(sigma_2=0.2)).model()
    again = model.with_forces({c.name: c.friction for c in model.contacts})
    rng = np.random.default_rng(2)
    for letter in "xzup":
        assert [v.name for v in getattr(again, letter)] == [v.name for v in getattr(model, letter)]
    x = model.initial_state() + 0.05 * rng.standard_normal(len(model.x))
    z, u = 1.0 + 0.1 * rng.random(len(model.z)), rng.standard_normal(len(model.u))
    for what in ("ode", "alg", "signals"):
        one, other = (m.function(what)(0.7, x, z, u, []).full() for m in (model, again))
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-11)


def test_the_open_model_takes_the_friction_force_as_an_input() -> None:
    model = sf.drive(sf.LuGre())
    assert [v.name for v in model.open.x] == ["x", "v"]
    assert [v.name for v in model.open.u] == ["force", "guide_F"]
    run = sf.simulate(model.open, 1.0, u={"force": 2.0, "guide_F": 0.4})
    assert run["v"][-1] == pytest.approx(1.6 / 0.8)
    turning = Drive(sf.BrownMcPhee(), turning=True).model()
    assert [v.unit for v in turning.open.u] == ["N m", "N m"]
    assert turning.contacts[0].turning


def test_an_unknown_may_hold_the_contact() -> None:
    """F with dv/dt = 0 is the force of the spring."""
    model = behind_spring(sf.BrownMcPhee())
    F = sf.Variable("reaction", "N")
    held = model.with_forces({"guide": F.symbol}, z=(F,), alg=model.open.ode[3])
    run = sf.simulate(held, 0.5, u={"force": 3.0}, rtol=1e-9)
    assert np.max(np.abs(run["x"])) < 1e-15
    np.testing.assert_allclose(run["reaction"], run["spring"], atol=1e-9)
    assert held.contacts == ()
    assert held.open is held


def test_a_load_may_follow_from_the_friction_of_another_contact() -> None:
    x, v = sf.Variable("x", "m"), sf.Variable("v", "m/s", start=1.0)
    one = sf.Contact("one", v.symbol, 10.0, sf.Stribeck(sigma_2=0.1))
    two = sf.Contact("two", v.symbol, 5.0 + one.force, sf.BrownMcPhee())
    model = sf.Model("two", x=(x, v), ode=ca.vertcat(v.symbol, -one.force - two.force),
                  contacts=(one, two))  # fmt: skip
    first = sf.Stribeck(sigma_2=0.1).force(1.0, 10.0)
    both = first + sf.BrownMcPhee().force(1.0, 5.0 + first)
    assert float(model.function("ode")(0.0, [0.0, 1.0], [], [], [])[1]) == pytest.approx(-both)
    loop = replace(one, N=10.0 + two.force)
    with pytest.raises(ValueError, match="contacts: expected friction forces that do not depend"):
        sf.Model("loop", x=(x, v), ode=ca.vertcat(v.symbol, -one.force - two.force),
              contacts=(loop, two))  # fmt: skip


def test_what_is_given_besides_the_applied_force_reaches_both_sides() -> None:
    model = QuarterCar(sf.QuarterCarGeneral(mu=0.05)).model()
    (contact,) = model.contacts
    assert set(contact.further) == {"x_rel", "v_rel"}
    slip = model.with_forces({"guide": contact.sliding(1)})
    still = slip.function("ode")(0.0, [0.0, 1e-3, 0.0, 0.0], [], [], [])
    f_sd = 28900.0 * 1e-3
    pressed = 0.05 * np.hypot(f_sd, 1.0) / np.tan(np.pi / 4 - np.arcsin(
        1e-3 * np.cos(np.pi / 4) / (0.4 - 1e-3 * np.sin(np.pi / 4))))  # fmt: skip
    assert float(still[2]) == pytest.approx((f_sd - 180.0 - pressed) / 240.0)
    assert float(contact.static_level()) == 193.8


@pytest.mark.parametrize("what", ["rate", "force"])
def test_a_user_law_must_return_one_expression(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    changes: dict[str, Callable[[Any], Any]] = {
        "expected an SX expression, got .*vertcat": lambda r: [r],
        "expected an SX expression, got None": lambda _: None,
        "expected 1 row, got the expression": lambda r: ca.vertcat(r, r),
    }
    original = getattr(sf.Dahl, what)
    for message, change in changes.items():
        monkeypatch.setattr(sf.Dahl, what, lambda *given, by=change: by(original(*given)))
        with pytest.raises(ValueError, match=rf"contact 'guide': Dahl\.{what}: {message}"):
            behind_spring(sf.Dahl())
