"""Screws, worms, gears, racks and cams with friction from their own reaction, in closed form."""

from dataclasses import replace
from functools import partial
from itertools import product
from math import atan, cos, inf, pi, tan
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from tables import table
from trains import random_train

from ocp import Phase, Problem, effort, solve
from symfric import (
    BrownMcPhee,
    Coulomb,
    ExactCoulomb,
    Hold,
    LuGreNormalised,
    Sum,
    Trajectory,
    Viscous,
    Wojewoda,
    simulate,
)
from symfric import multibody as mb
from symfric.codegen import generate, inverse_dynamics_block, verify
from symfric.fmu import export_fmu, running
from symfric.foundation.parameters import Variable
from symfric.laws import Law
from symfric.multibody.element_friction import CamFriction

SHARP = partial(Coulomb, v_eps=1e-9)
DRY = ExactCoulomb(mu_s=0.15, mu_d=0.15)
G = 9.81


def over(run: Trajectory, power: str) -> float:
    """Energy over the whole run [J]."""
    return float(run.integral(power)[-1])


def jack(law: Law, lead: Any, radius: Any = 0.01, flank: Any = 0.0, mass: Any = 100.0) -> Any:
    """A nut of 100 kg on a vertical thread, with a motor that turns it."""
    m = mb.Mechanism("jack")
    m.body("nut", mass, (0.05, 0.05, 0.05))
    m.joint(mb.Cylindrical("thread", "ground", "nut"))
    friction = mb.ThreadFriction(law, radius, flank, eps=1e-9)
    m.constraint(mb.Screw("screw", "thread", lead, friction=friction))
    m.force(mb.JointSpringDamper("motor", "thread", actuator=m.input("torque", "N m")))
    return m


def test_screws_need_the_moments_of_the_textbook() -> None:
    """F r tan(lambda + phi) and F r tan(phi - lambda) over six decades of loads and sizes."""
    p = variables(lead="m", radius="m", flank="rad", mass="kg", mu="1", speed="rad/s")
    lead, radius, flank, mass, mu, speed = (v.symbol for v in p)
    m = jack(SHARP(mu_d=mu), lead, radius, flank, mass)
    m.joints = [replace(m.joints[0], rate=(lead / (2 * pi) * speed, speed))]
    m.constraint(mb.PrescribedMotion("drive", "thread", lambda t: speed * t))
    model, draw = m.build(p=p), np.random.default_rng(1)
    for _ in range(4):
        r, slope, angle = 10 ** draw.uniform(-3, 0), draw.uniform(0.01, 1.0), draw.uniform(0, 0.7)
        load, level, side = 10 ** draw.uniform(-1, 5), 10 ** draw.uniform(-3, -0.2), 1.0
        values = {"lead": 2 * pi * r * tan(slope), "radius": r, "flank": angle, "mass": load / G}
        phi = atan(level / cos(angle))
        for side in (1.0, -1.0):
            run = simulate(model, 0.1, p=values | {"mu": level, "speed": side * 3.0})
            wanted = load * r * tan(slope + side * phi)
            assert run["drive_moment"] == pytest.approx(wanted, rel=1e-9), values
            assert run["screw_load_b"] == pytest.approx(load, rel=1e-12)
            assert run["screw_locking"] == pytest.approx(tan(phi) / tan(slope), rel=1e-9)
            loss = abs(wanted * side * 3.0 - load * side * 3.0 * r * tan(slope))
            assert run["screw_power"] == pytest.approx(loss, rel=1e-9)
            ratio = tan(slope) / tan(slope + side * phi)
            gain = ratio if side > 0 else 1 / ratio if phi < slope else 0.0
            assert mb.efficiency(run, "screw") == pytest.approx(gain, rel=1e-9, abs=1e-12)


def test_a_parameter_out_of_range_is_refused_at_the_start() -> None:
    radius = Variable("r", "m", start=0.01)
    model = jack(DRY, 0.004, radius).build(p=(radius,))
    with pytest.raises(ValueError, match="expected consistent start values, found no solution"):
        simulate(model, 1.0, u={"torque": 0.0}, p={"r": 0.0})


