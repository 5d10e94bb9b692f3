"""Branches over a parameter against closed forms, other integrators and published values."""

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hunting import hunting
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from symfric import (
    ExactCoulomb,
    LuGre,
    Model,
    Variable,
    contact,
    drive,
    rabinowicz,
    simulate,
    simulate_many,
)
from symfric.bench.dynamics import EXACT, LEVELS, belt
from symfric.dynamics import (
    continuation,
    curve,
    equilibrium,
    linearize,
    load_branch,
    orbits_from,
    periodic_orbit,
)
from symfric.laws import Stribeck


def slope(speed: float) -> float:
    """Derivative of the friction force of `EXACT` by the sliding speed."""
    return 0.1 - 0.5 * 2 * speed / 0.2**2 * np.exp(-((speed / 0.2) ** 2))


def highest(rates: Callable[[float, np.ndarray], list[float]], start: list[float]) -> float:
    """Next largest velocity of an oscillation that starts at its largest one or falls from it."""

    def turns(t: float, y: np.ndarray) -> float:
        return rates(t, y)[1]

    turns.terminal, turns.direction = True, -1
    accuracy = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    half = solve_ivp(rates, (0.0, 2.0), start, **accuracy).y[:, -1]
    found = solve_ivp(rates, (2.0, 20.0), half, events=turns, **accuracy)
    return float(found.y[1, -1])


def grazing_speed() -> float:
    """Speed of the belt at which a sliding orbit touches it, by an explicit integrator.

    At the touching point, v = v_b and v' = 0, so that x is the static force.
    """

    def miss(speed: float) -> float:
        def rates(_: float, y: np.ndarray) -> list[float]:
            r = y[1] - speed
            return [y[1], -y[0] + 1 + 0.5 * np.exp(-((r / 0.2) ** 2)) - 0.1 * r]

        return highest(rates, [1.5, speed]) - speed

    return float(brentq(miss, 1.2, 1.6, xtol=1e-13))


@pytest.mark.slow
def test_the_belt_has_its_hopf_points_and_its_grazing() -> None:
    model = belt(EXACT)
    rest = continuation(equilibrium(model), "v_b", (0.002, 0.9))
    expected = [brentq(slope, 1e-3, 0.1, xtol=1e-15), brentq(slope, 0.3, 0.6, xtol=1e-15)]
    found = rest.located("Hopf")
    assert [h.value for h in found] == pytest.approx(expected, rel=1e-9)
    orbits = orbits_from(rest, found[-1], (0.05, 2.0))
    (grazing,) = orbits.special
    assert grazing.kind == "grazing"
    assert grazing.value == pytest.approx(grazing_speed(), abs=1e-7)
    assert grazing.value == pytest.approx(1.43549791, abs=1e-7)
    unstable = ~orbits.stable
    assert {*np.array(orbits.sequences)[unstable]} == {""} and unstable[: grazing.index].all()
    assert {*np.array(orbits.sequences)[~unstable]} == {"stick slip"}
    at = int(np.argmin(np.abs(orbits.values - 0.8) + unstable))
    orbit = orbits.orbit(at)
    again = periodic_orbit(model, orbit, p={"v_b": 0.8}, rtol=1e-11)
    assert again.period == pytest.approx(6.5195048139, rel=1e-9)
    slow = periodic_orbit(model, again, p={"v_b": 0.5}, rtol=1e-11)
    assert slow.period == pytest.approx(7.0168182477, rel=1e-9)


@pytest.mark.slow
def test_the_fold_of_the_smooth_belt_is_that_of_auto() -> None:
    for width, fold in ((1e-2, 1.37016), (1e-3, 1.42829)):
        model = belt(Stribeck(v_eps=width, **LEVELS))
        rest = continuation(equilibrium(model), "v_b", (0.1, 0.9))
        orbits = orbits_from(rest, rest.located("Hopf")[-1], (0.3, 2.0))
        (found,) = orbits.special
        assert found.kind == "fold" and found.value == pytest.approx(fold, abs=1e-5)
        assert not orbits.stable[: found.index - 1].any()
        assert orbits.stable[found.index : found.index + 20].all()


