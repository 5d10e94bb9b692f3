"""Smooth models and models in one mode of each contact, against motions computed otherwise."""

from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose
from rigs import blocks

from ocp.friction.mode_models import mode_model, restless
from ocp.friction.smooth_models import WIDTH, smooth_model, sticking, widths
from symfric import (
    BrownMcPhee,
    Contact,
    ExactCoulomb,
    Law,
    LuGre,
    Model,
    RateAndState,
    SelfTuning,
    Stribeck,
    Sum,
    Variable,
    Viscous,
    drive,
    simulate,
)
from symfric.laws import Capstan, Coulomb, LeineSwitch
from symfric.scenes import FourBar, Pendulum, PendulumBox, Rabinowicz, SliderCrank

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
    box = PendulumBox(SHARP).model()
    start = {"x_rate": 2.0, "phi_rate": -4.0}
    crank = SliderCrank(SHARP).model()
    for model, modes, x0, end in (
        (box, {"x": 1, "phi": -1}, start, 0.08),
        (crank, {"crank": 1}, {}, 0.2),
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


def test_belt_carries_a_block_at_rest_on_it() -> None:
    model = Rabinowicz(ExactCoulomb()).model()
    run = simulate(mode_model(model, {"belt": 0}), 2.0, x0={"v": 0.1}, rtol=1e-9)
    assert [v.name for v in mode_model(model, {"belt": 0}).x] == ["x", "v"]
    assert_allclose(run["x"], 0.1 * run.t, atol=1e-12)
    assert_allclose(run["belt_reaction"], -2.1 * run["x"], atol=1e-9)


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
    falling = drive(Stribeck(v_s=0.5, mu_s=0.3, mu_d=0.1), m=1.0, N=10.0)
    run = simulate(mode_model(falling, {"guide": 1}), 0.01, u={"force": 5.0}, rtol=1e-9)
    assert run["friction"][0] == pytest.approx(3.0)
    assert run["v"][-1] == pytest.approx(0.02, rel=1e-3)
    belt = drive(Capstan(beta=2.0), m=1.0, N=1.0)
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


def test_the_same_modes_give_the_same_object() -> None:
    model = drive(LuGre())
    assert mode_model(model, {"guide": 1}) is mode_model(model, {"guide": 1})
    assert mode_model(model, {"guide": 1}) is not mode_model(model, {"guide": 0})
    assert smooth_model(model) is smooth_model(model)


@pytest.mark.parametrize("law", [SHARP, SelfTuning(), Sum((Coulomb(), Viscous())), Stribeck()])
def test_smooth_model_at_its_own_widths_is_the_model(law: Law) -> None:
    model = PendulumBox(law).model()
    smooth = smooth_model(model)
    rng = np.random.default_rng(0)
    x = model.initial_state() + 1e-3 * rng.standard_normal(4)
    z, p = np.array([250.0, 180.0]), smooth.values("p")
    for what in ("ode", "alg"):
        own, made = model.function(what), smooth.function(what)
        assert_allclose(made(0.0, x, z, [], p).full(), own(0.0, x, z, [], []).full(), rtol=1e-12)


def test_widths_have_exponents_and_layers() -> None:
    model = PendulumBox(SelfTuning(B=500.0), hinge=BrownMcPhee(v_t=1e-2)).model()
    found = {w.parameter: w for w in widths(model)}
    assert set(found) == {"x_B", "phi_v_t", "x_eps", "phi_eps"}
    assert set(found) == {v.name for v in smooth_model(model).p}
    steep, wide, load = found["x_B"], found["phi_v_t"], found["x_eps"]
    assert (steep.number, steep.exponent, steep.layer) == (500.0, -1, 2e-3)
    assert steep.at(0.1) == pytest.approx(10.0)
    assert wide.at(0.1) == pytest.approx(0.1)
    assert (load.number, load.layer) == (1e-4, None)
    with pytest.raises(ValueError, match="x_eps: expected a width of velocities"):
        load.at(0.1)
    assert [w.parameter for w in widths(drive(LeineSwitch()))] == ["guide_v_eps"]
    assert widths(drive(Viscous())) == ()


@pytest.mark.parametrize("law", [LuGre(mu_s=0.3), ExactCoulomb(mu_s=0.3), Coulomb(v_eps=0.0)])
def test_stand_in_has_the_sliding_force_and_static_level_of_its_law(law: Law) -> None:
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


def test_smooth_runs_converge_to_slip_and_stick_at_first_order() -> None:
    """First order: a tenth of the width, a tenth of the distance."""
    model = blocks(BrownMcPhee(mu_s=0.2, mu_d=0.2))
    limit = simulate(mode_model(model, {"one": 1, "two": 0}), 0.1, u={"force": 9.0}, rtol=1e-11)
    far: list[float] = []
    for layer in (1e-3, 1e-4, 1e-5):
        p = {w.parameter: w.at(layer) for w in widths(model)}
        run = simulate(smooth_model(model), 0.1, u={"force": 9.0}, p=p, rtol=1e-11)
        far.append(abs(run["x1"][-1] - limit["x1"][-1]) + abs(run["v1"][-1] - limit["v1"][-1]))
    assert_allclose(np.divide(far[:-1], far[1:]), 10.0, rtol=0.2)


def moving_ground() -> Model:
    """A contact that slips against an input."""
    v, u = Variable("v", "m/s"), Variable("ground", "m/s")
    c = Contact("floor", v.symbol - u.symbol, 1.0, Coulomb())
    return Model("moving", x=(v,), u=(u,), ode=-c.force, contacts=(c,))


def driven_twice() -> Model:
    """Two contacts in one motion, written by hand: nobody knows of a loop."""
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
        (lambda: mode_model(model, {"x": 1}), "expected 1, 0 or -1 for each contact, got none for"),
        (lambda: mode_model(model, {"x": 1, "phi": 2}), "modes: phi: expected .* got 2"),
        (lambda: mode_model(model, {"x": 1, "hinge": 0}), "modes: expected .* got hinge"),
        (lambda: mode_model(moving_ground(), {"floor": 0}), "floor.: slip: expected one of states"),
        (lambda: smooth_model(drive(RateAndState())), "contact 'guide': RateAndState: expected"),
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
    assert mode_model(drive(Viscous()), {}).z == ()


def test_unloaded_contacts_do_not_stick() -> None:
    """Its law would: it is left out of what is sharpened, and the rest is solved as it is."""
    loose, pressed = (drive(BrownMcPhee(), N=N) for N in (0.0, 1.0))
    assert [len(sticking(model)) for model in (loose, pressed)] == [0, 1]
