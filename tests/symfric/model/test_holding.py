"""Applied forces that follow from the equations, which keep the slip of contacts that stick.

Contacts of a model: closed by their laws, open with the forces as inputs, closed otherwise.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import symfric as sf
from symfric import ExactCoulomb, Hold, Karnopp, Law, LuGre, Model, Variable, contact, simulate
from symfric.scenes import ALL_SCENES, Drive, QuarterCar

COULOMB = ExactCoulomb(mu_s=0.3, mu_d=0.2)


def sled(law: Law, by_hand: bool = False) -> Model:
    """2 kg pulled by a spring of 50 N/m whose end moves at 20 mm/s."""
    s, v = Variable("s", "m", nominal=0.1), Variable("v", "m/s", nominal=0.1)
    if by_hand:
        slip = contact("ground", law, v, 2 * 9.81, rest={"v": 0.0}, F_e=50 * s)
    else:
        slip = contact("ground", law, v, 2 * 9.81)
    rate = (50 * s - slip.force) / 2
    return Model("sled", x=(s, v), ode=ca.vertcat(0.02 - v, rate), contacts=(slip,))


def stack(law: Law, masses: tuple[float, ...] = (3.0, 2.0, 0.5)) -> Model:
    """Blocks on top of each other on a shaken table, each tied to a wall by a spring."""
    t, n = ca.SX.sym("t"), len(masses)
    x = [Variable(f"x{i}", "m", nominal=0.1) for i in range(n)]
    v = [Variable(f"v{i}", "m/s", nominal=0.1) for i in range(n)]
    floor = 0.2 * ca.sin(4 * t)
    below = [floor, *(a.symbol for a in v)]
    slips = [contact(f"c{i}", law, v[i].symbol - below[i], 9.81 * sum(masses[i:]))
             for i in range(n)]  # fmt: skip
    forces = [*(c.force for c in slips), ca.SX(0)]
    rates = [(forces[i + 1] - forces[i] - (20.0 + 30 * i) * x[i]) / m for i, m in enumerate(masses)]
    speeds = [a.symbol for a in v]
    return Model("stack", t=t, x=(*x, *v), ode=ca.vertcat(*speeds, *rates), contacts=tuple(slips))


def test_contacts_that_stick_keep_their_sliding_velocity_whatever_the_others_do() -> None:
    model, random = stack(COULOMB), np.random.default_rng(1)
    slips = ca.vertcat(*(c.slip for c in model.contacts))
    change = ca.jtimes(slips, model.vector("x"), model.ode) + ca.jacobian(slips, model.t)
    rates = ca.Function("rates", [model.t, model.vector("x")], [change])
    for modes in product((-1.0, 0.0, 1.0), repeat=3):
        found = rates(0.3, [*random.normal(size=6), *modes]).full()[:, 0]
        assert np.abs(found[np.array(modes) == 0]).max(initial=0.0) < 1e-12
        assert np.abs(found[np.array(modes) != 0]).min(initial=1.0) > 1e-6


@pytest.mark.parametrize("law", [COULOMB, Karnopp(), Karnopp(form="event"), LuGre()], ids=str)
def test_one_contact_moves_as_with_the_applied_force_given(law: Law) -> None:
    found, given = simulate(sled(law), 5.0), simulate(sled(law, by_hand=True), 5.0)
    assert found.status.ok
    for name in ("s", "v"):
        np.testing.assert_allclose(found[name], given[name], rtol=0, atol=1e-7)


def test_sliding_ends_at_a_velocity_of_exactly_zero() -> None:
    """One state is reset: one that the fewest other contacts slide with."""
    model = stack(COULOMB)
    assert [[*c.rest] for c in model.contacts] == [["v0"], ["v0"], ["v2"]]
    values = {"v0": 0.7, "v1": 0.4, "v2": -0.2}
    x = [values.get(v.name, 0.0) for v in model.x]
    for c, slip_of in zip(model.contacts, (0.0, 0.4, 0.4), strict=True):
        (value,) = c.rest.values()
        got = ca.Function("rest", [model.t, model.vector("x")], [value])(0.0, x)
        assert float(got) == pytest.approx(slip_of, rel=1e-15)


LEVELS = 0.2 * 9.81 * np.array([5.0, 2.0])


def test_stacked_blocks_move_as_with_modes_found_by_trial() -> None:
    """Static and dynamic level are equal, so that the motion is unique."""
    model = stack(ExactCoulomb(mu_s=0.2, mu_d=0.2), (3.0, 2.0))
    run = simulate(model, 4.0, x0={"x0": 0.8, "x1": -0.5})
    end, switches = by_trial(np.array([0.8, -0.5, 0.0, 0.0]), 4.0)
    assert switches > 4
    found = [run.final[name] for name in ("x0", "x1", "v0", "v1")]
    np.testing.assert_allclose(found, end, rtol=0, atol=1e-6)


def by_trial(y: np.ndarray, t_end: float) -> tuple[np.ndarray, int]:
    """Integrate two blocks of `stack` by SciPy, with all modes tried at each switching time."""
    t, switches, modes = 0.0, 0, first(0.0, y)
    while t < t_end:
        events = [switching(i, modes) for i in range(2)]
        part = solve_ivp(
            lambda t, y, modes=modes: motion(t, y, modes)[0], (t, t_end), y, "DOP853",
            events=events, rtol=1e-11, atol=1e-13, max_step=0.05,
        )  # fmt: skip
        t, y = float(part.t[-1]), part.y[:, -1].copy()
        for i in (i for i in range(2) if len(part.t_events[i])):
            switches += 1
            if modes[i]:
                y[2 + i] -= slips(t, y)[i]
                modes = first(t, y)
            else:
                modes = replaced(modes, i, int(np.sign(motion(t, y, modes)[1][i])))
    return y, switches


def replaced(modes: tuple[int, ...], i: int, mode: int) -> tuple[int, ...]:
    return *modes[:i], mode, *modes[i + 1 :]


def slips(t: float, y: np.ndarray) -> np.ndarray:
    return np.array([y[2] - 0.2 * np.sin(4 * t), y[3] - y[2]])


def motion(
    t: float, y: np.ndarray, modes: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rates, friction forces and rates of the sliding velocities in given modes.

    Unknowns are the two accelerations and the two friction forces.
    """
    A = np.array([[3.0, 0, 1, -1], [0, 2.0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]])
    b = np.array([-20.0 * y[0], -50.0 * y[1], *(LEVELS * modes)])
    table = 0.8 * np.cos(4 * t)
    for i, row in enumerate(([1.0, 0, 0, 0], [-1.0, 1, 0, 0])):
        if modes[i] == 0:
            A[2 + i], b[2 + i] = row, table * (i == 0)
    a0, a1, *F = np.linalg.solve(A, b)
    return np.array([y[2], y[3], a0, a1]), np.array(F), np.array([a0 - table, a1 - a0])