@pytest.mark.slow
def test_a_fold_does_not_depend_on_range_and_step() -> None:
    law = ExactCoulomb(mu_s=0.3, mu_d=0.1, v_s=0.05, form="stribeck")
    model = hunting(law, Variable("k_d", "N s/m", start=3.0), 25.0)
    orbit = periodic_orbit(model, simulate(model, 150.0))
    branches = [
        continuation(orbit, "k_d", (2.0, high), step=step)
        for high, step in ((20.0, 0.05), (200.0, 0.05), (20.0, 0.03))
    ]
    found = [b.located("fold")[0].value for b in branches]
    assert found == pytest.approx([9.1234419577] * 3, abs=1e-8)
    near = np.abs(branches[0].values - 0.98 * found[0]) + 99 * ~branches[0].stable
    start = branches[0].orbit(int(near.argmin())).x
    # below it, the orbit of the example hunts; above, every motion comes to rest
    for share, rests in ((0.99, False), (1.01, True)):
        p = {"k_d": share * found[0]}
        late = simulate(model, 400.0, x0=start, p=p, rtol=1e-8).at([390.0, 394.0, 398.0])
        assert bool(np.abs(late["x"]).max() < 1e-6) is rests


@pytest.mark.slow
def test_bristles_double_their_period_before_the_fold() -> None:
    model = belt(LuGre(**LEVELS))
    run = simulate(model, 60.0, x0={"x": 0.0, "v": 0.8}, rtol=1e-8)
    branch = continuation(periodic_orbit(model, run), "v_b", (0.3, 1.5))
    assert [s.kind for s in branch.special] == ["period doubling", "fold", "Hopf"]
    doubling, fold, hopf = branch.special
    assert doubling.value < fold.value
    rest = continuation(equilibrium(model), "v_b", (0.3, 0.9))
    assert hopf.value == pytest.approx(rest.located("Hopf")[-1].value, abs=1e-4)
    # beyond the doubling, a deviation of the stick-slip orbit alternates and grows
    k = next(i for i, m in enumerate(branch.exponents) if m[0].real < -2)
    orbit = branch.orbit(k, rtol=1e-11)
    start = {**orbit.x, "x": orbit.x["x"] + 1e-6}
    later = simulate(model, 70.0, x0=start, p=orbit.p, rtol=1e-11)
    off = np.diff(later.crossings("v", 1)) - orbit.period
    assert off[4:8] / off[3:7] == pytest.approx(np.full(4, orbit.multipliers[0].real), rel=0.02)


def family(rate: ca.SX, x: Variable, p: Variable) -> Model:
    return Model("family", x=(x,), p=(p,), ode=rate)


def test_equilibria_pass_a_fold_and_a_branch_point() -> None:
    x, p = Variable("x", "m", start=1.0), Variable("p", "1", start=1.0)
    fold = continuation(equilibrium(family(p - x**2, x, p)), "p", (-1.0, 1.5))
    (found,) = fold.special
    assert found.kind == "fold" and abs(found.value) < 1e-9 and abs(found.x[0]) < 1e-4
    assert np.abs(fold.x[:, 0] ** 2 - fold.values).max() < 1e-8
    assert (fold.stable == (fold.x[:, 0] > 0)).all()
    pitch = family(p * x - x**3, x, p)
    line = continuation(equilibrium(pitch, guess={"x": 0.0}), "p", (-1.0, 1.5))
    (found,) = line.special
    assert found.kind == "branch point" and abs(found.value) < 1e-9
    assert (line.stable == (line.values < 0)).all() and np.abs(line.x).max() < 1e-9


def test_stability_of_a_branch_is_that_of_its_linear_models() -> None:
    x, v, p = Variable("x", "m"), Variable("v", "m/s"), Variable("p", "1", start=0.3)
    rates = {
        0: ca.vertcat(v, -(1 + p) * x),
        1: ca.vertcat(v, p - v),  # x is cyclic
        -1: ca.vertcat(v, (1 + p) * v - x),
    }
    for expected, ode in rates.items():
        at = equilibrium(Model("two", x=(x, v), p=(p,), ode=ode))
        branch = continuation(at, "p", (0.1, 0.5), points=9)
        assert (branch.stability == expected).all()
        assert linearize(at.model, at).stable is {1: True, 0: None, -1: False}[expected]
        assert {1: "stable", 0: "limit", -1: "unstable"}[expected] in repr(branch)
    assert [*set(branch.to_dict()["stable"])] == [False]


def test_the_number_of_points_counts_both_directions() -> None:
    x, p = Variable("x", "m"), Variable("p", "1", start=0.49)
    at = equilibrium(family(p - x, x, p))
    for points, message in ((9, "ends after 9 points"), (80, "ends at the given range")):
        branch = continuation(at, "p", (-2.0, 0.5), points=points)
        assert branch.values.size <= points and branch.message.split("; ")[0] == message
    assert continuation(at, "p", (-2.0, 0.5), points=9).values.size == 9