def test_threads_lock_from_the_friction_angle() -> None:
    """A lead angle just below the friction angle holds the load for ever, just above it slides."""
    for factor, holds in ((1 - 1e-6, True), (1 + 1e-6, False)):
        model = jack(DRY, 2 * pi * 0.01 * 0.15 * factor).build()
        run = simulate(model, 20.0, u={"torque": 0.0})
        assert (run["screw_locking"][-1] >= 1) == holds
        assert (abs(run.final["thread_slide"]) < 1e-15) == holds


@pytest.mark.parametrize(
    "options", [{}, {"index": 0}, pytest.param({"formulation": "absolute"}, marks=pytest.mark.slow)]
)
def test_a_lowered_load_accelerates_as_in_closed_form(options: dict[str, Any]) -> None:
    """J a / h = m (g - a) r tan(lambda - phi), in all formulations."""
    lead, r = 0.02, 0.01
    h, k = lead / (2 * pi), r * tan(atan(lead / (2 * pi * r)) - atan(0.15 / cos(0.2)))
    a = 100 * G * k / (0.05 / h + 100 * k)
    model = jack(DRY, lead, r, 0.2).build(**options)
    run = simulate(model, 2.0, u={"torque": 0.0}, rtol=1e-10)
    z = run["nut_z" if options.get("formulation") else "thread_slide"]
    assert z == pytest.approx(-a * run.t**2 / 2, rel=1e-9, abs=1e-12)
    balance = run.energy_balance()
    assert np.abs(balance.defect).max() < 1e-9 * balance.scale


def pair(coupling: Any, speed: Any, load: Any, slides: bool = False) -> mb.Mechanism:
    """A shaft driven at constant speed, and a shaft or rack with a load."""
    m = mb.Mechanism("pair", gravity=(0.0, 0.0, 0.0))
    for name in ("first", "second"):
        m.body(name, 1.0, (0.1, 0.1, 0.1))
    m.joint(mb.Revolute("a", "ground", "first", rate=speed))
    joint = mb.Prismatic if slides else mb.Revolute
    ratio = getattr(coupling, coupling.ratio_field)
    m.joint(joint("b", "ground", "second", rate=ratio * speed))
    m.constraint(coupling)
    m.constraint(mb.PrescribedMotion("drive", "a", lambda t: speed * t))
    m.force(mb.JointSpringDamper("load", "b", actuator=load))
    return m


def variables(**units: str) -> list[Variable]:
    return [Variable(name, unit, start=0.1) for name, unit in units.items()]


def test_worms_drive_and_are_driven_as_screws() -> None:
    """Moment of the worm M r / r_g tan(lambda +- phi), for left-hand and right-hand worms."""
    r, wheel, slope, mu, angle = 0.02, 0.11, 0.3, 0.08, 0.35
    phi, lead = atan(mu / cos(angle)), 2 * pi * 0.02 * tan(0.3)
    friction = mb.ThreadFriction(SHARP(mu_d=mu), r, angle, lead)
    p = variables(ratio="1", speed="rad/s", load="N m")
    gear = mb.Gear("worm", "a", "b", p[0].symbol, friction=friction)
    model = pair(gear, p[1].symbol, p[2].symbol).build(p=p)
    for side, speed, load in product((1.0, -1.0), (5.0, -5.0), (40.0, -40.0)):
        values = {"ratio": side * r * tan(slope) / wheel, "speed": speed, "load": load}
        run = simulate(model, 0.1, p=values)
        axial = -side * load / wheel
        sign = np.sign(axial * speed)
        wanted = axial * r * tan(slope + sign * phi)
        assert run["drive_moment"] == pytest.approx(wanted, rel=1e-9)
        ratio = tan(slope) / tan(slope + phi)
        gain = ratio if sign > 0 else tan(slope - phi) / tan(slope)
        assert mb.efficiency(run, "worm") == pytest.approx(gain, rel=1e-9)