def first(t: float, y: np.ndarray) -> tuple[int, ...]:
    """The consistent modes."""
    s = slips(t, y)
    for modes in product((0, -1, 1), repeat=2):
        _, F, change = motion(t, y, modes)
        if all(
            mode == np.sign(s[i]) if abs(s[i]) > 1e-9
            else abs(F[i]) <= LEVELS[i] if mode == 0 else mode * change[i] > 0
            for i, mode in enumerate(modes)
        ):  # fmt: skip
            return modes
    raise AssertionError("no consistent modes")


def switching(i: int, modes: tuple[int, ...]) -> Callable[[float, np.ndarray], float]:
    """The end of sliding, or break-away, of contact i."""

    def event(t: float, y: np.ndarray) -> float:
        if modes[i]:
            return modes[i] * slips(t, y)[i] + 1e-13
        return float(LEVELS[i] * (1 + 1e-13) - abs(motion(t, y, modes)[1][i]))

    event.terminal, event.direction = True, -1  # pyright: ignore[reportFunctionMemberAccess]
    return event


X, V, U = Variable("x", "m"), Variable("v", "m/s"), Variable("u", "N")


FLOOR, MOVED = (contact("floor", COULOMB, slip, 1.0) for slip in (V, V - U))
ONE, TWO = (contact(name, Karnopp(), V, 1.0) for name in ("one", "two"))
A, RATES = Variable("a", "m/s^2"), ca.SX.sym("rates", 3)
UNDETERMINED: dict[str, dict[str, Any]] = {
    "accelerations and normal forces affine in the friction forces": {"ode": -(FLOOR.force**2)},
    "equations in which the friction force acts on the slip": {"ode": U.symbol},
    "a sliding velocity without inputs": {"contacts": (MOVED,), "ode": -MOVED.force},
    "no other contact on it whose law needs F_e":
        {"contacts": (ONE, TWO), "ode": U - ONE.force - TWO.force},
    "equations without algebraic variables that depend on friction":
        {"contacts": (ONE,), "ode": A.symbol, "z": (A,), "alg": 2 * A + ONE.force - U},
    "a sliding velocity without inputs, whose":
        {"contacts": (MOVED,), "ode": A.symbol, "z": (A,), "alg": 2 * A + MOVED.force - U},
    "explicit equations":
        {"xdot": RATES, "residual": RATES + ca.vertcat(-V, RATES[1] + FLOOR.force, 0)},
}  # fmt: skip
"""Expected text -> the parts of a model that does not determine its applied force."""