def test_a_radial_oscillator_has_its_branch_of_orbits() -> None:
    # r' = r (p - r^2), angle' = 2: orbits r = sqrt(p), multiplier exp(-2 pi p)
    x, y, p = Variable("x", "m", start=1.0), Variable("y", "m"), Variable("p", "1", start=1.0)
    radial = p - x**2 - y**2
    model = Model("ring", x=(x, y), p=(p,), ode=ca.vertcat(x * radial - 2 * y, y * radial + 2 * x))
    origin = equilibrium(model, p={"p": 0.3}, guess={"x": 0.0})
    rest = continuation(origin, "p", (-0.5, 0.5), points=40)
    (hopf,) = rest.special
    assert hopf.kind == "Hopf" and abs(hopf.value) < 1e-9
    assert hopf.period == pytest.approx(np.pi, rel=1e-9)
    branch = orbits_from(rest, hopf, (-0.5, 0.5), points=40, rtol=1e-11)
    assert np.abs(branch.high[:, 0] ** 2 - branch.values).max() < 1e-6
    assert branch.exponents[5:, 0].real == pytest.approx(
        np.exp(-2 * np.pi * branch.values[5:]), rel=1e-4
    )
    assert branch.stable[2:].all() and "periodic orbits" in repr(branch)
    orbit = periodic_orbit(model, simulate(model, 20.0))
    down = continuation(orbit, "p", (-0.5, 1.5), points=80)
    (end,) = down.special
    assert end.kind == "Hopf" and abs(end.value) < 1e-5


def test_inputs_stay_those_of_the_start() -> None:
    x, y, p, a = Variable("x", "m"), Variable("y", "m"), Variable("p", "1"), Variable("a", "1")
    radial = a - x**2 - y**2
    ode = ca.vertcat(x * radial - (2 + p) * y, y * radial + (2 + p) * x)
    model = Model("ring", x=(x, y), u=(a,), p=(p,), ode=ode)
    start = {"x": 1.5, "y": 0.0}
    orbit = periodic_orbit(model, simulate(model, 20.0, x0=start, u={"a": 2.0}), u={"a": 2.0})
    branch = continuation(orbit, "p", (-0.5, 0.5), points=10)
    assert branch.u == {"a": 2.0}
    assert branch.orbit(3).amplitude("x") == pytest.approx(np.sqrt(2.0), rel=1e-6)
    at = equilibrium(model, u={"a": -1.0})
    assert continuation(at, "p", (-0.5, 0.5), points=4).stable.all()


def test_a_belt_whose_speed_is_an_input_has_its_grazing() -> None:
    x, v = Variable("x", "m"), Variable("v", "m/s", start=0.8)
    speed, c = Variable("v_b", "m/s", start=0.8), Variable("c", "N s/m")
    pull = -x.symbol - c * v
    slip = contact("belt", EXACT, v - speed, 1.0, {"v": speed.symbol}, F_e=pull)
    rates = ca.vertcat(v.symbol, pull - slip.force)
    model = Model("belt", x=(x, v), u=(speed,), p=(c,), ode=rates, contacts=(slip,))
    u = {"v_b": 0.75}
    orbit = periodic_orbit(model, simulate(model, 30.0, u=u), u=u)
    branch = continuation(orbit, "c", (-0.02, 0.3))
    (end,) = branch.special

    def miss(c: float) -> float:
        def rates(_: float, y: np.ndarray) -> list[float]:
            r = y[1] - 0.75
            return [y[1], -y[0] - c * y[1] + 1 + 0.5 * np.exp(-((r / 0.2) ** 2)) - 0.1 * r]

        return highest(rates, [1.5 - 0.75 * c, 0.75]) - 0.75

    assert end.kind == "grazing"
    assert end.value == pytest.approx(brentq(miss, 0.05, 0.25, xtol=1e-13), abs=1e-7)
    assert branch.values.min() == pytest.approx(-0.02, abs=1e-7)
    assert branch.stable.all() and "grazing" in branch.message


def test_sliding_ends_where_the_belt_stops() -> None:
    model = rabinowicz(ExactCoulomb(), free=["v_belt"])
    branch = continuation(equilibrium(model), "v_belt", (-0.5, 0.5), points=60)
    assert 0 < branch.values.min() < 1e-6 and branch.values.max() == pytest.approx(0.5, abs=1e-9)
    assert "comes to rest" in branch.message
    mu_d = ExactCoulomb().mu_d
    assert branch.x[:, 0] == pytest.approx(np.full(branch.values.size, mu_d * 0.8 * 9.81 / 2.1))