@pytest.mark.parametrize("kind", ["external", "internal", "rack"])
def test_meshes_have_the_efficiency_that_gave_their_arm(kind: str) -> None:
    slides, mu = kind == "rack", 0.07
    p = variables(ratio="m" if slides else "1", load="N" if slides else "N m", arm="m", r_b="m")
    ratio, load, arm, radius = (v.symbol for v in p)
    friction = mb.MeshFriction(
        SHARP(mu_d=mu), arm, None if slides else radius, 0.4, 0.2, internal=kind == "internal"
    )
    element = (mb.Rolling if slides else mb.Gear)("mesh", "a", "b", ratio, friction=friction)
    model, draw = pair(element, 7.0, load, slides).build(p=p), np.random.default_rng(2)
    for eta in (0.5, 0.9, 0.99, 0.9999):
        r_a, r_b = 10 ** draw.uniform(-2, -1), 10 ** draw.uniform(-0.9, 0)
        far = {"external": r_b, "internal": -r_b, "rack": inf}[kind]
        k = r_a if slides else -r_a / far
        length = mb.mesh_arm(eta, mu, r_a, far, pressure_angle=0.4, helix_angle=0.2)
        values = {"ratio": k, "load": -np.sign(k) * 50.0, "arm": length, "r_b": r_b}
        run = simulate(model, 0.1, p=values)
        assert mb.efficiency(run, "mesh") == pytest.approx(eta, rel=1e-9)
        lever = mu * length / (cos(0.4) * cos(0.2))
        assert run["mesh_locking"] == pytest.approx(lever / r_a, rel=1e-9)


def hump(angle: ca.SX) -> ca.SX:
    """Lift of 2 cm."""
    return 0.01 * (1 - ca.cos(angle))


def test_cams_need_their_moments() -> None:
    """Flat, pointed and roller followers with s = e (1 - cos x) at constant speed."""
    e, base, mu, mass, rolls = 0.01, 0.03, 0.2, 2.0, (0.008, 0.003)
    (w,) = variables(w="rad/s")
    for kind in ("flat", "pointed", "roller"):
        own = rolls if kind == "roller" else (None, None)
        m = mb.Mechanism("valve")
        m.body("cam", 1.0, (0.01, 0.01, 0.01))
        m.body("tappet", mass, (0.01, 0.01, 0.01))
        m.joint(mb.Revolute("shaft", "ground", "cam", rate=w.symbol))
        m.joint(mb.Prismatic("guide", "ground", "tappet"))
        friction = CamFriction(SHARP(mu_d=mu), base, kind, *own)
        m.constraint(mb.Cam("lobe", "shaft", "guide", hump, friction))
        m.constraint(mb.PrescribedMotion("drive", "shaft", lambda t: w.symbol * t))
        model = m.build(p=(w,))
        for speed in (5.0, -5.0):
            run = simulate(model, 2.0, p={"w": speed}, samples=41)
            x, sign = speed * run.t, np.sign(speed)
            load, r = mass * (G + e * speed**2 * np.cos(x)), base + e * (1 - np.cos(x))
            slope, alpha = e * np.sin(x), np.arctan(e * np.sin(x) / r)
            if kind == "flat":
                wanted = load * (slope + sign * mu * r)
            elif kind == "pointed":
                wanted = load * r * np.tan(alpha + sign * atan(mu))
            else:
                k = rolls[1] / rolls[0]
                N = load / (np.cos(alpha) - sign * mu * k * np.sin(alpha))
                pin = sign * mu * k * (r * np.cos(alpha) - rolls[0])
                wanted = N * (np.cos(alpha) * slope + pin)
            assert run["drive_moment"] == pytest.approx(wanted, rel=1e-9, abs=1e-10), kind
            balance = run.energy_balance()
            assert np.abs(balance.defect).max() < 1e-9 * balance.scale
            given = sum(over(run, f"lobe_power_{end}") for end in "ab")
            assert given == pytest.approx(-over(run, "lobe_power"), rel=1e-9)


def check_trains(seeds: range) -> None:
    """Energy in is energy out and losses; the motor's moment is that by hand, to 1e-9."""
    for seed in seeds:
        train = random_train(seed)
        run = simulate(train.mechanism.build(), 0.5, rtol=1e-10, samples=21)
        balance, stages = run.energy_balance(), range(len(train.stages))
        assert np.abs(balance.defect).max() < 1e-9 * balance.scale, seed
        accelerations = [run[f"j{k}_acc"] for k in range(len(train.stages) + 1)]
        coefficients = [run[f"e{k}_friction"] / run[f"e{k}_N"] for k in stages]
        by_hand = train.motor_by_hand(accelerations, coefficients)
        assert by_hand == pytest.approx(train.motor, rel=1e-9), seed
        for k in stages:
            given = sum(over(run, f"e{k}_power_{end}") for end in "ab")
            scale = abs(over(run, f"e{k}_power_a"))
            assert given == pytest.approx(-over(run, f"e{k}_power"), abs=1e-9 * scale), seed
            assert 0.0 <= mb.efficiency(run, f"e{k}") < 1.0


