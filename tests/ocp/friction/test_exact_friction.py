"""Models in modes, and motions with exact Coulomb friction, against laws and closed forms."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from rigs import blocks

from ocp.friction.event_check import set_valued
from ocp.friction.mode_models import mode_model, restless
from ocp.friction.smooth_models import WIDTH, smooth_model, sticking, widths
from symfric import Contact, Hold, Linear, Model, Variable, drive, laws, simulate
from symfric.foundation.status import SolveError, Status
from symfric.laws import BrownMcPhee, ExactCoulomb, LuGre
from symfric.model import Event
from symfric.scenes import FourBar, FourMass, Pendulum, PendulumBox, Rabinowicz, SliderCrank

SHARP = BrownMcPhee(mu_s=0.3, mu_d=0.2, v_t=1e-6)


def test_sliding_of_a_drive_has_its_closed_form() -> None:
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, N_t=1e-3)
    model = drive(law, m=1.0, N=1.0)
    for side in (1, -1):
        slides = mode_model(model, {"guide": side})
        run = simulate(slides, 1.0, u={"force": side * 10.0}, rtol=1e-10)
        assert run["v"][-1] == pytest.approx(side * 12.0 * (1 - np.exp(-0.5)), rel=1e-8)
    back = simulate(mode_model(model, {"guide": 1}), 0.5, u={"force": 0.0}, rtol=1e-10)
    assert back["v"][-1] == pytest.approx(-8.0 * (1 - np.exp(-0.25)), rel=1e-8)


def test_sliding_under_reactions_is_the_sharp_law_beyond_its_layer() -> None:
    """A box pushed by its pendulum, both contacts sliding; the loop of a crank, turning."""
    start = {"x_rate": 2.0, "phi_rate": -4.0}
    for model, modes, x0, end in (
        (PendulumBox(SHARP).model(), {"x": 1, "phi": -1}, start, 0.08),
        (SliderCrank(SHARP).model(), {"crank": 1}, {}, 0.2),
    ):
        slides = simulate(mode_model(model, modes), end, x0=x0, rtol=1e-9)
        sharp = simulate(model, end, x0=x0, rtol=1e-9)
        for name in slides.signals:
            if not name.startswith("constraint"):
                scale = np.abs(sharp[name]).max()
                assert_allclose(slides[name][-1], sharp[name][-1], rtol=1e-5, atol=1e-6 * scale)


def test_contact_at_rest_holds_its_load() -> None:
    """The pendulum stands: R times its reaction is the weight's moment, and the grip tells."""
    model = Pendulum(SHARP, phi_0=0.004).model()
    run = simulate(mode_model(model, {"phi": 0}), 1.0, rtol=1e-9)
    assert np.ptp(run["phi"]) < 1e-12
    assert_allclose(run["phi_reaction"], -9.81 * 0.5 * np.sin(0.004) / 0.02, rtol=1e-8)
    up, down = run["phi_grip_up"], run["phi_grip_down"]
    assert_allclose(up - run["phi_N"] * 0.3, -run["phi_reaction"], rtol=1e-9)
    assert_allclose(down - run["phi_N"] * 0.3, run["phi_reaction"], rtol=1e-9)


def test_two_contacts_have_their_own_modes() -> None:
    """The first block slides, the second stands: an oscillator with friction, in closed form."""
    model = blocks(ExactCoulomb(mu_s=0.3, mu_d=0.2))
    run = simulate(mode_model(model, {"one": 1, "two": 0}), 0.3, u={"force": 9.0}, rtol=1e-10)
    assert_allclose(run["x1"], (9.0 - 4.0) / 50.0 * (1 - np.cos(5.0 * run.t)), atol=1e-9)
    assert_allclose(run["x2"], 0.0, atol=1e-15)
    assert_allclose(run["two_reaction"], 50.0 * run["x1"], atol=1e-8)
    both = simulate(mode_model(model, {"one": 0, "two": 0}), 0.3, u={"force": 3.0})
    assert_allclose(both["one_reaction"], 3.0)


def test_curves_and_sides_of_a_law_are_kept() -> None:
    falling = drive(laws.Stribeck(v_s=0.5, mu_s=0.3, mu_d=0.1), m=1.0, N=10.0)
    run = simulate(mode_model(falling, {"guide": 1}), 0.01, u={"force": 5.0}, rtol=1e-9)
    assert run["friction"][0] == pytest.approx(3.0)
    assert run["v"][-1] == pytest.approx(0.02, rel=1e-3)
    belt = drive(laws.Capstan(beta=2.0), m=1.0, N=1.0)
    rest = simulate(mode_model(belt, {"guide": 0}), 0.1, u={"force": 0.1})
    assert rest["guide_grip_up"][-1] == pytest.approx(np.exp(0.2) - 1 - 0.1)
    assert rest["guide_grip_down"][-1] == pytest.approx(1 - np.exp(-0.2) + 0.1)