def test_a_branch_is_saved_shown_and_interrupted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    x, p = Variable("x", "m", start=1.0), Variable("p", "1", start=1.0)
    start = equilibrium(family(p - x**2, x, p))
    branch = continuation(start, "p", (-1.0, 1.5))
    branch.save(tmp_path / "branch.npz")
    again = load_branch(tmp_path / "branch.npz")
    assert all(
        np.array_equal(getattr(again, n), getattr(branch, n)) for n in ("values", "x", "parts")
    )
    assert again.special[0].kind == "fold" and again.model.name == "family"
    (axis,) = again.plot("x").axes
    assert axis.get_xlabel() == "p [1]" and axis.get_ylabel() == "x [m]"
    styles = {line.get_linestyle() for line in axis.lines}
    assert {"-", "--"} <= styles and [t.get_text() for t in axis.texts] == ["fold"]
    (legend,) = axis.figure.legends
    assert [t.get_text() for t in legend.get_texts()] == ["equilibria", "unstable"]
    model, start_x = start.model, np.array([-0.5, 0.9])
    speeds = np.array([0.5, 1.0])
    study = simulate_many(model, 20.0, p={"p": speeds}, x0={"x": start_x}, t_eval=[19.0, 20.0])
    (axis,) = branch.plot("x", runs=[study]).axes
    dots = [line for line in axis.lines if line.get_marker() == "o"]
    assert dots[0].get_ydata() == pytest.approx(np.sqrt(speeds), rel=1e-5)
    with pytest.raises(ValueError, match="that vary p"):
        branch.plot("x", runs=[simulate_many(model, 1.0, x0={"x": start_x})])
    own, calls = curve.corrected, []

    def interrupted(*arguments: object) -> object:
        calls.append(1)
        if len(calls) == 6:
            raise KeyboardInterrupt
        return own(*arguments)  # pyright: ignore

    monkeypatch.setattr(curve, "corrected", interrupted)
    part = continuation(start, "p", (-1.0, 1.5))
    assert "interrupted" in part.message and 1 < part.values.size < branch.values.size


def test_what_has_no_branch_is_refused() -> None:
    model = belt(EXACT)
    at = equilibrium(model)
    stuck = equilibrium(drive(ExactCoulomb(), free=["mu_s"]), u={"force": 0.2})
    held = Model(
        "held", x=(x := Variable("x", "m"), v := Variable("v", "m/s")),
        p=(k := Variable("k", "N/m", start=1.0),),
        contacts=(c := contact("floor", ExactCoulomb(), v.symbol, 1.0, {"v": 0.0}),),
        ode=ca.vertcat(v.symbol, -k * x - c.force),
    )  # fmt: skip
    rest = continuation(at, "v_b", (0.7, 0.9), points=6)
    heavy = equilibrium(rabinowicz(EXACT, free=["m"]))
    for call, text in {
        lambda: continuation(at, "v", (0.1, 1.0)): "expected one of v_b, got v",
        lambda: continuation(at, "v_b", (0.1, 0.5)): "contains the start, v_b = 0.8",
        lambda: continuation(at, "v_b", (0.9, 0.5)): "contains the start",
        lambda: continuation(at, "v_b", (0.5,)): "between",
        lambda: continuation(heavy, "m", (-1.0, 2.0)): r"m: expected a number > 0 \[kg\], got -1",
        lambda: continuation(at, "v_b", (0.5, 0.9), points=1): "points",
        lambda: continuation(at, "v_b", (0.5, 0.9), step=0.0): "step",
        lambda: continuation(model, "v_b", (0.5, 0.9)): "an equilibrium or a periodic orbit",
        lambda: continuation(equilibrium(held), "k", (0.5, 2.0)): "an isolated equilibrium",
        lambda: orbits_from(rest, at, (0.5, 0.9)): "a Hopf point",
        lambda: orbits_from(None, at, (0.5, 0.9)): "branch: expected a branch of equilibria",  # pyright: ignore[reportArgumentType]
        lambda: rest.located("hopf"): "located: expected one of fold, Hopf, .*, got hopf",
        lambda: rest.orbit(0): "a branch of orbits",
        lambda: rest.plot("y"): "got y",
        lambda: load_branch("no such file"): "a saved branch",
    }.items():
        with pytest.raises(ValueError, match=text):
            call()
    assert stuck.contacts[0].state == "stick"