def test_random_trains_keep_their_energy() -> None:
    check_trains(range(2))


@pytest.mark.slow
def test_many_random_trains_keep_their_energy() -> None:
    check_trains(range(2, 34))


@pytest.mark.slow
@pytest.mark.parametrize(("T", "intervals"), [(1.0, 10), (3.0, 24)])
def test_the_cheapest_lift_moves_as_in_closed_form_and_then_rests(T: float, intervals: int) -> None:
    """Least effort of M = J a + m (g + h a) r tan(lambda + phi): a constant and a straight line.

    A self-locking screw needs no moment at rest, so that it stops after the best duration.
    """
    lead, r, angle = 0.004, 0.01, 4 * pi
    h, k = lead / (2 * pi), r * tan(atan(lead / (2 * pi * r)) + atan(0.15))
    inertia, weight = 0.05 + 100 * h * k, 100 * G * k
    best = (36 * (inertia * angle / weight) ** 2) ** 0.25
    model = jack(DRY, lead).build()
    rest = {"thread_angle_rate": 0.0, "thread_slide_rate": 0.0}
    start = {"thread_slide": 0.0, "thread_angle": 0.0, **rest}
    end = {"thread_angle": angle, "thread_angle_rate": 0.0}
    lift = Phase(model, T=T, start=start, end=end)
    problem = Problem(lift, effort("torque"), inputs={"torque": "linear"})
    move, moving = solve(problem, intervals=intervals), min(T, best)
    cost = weight**2 * moving + 12 * (inertia * angle) ** 2 / moving**3
    assert move.cost == pytest.approx(cost, rel=1e-8)
    assert move.verified


def torque(t: Any) -> Any:
    """Moment of the motor [N m] over time."""
    return 8 + 6 * ca.sin(9 * t)


def test_inverse_dynamics_need_the_torque_of_the_run(tmp_path: Path) -> None:
    """The moment that a run was given, for both flanks and left-hand threads, in C as well."""
    laws = BrownMcPhee(mu_s=0.18, mu_d=0.15, v_t=1e-3), LuGreNormalised()
    for law, lead in ((laws[0], -0.02), (laws[1], 0.02)):
        m = jack(law, lead, flank=0.2)
        later = np.linspace(0.2, 1.0, 50)  # the block takes bristles as constant over its step
        run = simulate(m.build(), 1.0, u={"torque": torque}, t_eval=later, rtol=1e-10)
        block = inverse_dynamics_block(m)
        assert [v.name for v in block.inputs] == ["q_1", "qd_1", "qdd_1"]
        columns = [ca.vertcat(*(v.symbol for v in group))
                   for group in (block.inputs, block.states, block.parameters)]  # fmt: skip
        tau = ca.Function("tau", columns, [block.outputs["tau_1"].expression])
        motion = np.array([run[f"thread_angle{x}"] for x in ("", "_rate", "_acc")])
        z = run["screw_z"][None] if block.states else np.zeros((0, run.t.size))
        p = ca.DM([v.start for v in block.parameters])
        found = np.array([float(ca.DM(tau(q, x, p))) for q, x in zip(motion.T, z.T, strict=True)])
        assert found == pytest.approx([float(torque(t)) for t in later], abs=1e-11)
    checked = verify(generate(block, tmp_path))
    assert checked.ok, checked


@pytest.mark.slow
def test_a_jack_in_an_fmu_moves_as_in_python(tmp_path: Path) -> None:
    model = jack(DRY, 0.02).build()
    export_fmu(model, tmp_path / "jack.fmu", rtol=1e-9, t_end=1.0)
    found = list[float]()
    with running(tmp_path / "jack.fmu") as unit:
        for moment in (20.0, 0.0, -5.0):
            unit.set({"torque": moment})
            unit.step(0.3)
            found.append(float(unit.get(["thread_slide"])[0]))
    t = np.array([0.3, 0.6, 0.9])
    held = Hold(np.array([0.0, 0.3, 0.6]), np.array([20.0, 0.0, -5.0]))
    run = simulate(model, 0.9, u={"torque": held}, t_eval=t, rtol=1e-9)
    assert found == pytest.approx(run["thread_slide"], rel=1e-7)