def test_names_remain_except_for_states_of_laws() -> None:
    model = PendulumBox(LuGre()).model()
    for made in (mode_model(model, {"x": 1, "phi": 0}), smooth_model(model)):
        assert [v.name for v in made.x] == [v.name for v in model.x[:4]]
        assert set(model.outputs) <= set(made.outputs)
        assert made.events == ()
        assert made.holonomic is not None
        assert made.contacts == ()
    assert mode_model(model, {"x": 1, "phi": 0}) is mode_model(model, {"x": 1, "phi": 0})
    assert smooth_model(model) is smooth_model(model)


@pytest.mark.parametrize(
    "law", [SHARP, laws.SelfTuning(), laws.Sum((laws.Coulomb(), laws.Viscous())), laws.Stribeck()]
)
def test_smooth_model_at_its_own_widths_is_the_model(law: laws.Law) -> None:
    model = PendulumBox(law).model()
    smooth = smooth_model(model)
    rng = np.random.default_rng(0)
    x = model.initial_state() + 1e-3 * rng.standard_normal(4)
    z, p = np.array([250.0, 180.0]), smooth.values("p")
    for what in ("ode", "alg"):
        own, made = model.function(what), smooth.function(what)
        assert_allclose(made(0.0, x, z, [], p).full(), own(0.0, x, z, [], []).full(), rtol=1e-12)


def test_widths_have_exponents_and_layers() -> None:
    model = PendulumBox(laws.SelfTuning(B=500.0), hinge=BrownMcPhee(v_t=1e-2)).model()
    found = {w.parameter: w for w in widths(model)}
    assert set(found) == {"x_B", "phi_v_t", "x_eps", "phi_eps"}
    assert set(found) == {v.name for v in smooth_model(model).p}
    steep, wide, load = found["x_B"], found["phi_v_t"], found["x_eps"]
    assert (steep.number, steep.exponent, steep.layer) == (500.0, -1, 2e-3)
    assert steep.at(0.1) == pytest.approx(10.0)
    assert wide.at(0.1) == pytest.approx(0.1)
    assert (load.number, load.layer, load.at(0.1)) == (1e-4, None, 1e-4)
    assert [w.parameter for w in widths(drive(laws.LeineSwitch()))] == ["guide_v_eps"]
    assert widths(drive(laws.Viscous())) == ()


@pytest.mark.parametrize("law", [LuGre(mu_s=0.3), ExactCoulomb(mu_s=0.3), laws.Coulomb(v_eps=0.0)])
def test_stand_in_has_the_sliding_force_and_static_level_of_its_law(law: laws.Law) -> None:
    model = drive(law, N=10.0)
    smooth = smooth_model(model)
    (width,) = smooth.p
    assert width.name == "guide_width"
    assert width.start == (WIDTH if np.isinf(float(law.velocity_scale)) else 1e-3)
    friction = smooth.function("friction")
    v = np.concatenate([-np.geomspace(1e-9, 1.0, 400), np.geomspace(1e-9, 1.0, 400)])
    F = np.array([float(friction(0.0, [0.0, x], [], [0.0], [1e-6])) for x in v])
    assert F.max() == pytest.approx(float(law.static_level(10.0)), rel=1e-3)
    assert_allclose(F[:400], -F[400:], rtol=1e-12)
    fast = v > 1e-2
    wanted = [float(law.sliding(x, 10.0, 1)) for x in v[fast]]
    assert_allclose(F[fast], wanted, rtol=1e-6)


def moving_ground() -> Model:
    """A contact that slips against an input."""
    v, u = Variable("v", "m/s"), Variable("ground", "m/s")
    c = Contact("floor", v.symbol - u.symbol, 1.0, laws.Coulomb())
    return Model("moving", x=(v,), u=(u,), ode=-c.force, contacts=(c,))


def driven_twice() -> Model:
    """Two contacts in one motion, written by hand: no loop is declared."""
    x, v, u = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    arm, slide = (Contact(name, v.symbol, 10.0, SHARP) for name in ("arm", "slide"))
    return Model("twice", x=(x, v), u=(u,), contacts=(arm, slide),
                 ode=ca.vertcat(v.symbol, u.symbol - arm.force - slide.force))  # fmt: skip


def test_loop_at_rest_shares_its_load_in_proportion_to_the_levels() -> None:
    """The virtual work of the reactions is that of the weights, and shares of the levels agree."""
    bar = FourBar(BrownMcPhee(mu_s=9.0, mu_d=8.0), R=0.1, omega=0.0).model()
    names = [c.name for c in bar.contacts]
    run = simulate(mode_model(bar, dict.fromkeys(names, 0)), 0.2, rtol=1e-9)
    assert np.ptp(run["theta_crank"]) < 1e-9
    shares = [abs(run[f"{n}_reaction"][-1]) / (9.0 * run[f"{n}_N"][-1]) for n in names]
    assert_allclose(shares, shares[0], rtol=1e-6)
    assert 0.0 < shares[0] < 1.0
    start = {v.name: float(v.start) for v in bar.x[:3]}
    moved = FourBar(BrownMcPhee(), angle=1.0 + 1e-5, omega=0.0).model()
    near = {v.name: float(v.start) for v in moved.x[:3]}
    turns = np.array([near[n] - start[n] for n in names])
    lifted = moved.function("potential")(0.0, moved.initial_state(), [1.0] * len(moved.z), [], [])
    here = bar.function("potential")(0.0, bar.initial_state(), [1.0] * len(bar.z), [], [])
    reactions = np.array([run[f"{n}_reaction"][-1] for n in names])
    assert float(lifted - here) == pytest.approx(-0.1 * turns @ reactions, rel=1e-3)


