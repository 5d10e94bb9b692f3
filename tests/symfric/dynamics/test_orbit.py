"""Periodic orbits against closed forms, other formulations and long runs."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from hunting import hunting

from symfric import (
    ExactCoulomb,
    LuGre,
    Model,
    Output,
    Variable,
    contact,
    drive,
    rabinowicz,
    simulate,
)
from symfric.bench.dynamics import grazing, hopf_speed, linear, stick_slip
from symfric.dynamics import continuation, equilibrium, linearize, periodic_orbit
from symfric.laws import BrownMcPhee, Law, Stribeck, Viscous
from symfric.multibody import JointSpringDamper
from symfric.scenes import CoupledBlocks, DrillString, SliderCrank


def test_the_closed_forms_of_the_benchmark_are_met() -> None:
    """Periods and multipliers of stick-slip, Hopf speeds, grazing, a describing function, a car."""
    found = [*stick_slip(4), *hopf_speed(1), *grazing(), *linear()]
    assert {row["quantity"]: row["measured"] for _, row in found if row["met"] != "yes"} == {}
    assert len(found) == 6


def test_an_orbit_with_stick_has_its_events_and_its_amplitude() -> None:
    belt = rabinowicz(ExactCoulomb(mu_s=0.15, mu_d=0.1), m=0.8, k=2.1, v_belt=0.1)
    orbit = periodic_orbit(belt, simulate(belt, 30.0), rtol=1e-10)
    assert orbit.stable and orbit.events == ("stick", "slip") and orbit.multipliers.size == 1
    rise = 0.05 * 0.8 * 9.81 / 2.1
    assert orbit.amplitude("x") == pytest.approx(np.hypot(0.1 / np.sqrt(2.1 / 0.8), rise), rel=1e-7)


def test_an_oscillator_that_is_linear_in_energy_has_its_multiplier() -> None:
    # polar form r' = r (1 - r^2), angle' = 2 has the orbit r = 1 and the multiplier exp(-2 pi)
    x, y = Variable("x", "m", start=1.2), Variable("y", "m")
    radial = 1 - x**2 - y**2
    model = Model("ring", x=(x, y), ode=ca.vertcat(x * radial - 2 * y, y * radial + 2 * x))
    run = simulate(model, 12.0, rtol=1e-8)
    for symmetric in (False, True):
        for segments in (1, 3):
            orbit = periodic_orbit(model, run, symmetric=symmetric, segments=segments, rtol=1e-11)
            assert orbit.period == pytest.approx(np.pi, rel=1e-10)
            assert orbit.multipliers[0] == pytest.approx(np.exp(-2 * np.pi), rel=1e-7)


def test_an_unstable_orbit_is_found_from_an_orbit_next_to_it() -> None:
    # r' = -r (1 - r^2) / 5, multiplier exp(2 pi / 5)
    x, y = Variable("x", "m", start=1.0), Variable("y", "m")
    radial = (x**2 + y**2 - 1) / 5
    model = Model("ring", x=(x, y), ode=ca.vertcat(x * radial - 2 * y, y * radial + 2 * x))
    run = simulate(model, 16.0, x0={"x": 0.9999}, rtol=1e-10)
    orbit = periodic_orbit(model, run, segments=4, rtol=1e-11)
    assert orbit.stable is False
    assert orbit.multipliers[0] == pytest.approx(np.exp(0.4 * np.pi), rel=1e-8)
    assert orbit.x["x"] ** 2 + orbit.x["y"] ** 2 == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("law", "kd", "ki"),
    [
        (ExactCoulomb(mu_s=0.3), 3.0, 25.0),
        pytest.param(Stribeck(mu_s=0.3, mu_d=0.1, v_s=0.1), 0.5, 80.0, marks=pytest.mark.slow),
    ],
)
def test_a_hunting_drive_has_a_symmetric_orbit(law: Law, kd: float, ki: float) -> None:
    drive_loop = hunting(law, kd, ki)
    run = simulate(drive_loop, 200.0, rtol=1e-8)
    whole = periodic_orbit(drive_loop, run)
    half = periodic_orbit(drive_loop, run, symmetric=True)
    assert half.period == pytest.approx(whole.period, rel=1e-7)
    assert half.multipliers[0] == pytest.approx(whole.multipliers[0], rel=1e-4, abs=1e-6)
    long = simulate(drive_loop, 250.0, rtol=1e-10).period()
    assert long.period == pytest.approx(whole.period, rel=max(1e-7, long.error))
    assert long.amplitude("x") == pytest.approx(half.amplitude("x"), rel=max(1e-6, long.error))
    assert whole.stable and half.symmetric and "symmetric" in repr(half)


def test_two_blocks_repeat_as_their_long_run_does() -> None:
    law = Stribeck(mu_s=0.2, mu_d=0.1, v_s=0.1)
    blocks = CoupledBlocks(law, v_belt=0.3, start_2=0.1).model()
    orbit = periodic_orbit(blocks, simulate(blocks, 100.0))
    cycle = simulate(blocks, 200.0, rtol=1e-10).period()
    assert cycle.period == pytest.approx(orbit.period, rel=1e-7)
    assert cycle.amplitude("x_1") == pytest.approx(orbit.amplitude("x_1"), rel=1e-6)


def torque(t: ca.SX) -> ca.SX:
    return 3 * ca.sin(2 * ca.pi * t)


def crank(law: object, index: int) -> Model:
    """Slider-crank with a spring on its crank, moved by a torque."""
    mechanism = SliderCrank(law, omega=0.0, R=0.02).mechanism()
    moment = mechanism.input("torque", "N m")
    mechanism.force(JointSpringDamper("spring", "crank", stiffness=4.0, actuator=moment))
    return mechanism.build(index=index)


@pytest.mark.slow
def test_a_driven_mechanism_has_one_orbit_in_all_formulations() -> None:
    for law in (Viscous(), LuGre(), ExactCoulomb()):
        found = []
        for index in (0, 1):
            model = crank(law, index)
            run = simulate(model, 20.0, u={"torque": torque})
            found.append(periodic_orbit(model, run, u={"torque": torque}, period=1.0))
        one, other = found
        assert one.amplitude("crank") == pytest.approx(other.amplitude("crank"), rel=1e-8)
        assert np.abs(one.multipliers - other.multipliers).max() < 1e-5
        assert one.driven and one.multipliers.size == (3 if law.states and len(one.x) == 5 else 2)


def test_a_driven_linear_oscillator_has_the_multipliers_of_its_matrix() -> None:
    spring, law = drive(Viscous(), m=1.0), Viscous()
    x, v, force = Variable("x", "m"), Variable("v", "m/s"), Variable("force", "N")
    slip = contact("guide", law, v.symbol, 1.0)
    rates = ca.vertcat(v.symbol, force - 30 * x - slip.force)
    model = Model("spring", x=(x, v), u=(force,), ode=rates, contacts=(slip,))
    given = {"force": torque}
    run = simulate(model, 5.0, u=given)
    orbit = periodic_orbit(model, run, u=given, period=1.0, rtol=1e-11)
    linear = linearize(model, equilibrium(model), outputs=["x"])
    expected = np.exp(linear.eigenvalues)
    assert all(np.abs(orbit.multipliers - s).min() < 1e-8 for s in expected)
    size = 3 * abs(linear.response([2 * np.pi])[0, 0, 0])
    assert orbit.amplitude("x") == pytest.approx(size, rel=1e-6)
    assert spring.name == "drive"


def test_an_unstable_equilibrium_is_a_guess_and_pictures_show_sticking() -> None:
    law = ExactCoulomb(mu_s=0.3, mu_d=0.2, v_s=0.2, form="stribeck")
    belt = rabinowicz(law, v_belt=0.15)
    at = equilibrium(belt)
    assert linearize(belt, at).stable is False
    orbit = periodic_orbit(belt, at)
    assert orbit.stable
    again = periodic_orbit(belt, orbit, rtol=1e-11)
    assert again.period == pytest.approx(orbit.period, rel=1e-8)
    (axis,) = orbit.plot("x", "v").axes
    assert axis.get_xlabel() == "x [m]" and len(axis.lines) == 2


def test_what_is_no_orbit_is_refused() -> None:
    belt = rabinowicz(ExactCoulomb(sigma_2=5.0), v_belt=0.3)
    sliding = simulate(belt, 100.0)
    stable = equilibrium(belt)
    pushed = drive(LuGre())
    run = simulate(pushed, 3.0, u={"force": torque})
    x, v = Variable("x", "m", start=1.0), Variable("v", "m/s")
    xdot = ca.SX.sym("xdot", 2)
    implicit = Model("implicit", x=(x, v), xdot=xdot, residual=ca.vertcat(xdot[0] - v, xdot[1] + x))
    cases: dict[str, Callable[[], object]] = {
        "expected an unstable equilibrium": lambda: periodic_orbit(belt, stable),
        "a run, a periodic orbit or an equilibrium": lambda: periodic_orbit(belt, {"x": 1.0}),
        "of the input force": lambda: periodic_orbit(pushed, run, u={"force": torque}),
        "a run of 9 s": lambda: periodic_orbit(pushed, run, u={"force": torque}, period=9.0),
        "explicit rates": lambda: periodic_orbit(implicit, simulate(implicit, 20.0)),
        "segments": lambda: periodic_orbit(belt, sliding, segments=0),
        "rtol": lambda: periodic_orbit(belt, sliding, rtol=0.1),
        "period": lambda: periodic_orbit(belt, sliding, period=-1.0),
        "got z": lambda: periodic_orbit(pushed, sliding),
        "settled to a steady motion": lambda: periodic_orbit(belt, sliding),
        "simulate longer": lambda: periodic_orbit(belt, simulate(belt, 8.0)),
        "got mu": lambda: periodic_orbit(belt, sliding, p={"mu": 1.0}),
    }
    for text, call in cases.items():
        with pytest.raises(ValueError, match=text):
            call()


def test_a_symmetric_orbit_of_a_machine_without_symmetry_is_refused() -> None:
    belt = rabinowicz(BrownMcPhee())
    with pytest.raises(ValueError, match="near the guess"):
        periodic_orbit(belt, simulate(belt, 30.0), symmetric=True)


def test_a_drill_string_sticks_and_slips_up_to_a_speed_of_the_top() -> None:
    """The mean speed of the bit is that of the top; runs next to the limit confirm it."""
    string = DrillString(ExactCoulomb(mu_s=0.8, mu_d=0.5), lumps=1).model()
    given = {"w_top": 2.0}
    orbit = periodic_orbit(string, simulate(string, 300.0, u=given), u=given)
    assert orbit.stable and orbit.drift == pytest.approx({"phi": 2.0 * orbit.period}, rel=1e-9)
    assert "phi changes by" in repr(orbit)
    branch = continuation(orbit, "w_top", (1.5, 5.0), points=60)
    (limit,) = branch.special
    assert limit.kind == "grazing"
    last = dict(zip(orbit.x, branch.x[limit.index - 1].tolist(), strict=True))
    for side in (-1, 1):
        u = {"w_top": limit.value + side * 2e-4}
        run = simulate(string, 2000.0, x0=last, u=u, rtol=1e-9)
        assert (run.final["w_bit"] == pytest.approx(u["w_top"], abs=1e-3)) is (side > 0)
        assert (len(run.happened) > 100) is (side < 0)


def test_a_rotor_turns_with_the_multiplier_of_liouville() -> None:
    """The work of its torque in a turn equals the losses."""
    phi, w, T = Variable("phi", "rad"), Variable("w", "rad/s"), Variable("T", "N m", start=2.0)
    bearing = contact("bearing", BrownMcPhee(mu_s=0.4, mu_d=0.3), w.symbol, 1.0)
    torque = T - bearing.force - w / 10 - 4 * ca.sin(phi)
    losses = (bearing.force + w / 10) * w.symbol
    results = {"growth": Output(ca.jacobian(torque, w.symbol), "1/s"), "loss": Output(losses, "W")}
    rotor = Model(
        "rotor", x=(phi, w), u=(T,), ode=ca.vertcat(w, torque), contacts=(bearing,), outputs=results
    )
    given = {"T": 2.0}
    run = simulate(rotor, 120.0, x0={"w": 12.0}, u=given)
    orbit = periodic_orbit(rotor, run, u=given)
    assert rotor.angles == ("phi",) and rotor.cyclic == ()
    assert orbit.drift == pytest.approx({"phi": 2 * np.pi}, rel=1e-8)
    assert orbit.period * orbit.cycle.mean("loss") == pytest.approx(2.0 * 2 * np.pi, rel=1e-8)
    growth = np.exp(orbit.period * orbit.cycle.mean("growth"))
    assert orbit.multipliers == pytest.approx([growth], rel=1e-7)
    branch = continuation(orbit, "T", (1.9, 2.1), points=9)
    assert branch.stable.all() and branch.orbit(0).drift["phi"] == pytest.approx(2 * np.pi)