def test_forces_that_the_equations_do_not_determine_are_refused() -> None:
    for expected, parts in UNDETERMINED.items():
        if "ode" in parts:
            parts = parts | {"ode": ca.vertcat(V, parts["ode"])}
        with pytest.raises(ValueError, match=f"F_e: expected {expected}.*contact.*F_e=pull"):
            Model("own", x=(X, V), u=(U,), **{"contacts": (FLOOR,)} | parts)


def blocks(implicit: bool) -> Model:
    """Two blocks with a spring between them; their accelerations are algebraic variables or not.

    A tenth of the friction of the first block also acts on the second one.
    """
    x = [Variable(f"x{i}", "m") for i in range(2)]
    v = [Variable(f"v{i}", "m/s") for i in range(2)]
    a = [Variable(f"a{i}", "m/s^2") for i in range(2)]
    u, speeds = Variable("u", "N"), [s.symbol for s in v]
    pull = 40.0 * (x[0] - x[1])
    c = [contact(f"c{i}", ExactCoulomb(mu_s=0.3, mu_d=0.3), v[i], 10.0 + 5 * i) for i in range(2)]
    rates = [(u - pull - c[0].force) / 2.0, pull - c[1].force - 0.1 * c[0].force]
    parts: dict[str, Any] = {"ode": ca.vertcat(*speeds, *rates)}
    if implicit:
        accelerations = [s.symbol for s in a]
        alg = ca.vertcat(*accelerations) - ca.vertcat(*rates)
        parts = {"z": tuple(a), "ode": ca.vertcat(*speeds, *accelerations), "alg": alg}
    return Model("blocks", x=(*x, *v), u=(u,), contacts=tuple(c), **parts)


def test_applied_forces_may_be_algebraic_variables() -> None:
    """Both forms of the equations have the same motion, also if the modes change together."""
    rng = np.random.default_rng(4)
    u = {"u": Hold(np.linspace(0.0, 2.5, 10, endpoint=False), rng.uniform(-20, 20, 10))}
    one, other = (simulate(blocks(form), 2.5, u=u, rtol=1e-10) for form in (False, True))
    assert len(one.happened) > 5
    for name in ("x0", "x1", "v0", "v1"):
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=1e-7)


def test_contacts_of_one_motion_are_refused() -> None:
    """Their shares are undetermined in stick; two blocks, or one and its sum, are determined."""
    one, two = (contact(name, COULOMB, V, 5.0) for name in ("one", "two"))
    with pytest.raises(ValueError, match=r"in stick the equations determine, got one, two, which"):
        Model("own", x=(X, V), u=(U,), contacts=(one, two),
              ode=ca.vertcat(V, U - one.force - two.force))  # fmt: skip
    assert len(blocks(False).contacts) == 2


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