def test_impossible_modes_are_refused() -> None:
    model = PendulumBox(SHARP).model()
    cases: list[tuple[Any, str]] = [
        (lambda: mode_model(moving_ground(), {"floor": 0}), "floor.: slip: expected one of states"),
        (
            lambda: smooth_model(drive(laws.RateAndState())),
            "contact 'guide': RateAndState: expected",
        ),
    ]
    for call, message in cases:
        with pytest.raises(ValueError, match=message):
            call()
    bar = FourBar(SHARP).model()
    some = {c.name: int(c.name == "theta_crank") for c in bar.contacts}
    with pytest.raises(ValueError, match=r"all or none of theta_crank, .* at rest, .* got theta_"):
        mode_model(bar, some)
    assert "theta_crank, theta_coupler, theta_rocker, which stick together" in restless(bar)
    assert restless(model) == ""
    with pytest.raises(ValueError, match=r"got arm, slide at rest together; in a loop of few"):
        mode_model(driven_twice(), {"arm": 0, "slide": 0})
    assert mode_model(drive(laws.Viscous()), {}).z == ()
    loose, pressed = (drive(BrownMcPhee(), N=N) for N in (0.0, 1.0))
    assert [len(sticking(model)) for model in (loose, pressed)] == [0, 1]


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


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 6))]
)
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
    assert kinds(motion, "guide") == ["slip-", "stick"]
    assert motion.modes["guide"][0].end == pytest.approx(1.5, abs=1e-9)
    assert motion.final() == {"x": pytest.approx(-1.125, rel=1e-9), "v": 0.0}
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


def test_smooth_laws_converge_at_first_order() -> None:
    """A tenth of v_t, a tenth of the distance; with a static level where nothing is on edge."""
    model = drive(BrownMcPhee(mu_s=0.25, mu_d=0.2), N=5.0, m=1.0, free=["v_t"])
    given: Any = {"u": {"force": Hold([0.0, 0.6, 1.0], [3.0, -3.0, 0.5])}}
    smooth = (
        simulate(model, 1.6, p={"v_t": v_t}, rtol=1e-10, atol=1e-12, **given)["x"][-1]
        for v_t in (1e-4, 1e-5, 1e-6)
    )
    far = np.abs(np.array([*smooth]) - set_valued(model, 1.6, **given)["x"][-1])
    assert_allclose(far[:-1] / far[1:], 10.0, rtol=0.15)


@pytest.mark.parametrize(
    "law", [laws.GMS(mu_s=0.3, mu_d=0.2, sigma_2=0.3), LuGre(mu_s=0.3, mu_d=0.2)]
)
def test_dynamic_laws_are_replaced_by_their_sliding_force_and_level(law: Any) -> None:
    """A force far beyond: the same as the dynamic law itself, but for its pre-sliding."""
    model = drive(law, N=10.0, m=1.0)
    motion, run = (f(model, 1.0, u={"force": 8.0}) for f in (set_valued, simulate))
    assert "guide_z" not in motion.trajectory.units
    assert motion["v"][-1] == pytest.approx(run["v"][-1], rel=1e-3)


def test_runs_continue_from_the_end_of_others() -> None:
    model, u = blocks(LAW), {"force": random_hold(5, 15.0)}
    whole, first = (set_valued(model, end, u=u) for end in (0.7, 0.4))
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
    with pytest.raises(SolveError, match=r"'jam' at t = 0 s: contact guide lifts off") as one:
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


def test_events_of_a_model_may_start_sliding() -> None:
    """A hammer of equal momentum hits a block that rests again after half a second."""
    x, v, t = Variable("x", "m"), Variable("v", "m/s"), ca.SX.sym("t")
    hits = [Event(f"hit{k}", t - k, 1, reset={"v": v.symbol + 1.0}) for k in (1, 2)]
    c = Contact("guide", v.symbol, 10.0, SHARP)
    model = Model("hit", t=t, x=(x, v), ode=ca.vertcat(v.symbol, -c.force), contacts=(c,),
                  events=tuple(hits))  # fmt: skip
    motion = set_valued(model, 3.0)
    assert motion.final() == {"x": pytest.approx(0.5, abs=1e-9), "v": 0.0}
    assert kinds(motion, "guide") == ["stick", *2 * ["slip+", "stick"]]
