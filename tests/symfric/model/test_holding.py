"""Applied forces that follow from the equations, which keep the slip of contacts that stick."""

from collections.abc import Callable
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from symfric import ExactCoulomb, Hold, Karnopp, Law, LuGre, Model, Variable, contact, simulate

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
