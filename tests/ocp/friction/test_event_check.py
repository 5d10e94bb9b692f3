"""Motions with exact Coulomb friction, against the simulation of the law and closed forms."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from rigs import blocks

from ocp.friction.event_check import set_valued
from symfric import (
    GMS,
    BrownMcPhee,
    Contact,
    ExactCoulomb,
    Hold,
    Linear,
    LuGre,
    Model,
    Variable,
    drive,
    simulate,
)
from symfric.foundation.status import SolveError, Status
from symfric.model import Event
from symfric.scenes import FourBar, FourMass, Pendulum, PendulumBox, Rabinowicz

LAW = ExactCoulomb(mu_s=0.3, mu_d=0.2)


def random_hold(seed: int, most: float, count: int = 16) -> Hold:
    rng = np.random.default_rng(seed)
    return Hold(np.linspace(0.0, 4.0, count, endpoint=False), rng.uniform(-most, most, count))


def kinds(motion: Any, name: str) -> list[str]:
    return [m.kind for m in motion.modes[name]]


def same(model: Model, t_end: float, names: tuple[str, ...], **given: Any) -> Any:
    """The motion by both, equal to 1e-8."""
    motion = set_valued(model, t_end, rtol=1e-10, samples=201, **given)
    run = simulate(model, t_end, rtol=1e-10, atol=1e-11, samples=201, **given)
    for name in names:
        assert_allclose(motion[name], run[name], atol=2e-8 * max(1.0, np.abs(run[name]).max()))
    return motion


SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))]


@pytest.mark.parametrize("seed", SEEDS)
def test_held_forces_move_one_and_two_blocks_as_by_the_law(seed: int) -> None:
    law = ExactCoulomb(form="stribeck", mu_s=0.3, mu_d=0.15, v_s=0.05, sigma_2=0.2)
    motion = same(drive(law), 2.0, ("x", "v"), u={"force": random_hold(seed, 4.0)})
    assert "stick" in kinds(motion, "guide")
    assert len(motion.modes["guide"]) >= 3
    names = ("x1", "x2", "v1", "v2")
    motion = same(blocks(LAW), 2.0, names, u={"force": random_hold(seed, 15.0)})
    assert {"slip+", "stick", "slip-"} <= {*kinds(motion, "one"), *kinds(motion, "two")}


def test_rests_end_where_a_force_reaches_the_static_level() -> None:
    """By a function of time, a line, a pulse of a thousandth of the span, and a jump."""
    model = drive(LAW, N=5.0, m=1.0)
    for size in (1.0, 1e-7):
        small = drive(LAW, N=5.0 * size, m=size)
        swing = set_valued(small, 0.5, u={"force": lambda t, s=size: 2.0 * s * ca.sin(ca.pi * t)})
        assert kinds(swing, "guide")[0] == "stick"
        assert swing.modes["guide"][0].end == pytest.approx(np.arcsin(0.75) / np.pi, abs=1e-9)
    line = set_valued(drive(LAW, N=5.0), 1.0, u={"force": Linear([0.0, 1.0], [0.0, -6.0])})
    assert line.modes["guide"][0].end == pytest.approx(0.25, abs=1e-9)
    assert kinds(line, "guide") == ["stick", "slip-"]
    pulse = set_valued(model, 1.0, u={"force": lambda t: 3.0 * ca.exp(-(((t - 0.6) / 1e-3) ** 2))})
    assert kinds(pulse, "guide") == ["stick", "slip+", "stick"]
    half = 1e-3 * np.sqrt(np.log(2.0))
    assert pulse.modes["guide"][0].end == pytest.approx(0.6 - half, abs=1e-9)
    for top, kinds_of in ((1.5, ["stick"]), (1.5 + 1e-6, ["stick", "slip+"])):
        jump = set_valued(model, 1.0, u={"force": Hold([0.0, 0.5], [1.4, top])})
        assert kinds(jump, "guide") == kinds_of


def test_slides_end_at_rest_after_their_way() -> None:
    motion = set_valued(drive(LAW, N=10.0, m=2.0), 3.0, x0={"v": -1.5})
    slide, rest = motion.modes["guide"]
    assert (slide.kind, rest.kind) == ("slip-", "stick")
    assert slide.end == pytest.approx(1.5, abs=1e-9)
    assert motion["x"][-1] == pytest.approx(-1.125, rel=1e-9)
    assert motion["v"][-1] == 0.0
    assert motion["guide_F"][0] == -2.0
    assert_allclose(motion["guide_F"][motion.t > 1.5], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("model", "t_end", "names", "modes"),
    [
        (PendulumBox(LAW, phi_0=1.2, m_box=2.0), 0.3, ("x", "phi", "x_rate", "phi_rate"),
         {"x": ["slip+", "stick", "slip-"]}),
        pytest.param(FourBar(LAW, R=0.1), 0.5, ("theta_crank", "theta_rocker", "theta_coupler"),
                     {"theta_rocker": ["slip+", "slip-", "stick"]}, marks=pytest.mark.slow),
        pytest.param(FourMass(LAW), 4.0, ("x1", "y2", "z3", "x4"), {}, marks=pytest.mark.slow),
        pytest.param(FourBar(LAW), 2.0, ("theta_crank", "theta_rocker"), {},
                     marks=pytest.mark.slow),
        pytest.param(Pendulum(ExactCoulomb(mu_s=0.6, mu_d=0.5)), 5.0, ("phi", "phi_N"), {},
                     marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_friction_from_reactions_and_in_loops_moves_as_by_the_law(
    model: Any, t_end: float, names: tuple[str, ...], modes: dict[str, list[str]]
) -> None:
    motion = same(model.model(), t_end, names)
    assert {name: kinds(motion, name) for name in modes} == modes
    if isinstance(model, FourBar):  # rests as a whole
        assert len({runs[-1].begin for runs in motion.modes.values()}) == 1


def test_belt_carries_and_loses_its_block() -> None:
    motion = same(Rabinowicz(LAW).model(), 15.0, ("x", "v"))
    assert kinds(motion, "belt")[:3] == ["slip-", "stick", "slip-"]
    assert motion.modes["belt"][1].end == pytest.approx(
        motion.modes["belt"][1].begin
        + (0.3 * 0.8 * 9.81 / 2.1 - float(motion.at(motion.modes["belt"][1].begin)["x"][0])) / 0.1,
        abs=1e-6,
    )


@pytest.mark.parametrize("name", ["drive", pytest.param("box", marks=pytest.mark.slow)])
def test_smooth_laws_converge_at_first_order(name: str) -> None:
    """A tenth of v_t, a tenth of the distance; with a static level where nothing is on edge."""
    law = BrownMcPhee(mu_s=0.25, mu_d=0.2)
    if name == "drive":
        model = drive(law, N=5.0, m=1.0, free=["v_t"])
        given: dict[str, Any] = {"u": {"force": Hold([0.0, 0.6, 1.0], [3.0, -3.0, 0.5])}}
        end, signal = 1.6, "x"
    else:
        model = PendulumBox(law, phi_0=1.2, m_box=2.0).model(free=["v_t"])
        given, end, signal = {}, 0.5, "phi"
    exact = set_valued(model, end, **given)[signal][-1]
    far: list[float] = []
    for v_t in (1e-4, 1e-5, 1e-6):
        p = {v.name: v_t for v in model.p}
        run = simulate(model, end, p=p, rtol=1e-10, atol=1e-12, **given)
        far.append(abs(run[signal][-1] - exact))
    assert_allclose(np.divide(far[:-1], far[1:]), 10.0, rtol=0.15)


@pytest.mark.parametrize("law", [GMS(mu_s=0.3, mu_d=0.2, sigma_2=0.3), LuGre(mu_s=0.3, mu_d=0.2)])
def test_dynamic_laws_are_replaced_by_their_sliding_force_and_level(law: Any) -> None:
    """A force far beyond: the same as the dynamic law itself, but for its pre-sliding."""
    model = drive(law, N=10.0, m=1.0)
    motion, run = (f(model, 1.0, u={"force": 8.0}) for f in (set_valued, simulate))
    assert "guide_z" not in motion.trajectory.units
    assert motion["v"][-1] == pytest.approx(run["v"][-1], rel=1e-3)


def test_runs_continue_from_the_end_of_others() -> None:
    model, u = blocks(LAW), {"force": random_hold(5, 15.0)}
    whole = set_valued(model, 0.7, u=u)
    first = set_valued(model, 0.4, u=u)
    rest = set_valued(model, 0.7, t_start=0.4, x0=first.final(), modes=first.last, u=u)
    assert_allclose(rest["x2"][-1], whole["x2"][-1], atol=1e-9)


def test_results_by_name_and_at_any_time() -> None:
    motion = set_valued(blocks(LAW), 1.0, u={"force": 9.0}, samples=11)
    assert motion.t.size == 11
    at = motion.at([0.0, 0.35])
    assert_allclose(at["one_F"][0], 4.0)
    assert_allclose(at["two_F"][0], 50.0 * at["x1"][0], atol=1e-9)
    assert set(motion.trajectory.units) == {"x1", "x2", "v1", "v2", "force", "one_F", "two_F"}
    assert motion.span == (0.0, 1.0)
    run = motion.trajectory
    one, two = run.model.contacts
    assert_allclose(run.of(one.slip - two.slip), motion["v1"] - motion["v2"], atol=1e-12)
    assert np.isnan(run.of(one.states[0].symbol)).all()
    assert run.statistics.steps > 10
    with pytest.raises(ValueError, match=r"trajectory of 'blocks': expected times in"):
        motion.at(2.0)
    with pytest.raises(ValueError, match=r"trajectory of 'blocks'.*got x3"):
        motion["x3"]


def jamming(share: float) -> Model:
    """A load that its own friction presses: N = 10 + share F."""
    x, v, N = Variable("x", "m"), Variable("v", "m/s"), Variable("N", "N", start=10.0)
    u = Variable("force", "N")
    c = Contact("guide", v.symbol, N.symbol, ExactCoulomb(mu_s=0.5, mu_d=0.5),
                given={"F_e": u.symbol}, rest={"v": 0.0})  # fmt: skip
    return Model("jam", x=(x, v), z=(N,), u=(u,), ode=ca.vertcat(v.symbol, u.symbol - c.force),
                 alg=N.symbol - 10.0 - share * c.force, contacts=(c,))  # fmt: skip


def test_undecidable_modes_are_reported() -> None:
    held = set_valued(jamming(1.0), 1.0, u={"force": 9.0})
    assert kinds(held, "guide") == ["stick"]
    assert held["N"][-1] == pytest.approx(19.0)
    loose = set_valued(jamming(1.0), 1.0, u={"force": 11.0})
    assert loose["v"][-1] == pytest.approx(1.0, rel=1e-6)
    assert kinds(set_valued(jamming(3.0), 1.0, u={"force": 90.0}), "guide") == ["stick"]
    with pytest.raises(SolveError, match=r"no unique stick/slip mode: .* guide lifts off") as one:
        set_valued(jamming(3.0), 1.0, x0={"v": 1.0})
    assert one.value.status is Status.SOLVER_FAILED
    v, x = Variable("v", "m/s", start=1.0), Variable("x", "m")
    hill = Contact("hill", v.symbol, 9.81 - v.symbol**2 - 30.0 * x.symbol, ExactCoulomb(),
                   given={"F_e": 1.0}, rest={"v": 0.0})  # fmt: skip
    flying = Model("flying", x=(x, v), ode=ca.vertcat(v.symbol, 1.0 - hill.force), contacts=(hill,))
    with pytest.raises(SolveError, match=r"hill lifts off") as flight:
        set_valued(flying, 1.0)
    assert 0.2 < flight.value.partial.span[1] < 0.3
    partial = set_valued(jamming(3.0), 1.0, x0={"v": -1.0}, throw=False)
    assert partial.status.ok


def test_bad_input_is_refused() -> None:
    model = drive(LAW)
    watched = Model("own", x=model.x[:1], ode=ca.SX(0.0), events=(Event("e", model.x[0].symbol),))
    cases: list[tuple[Any, str]] = [
        (lambda: set_valued(model, 0.0), "set_valued: t_end: expected"),
        (lambda: set_valued(model, 1.0, modes={"belt": 0}), "modes: expected .*got belt"),
        (lambda: set_valued(model, 1.0, u={"push": 0.0}), "got push"),
        (lambda: set_valued(model, 1.0, u={"force": "1"}), "input 'force': expected"),
        (lambda: set_valued(watched, 1.0), "expected no events but those of contacts, got e"),
        (lambda: set_valued(LAW, 1.0), "set_valued: expected a model"),  # type: ignore[arg-type]
    ]
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()