def test_friction_that_cannot_act_is_refused_with_its_carrier() -> None:
    """A bearing without a reaction in any motion; each of the remedies is accepted."""
    law = BrownMcPhee()
    axes = ((0, 0, 1), (0, 0, -G)), ((0, 0.6, 0.8), (0, -6, -8)), ((0.3, 0.7, 0.1), (0, 0, 0))

    def nut(friction: mb.JointFriction, z: Any, g: Any, screw: bool = True) -> mb.Mechanism:
        m = mb.Mechanism("nut", gravity=g)
        m.body("nut", 100.0, (0.05, 0.05, 0.05))
        m.frame("ground.a", z=z)
        m.frame("nut.a", z=z)
        m.joint(mb.Cylindrical("thread", "ground.a", "nut.a", friction=friction))
        if screw:
            m.constraint(mb.Screw("screw", "thread", 0.004))
        return m

    for z, g in axes:
        for preload, level, own, acts in (
            (0.0, None, law, False), (1.0, None, law, True), (0.0, 1.0, law, True),
            (0.0, 0.0, law, True), (0.0, None, Viscous(sigma_2=1.0), True),
            (0.0, None, Sum((law, Viscous(sigma_2=1.0))), True),
        ):  # fmt: skip
            friction = mb.JointFriction(own, 0.01, preload=preload, normal=level)
            for screw, message in ((True, CARRIER), (False, "write preload=... or normal=")):
                m = nut(friction, z, g, screw)
                if acts:
                    m.prepare()
                else:
                    with pytest.raises(ValueError, match=message):
                        m.prepare()
    load = Variable("load", "N", start=5.0)
    nut(mb.JointFriction(law, 0.01, preload=load), *axes[0]).prepare((load,))
    # a weight across the axis loads the bearing
    nut(mb.JointFriction(law, 0.01), (1, 0, 0), (0, 0, -G)).prepare()


CARRIER = r"coupling 'screw' carries the load; write Screw\('screw', ..., friction=ThreadFriction"


def test_mistakes_are_answered_by_one_sentence_each() -> None:
    """Changes of the elements in couplings.toml -> part of the message."""
    cases = table(__file__, "couplings")
    for change, message in cases.items():
        with pytest.raises(ValueError) as caught:
            eval(change, globals() | SHORT)
        text = str(caught.value)
        assert message in text, (change, text)
        assert "\n" not in text and "Traceback" not in text, text
    assert len(cases) >= 50


def built(element: Any, *more: Any) -> Any:
    """Prepare a crank, a wheel and a slide with an element."""
    m = mb.Mechanism("m")
    for name, joint in (("crank", mb.Revolute), ("wheel", mb.Revolute), ("slide", mb.Prismatic)):
        m.body(f"{name}_body", 1.0, (0.1, 0.1, 0.1))
        m.joint(joint(name, "ground", f"{name}_body"))
    m.body("nut", 1.0, (0.1, 0.1, 0.1))
    m.joint(mb.Cylindrical("thread", "ground", "nut"))
    for each in (element, *more):
        m.constraint(each)
    return m.prepare()


def screw(*given: Any, **options: Any) -> Any:
    return built(mb.Screw("e", "thread", 0.01, friction=mb.ThreadFriction(*given, **options)))


def gear(friction: Any, ratio: Any = -0.5) -> Any:
    return built(mb.Gear("e", "crank", "wheel", ratio, friction=friction))


def rack(friction: Any) -> Any:
    return built(mb.Rolling("e", "crank", "slide", 0.1, friction=friction))


def cam(friction: Any = None, lift: Any = hump, b: str = "slide") -> Any:
    return built(mb.Cam("e", "crank", b, lift, friction))


LAW = Coulomb(mu_d=0.1)
SHORT: dict[str, Any] = {
    "T": mb.ThreadFriction, "M": mb.MeshFriction, "C": CamFriction, "LAW": LAW, "mb": mb,
    "Wojewoda": Wojewoda,
    "run": simulate(jack(DRY, 0.01).build(), 0.01, u={"torque": 0.0}),
}  # fmt: skip
