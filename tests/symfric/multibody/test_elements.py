"""Brakes, clutches and belts against closed forms of equilibrium and motion."""

from collections.abc import Callable
from dataclasses import replace
from math import exp, pi, sin, tanh

import casadi as ca
import numpy as np
import pytest
from chains import attach
from scipy.integrate import quad
from shafts import SHOE, K, at_start, driven, drum, dry, ramp, shafts, turning
from tables import Names, table

import symfric as sf
from ocp.friction.mode_models import restless
from symfric import Variable, simulate
from symfric import multibody as mb
from symfric.laws import Law, law_from_text
from symfric.scenes import Clutch

pytestmark = pytest.mark.heavy


Case = tuple[mb.Force, dict[str, float]]


def lever(mu: float, s: int, P: float, arms: tuple[float, float, float]) -> tuple[float, float]:
    """Normal and friction force of one shoe, from its two equations as a linear system."""
    a_force, a_normal, a_friction = arms
    rows = [[a_normal, -s * a_friction], [-mu, 1.0]]
    N, F = np.linalg.solve(rows, [P * a_force, 0.0])
    return float(N), float(F)


def disc(rng: np.random.Generator, mu: float, s: int, law: Law, worn: bool = False) -> Case:
    """Torque of the ring by quadrature of the pressure, p constant or p ~ 1/r."""
    outer, share, P, n = 10 ** rng.uniform(-2, 1), rng.uniform(0, 1), 10 ** rng.uniform(0, 6), 3
    inner, half = share * outer, rng.uniform(0.1, pi / 2)
    power = 0 if worn else 1  # of r in p r dr

    def moment(of_radius: int) -> float:
        def density(r: float) -> float:
            return r ** (power + of_radius)

        return quad(density, inner, outer)[0]

    load, torque = moment(0), moment(1)
    element = mb.DiscClutch("w", "a", law, P, outer, inner, "b", n, half,
                            "uniform wear" if worn else "uniform pressure")  # fmt: skip
    N = n * P / sin(half)
    T = mu * N * torque / load
    return element, {"N": N, "friction": s * mu * N, "load_a": -s * T, "load_b": s * T}


def worn(rng: np.random.Generator, mu: float, s: int, law: Law) -> Case:
    return disc(rng, mu, s, law, worn=True)


def shoe(rng: np.random.Generator, mu: float, s: int, law: Law) -> Case:
    """Each kind of shoe; a self-energising share of up to 0.9."""
    r, P, size = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(0, 6), 10 ** rng.uniform(-3, 1)
    k = rng.uniform(0.01, 0.9) / mu
    arms = (size * rng.uniform(0.5, 3), size, k * size)
    kind, signs = [
        ("leading", [1]), ("trailing", [-1]), ("leading and trailing", [1, -1]),
        ("two leading", [1, 1]),
    ][rng.integers(4)]  # fmt: skip
    N, F = np.sum([lever(mu, s * sign, P, arms) for sign in signs], axis=0)
    element = mb.DrumBrake("w", "a", law, P, r, *arms, shoes=kind)
    return element, {"N": N, "friction": s * F, "load_a": -s * r * F}


def band(rng: np.random.Generator, mu: float, s: int, law: Law) -> Case:
    """Moments about the pivot, with the ends in the ratio of Eytelwein."""
    r, P, size = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(0, 6), 10 ** rng.uniform(-3, 1)
    angle = rng.uniform(0.1, 4 * pi)
    ratio, arm = exp(s * mu * angle), size * rng.uniform(0.5, 9)
    tight = size * rng.choice([0.0, -1.0, 0.9 / max(ratio, 1.0)])
    T_2 = P * arm / (size - tight * ratio)
    F = T_2 * (ratio - 1)
    element = mb.BandBrake("w", "a", law, P, r, angle, arm, size, tight)
    share = tight / size * F / T_2 / (1 - tight / size)
    return element, {
        "N": s * F / mu, "friction": F, "load_a": -r * F, "slack": T_2, "tight": T_2 * ratio,
        "locking": share,
    }  # fmt: skip


def capstan(rng: np.random.Generator, mu: float, s: int, law: Law) -> Case:
    r, P, angle = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(0, 6), rng.uniform(0.1, 6 * pi)
    groove = rng.uniform(0.3, pi / 2)
    T = P * exp(s * mu * angle / sin(groove))
    element = mb.CapstanDrum("w", "rope", law, P, r, angle, "a", groove)
    return element, {"load": T, "load_a": T - P, "load_b": -r * (T - P), "locking": 0.0}


def belt(rng: np.random.Generator, mu: float, s: int, law: Law) -> Case:
    r, P, angle = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(0, 6), rng.uniform(0.1, 2 * pi)
    groove, gear = rng.uniform(0.3, pi / 2), rng.choice([-3.0, 0.2])
    F = 2 * P * tanh(s * mu * angle / sin(groove) / 2)
    element = mb.Belt("w", "a", "b", law, P, r, r * gear, angle, groove)
    return element, {
        "friction": F, "load_a": -r * F, "load_b": r * gear * F, "tight": P + F / 2,
    }  # fmt: skip


@pytest.mark.parametrize("make", [disc, worn, shoe, band, capstan, belt])
@pytest.mark.parametrize("s", [1, -1])
def test_forces_are_those_of_equilibrium(make: Callable[..., Case], s: int) -> None:
    rng = np.random.default_rng(s + 1)
    mu = 10 ** rng.uniform(-2, -0.2)
    law = dry(mu) if s > 0 else sf.Coulomb(mu_d=mu, v_eps=1e-6)
    element, expected = make(rng, mu, s, law)
    run = at_start(turning(element, s * 10.0, 0.0, rope=make is capstan))
    for name, value in expected.items():
        assert run[f"w_{name}"][0] == pytest.approx(value, rel=1e-9, abs=1e-300), name
    power = run["w_friction"][0] * run["w_slip"][0]
    assert run["w_power"][0] == pytest.approx(power)
    assert power > 0


def test_absolute_coordinates_give_the_same_forces() -> None:
    m = driven(drum(sf.BrownMcPhee(), 100.0), 3.0)
    m.force(mb.DiscClutch("c", "a", sf.BrownMcPhee(), 50.0, 0.2, 0.1, pressure="uniform wear"))
    runs = [simulate(m.build(formulation=f), 0.5, rtol=1e-9) for f in ("joint", "absolute")]
    for name in ("w_N", "c_power", "w_slip"):
        assert runs[0][name] == pytest.approx(runs[1][name], rel=1e-7, abs=1e-6)


def test_long_shoes_have_the_arms_of_their_pressure() -> None:
    """Moments about the pivot of the elements of the lining, p = sin, by quadrature."""
    for r, d, start, end in ((0.15, 0.1, 0.1, 2.2), (2.0, 1.9, 0.0, pi), (1e-3, 5e-4, 1.0, 1.1)):
        load = quad(sin, start, end)[0]
        elements = np.linspace(start, end, 20001)
        normal = np.trapezoid(d * np.sin(elements) ** 2, elements)
        friction = np.trapezoid((r - d * np.cos(elements)) * np.sin(elements), elements)
        expected = normal / load, friction / load
        assert mb.shoe_arms(r, d, start, end) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("s", [1, -1])
def test_a_brake_holds_up_to_its_static_level(s: int) -> None:
    law, up = dry(0.4, 0.3), exp(s * 0.4 * 4)
    ring = 2 / 3 * (0.2**3 - 0.1**3) / (0.2**2 - 0.1**2)
    for element, level in (
        (drum(law, 100.0), 0.2 * 0.4 * 100 * 0.3 / 0.16 / (1 - s * 0.4 * K)),
        (drum(law, 100.0, "leading and trailing"), 30 * 0.2 * 5 / (1 - (0.4 * K) ** 2)),
        (mb.BandBrake("w", "a", law, 100.0, 0.2, 4.0, 0.3, 0.05, 0.005),
         s * 6 * (up - 1) / (0.05 - 0.005 * up)),
        (mb.DiscClutch("w", "a", law, 100.0, 0.2, 0.1, faces=3), 120 * ring),
    ):  # fmt: skip
        torque = {"torque": ramp(s * level)}
        run = simulate(driven(element, 0.0).build(), 1.2, u=torque, rtol=1e-8)
        ((t, what),) = run.happened
        assert (t, what) == (pytest.approx(1.0, rel=1e-9), "w_slip")
        assert np.abs(run["a_rate"][run.t < 0.999]).max() < 1e-12


@pytest.mark.parametrize(
    ("s", "R"), [(1, 0.2), (-1, 1.0), pytest.param(1, 1e-4, marks=pytest.mark.slow)]
)
def test_brakes_and_a_bearing_on_one_shaft_stop_and_hold_it_together(s: int, R: float) -> None:
    """The shaft stops after J w / (sum of the moments) and breaks away at the sum of the levels."""
    law, P = dry(0.4, 0.3), 50.0 / R
    m = mb.Mechanism("train", gravity=(0.0, 0.0, 0.0))
    bearing = mb.JointFriction(dry(0.2, 0.1), radius=R / 10, preload=P)
    attach(m, mb.Revolute, "a", "shaft_a", J=0.5, rate=s * 30.0, friction=bearing)
    m.force(mb.DiscClutch("x", "a", law, P, R, R))
    m.force(mb.DrumBrake("y", "a", law, P, R, 1.0, 1.0, 1.0))
    m.force(mb.BandBrake("w", "a", law, P, R, 2.0, 0.3, 0.6))
    m.force(mb.JointSpringDamper("motor", "a", actuator=m.input("torque", "N m")))

    def levels(mu: float, bearing: float) -> float:
        band = (exp(s * mu * 2.0) - 1) / 2
        return P * R * (bearing / 10 + mu + 2 * mu / (1 - mu**2) + s * band)

    slide, hold = levels(0.3, 0.1), levels(0.4, 0.2)
    stop = 0.5 * 30 / slide
    run = simulate(m.build(), 2 * stop, u={"torque": 0.0}, rtol=1e-9, samples=21)
    assert [what for _, what in run.happened] == ["a_loop_stick"]
    assert run.happened[0][0] == pytest.approx(stop, rel=1e-8)
    balance = run.energy_balance()
    assert np.abs(balance.defect).max() < 1e-9 * balance.scale
    assert "stick one by one, got a, x, y, w" in restless(m.build())
    m.joints[0] = replace(m.joints[0], rate=0.0)
    run = simulate(m.build(), 1.2, u={"torque": ramp(s * hold)}, rtol=1e-8)
    assert run.happened[0] == (pytest.approx(1.0, rel=1e-9), "a_loop_slip")
    moments = sum(run[f"{name}_load_a"] for name in "xyw") - R / 10 * run["a_friction"]
    held = run.t < 0.999
    assert moments[held] == pytest.approx(-s * hold * run.t[held], rel=1e-9, abs=1e-9)


def test_a_clutch_locks_after_the_time_of_the_closed_form() -> None:
    m = shafts(150.0, J=0.2)
    attach(m, mb.Revolute, "b", "load", J=0.64)
    m.force(mb.DiscClutch("w", "a", dry(0.3), 2000.0, 0.15, 0.1, "b", 2, pressure="uniform wear"))
    run = simulate(m.build(), 1.0, rtol=1e-9)
    T = 0.3 * 2000 * 2 * 0.125
    gain = T * (1 / 0.2 + 1 / 0.64)
    ((t, what),) = run.happened
    assert (t, what) == (pytest.approx(150 / gain, rel=1e-9), "w_stick")
    heat = T * 150**2 / (2 * gain)
    assert run.energy_balance().work["friction"][-1] == pytest.approx(-heat, rel=1e-9)
    assert run.final["a_rate"] == pytest.approx(150 * 0.2 / 0.84, rel=1e-12)
    assert run.final["w_slip"] == pytest.approx(0.0, abs=1e-12)


def test_a_driven_clutch_moves_as_the_scene() -> None:
    scene = simulate(Clutch(dry(0.1)).model(), 0.6, u={"pressure": 4e5}, rtol=1e-9)
    m = shafts(150.0, J=0.2)
    attach(m, mb.Revolute, "b", "load", J=0.64)
    m.force(mb.JointSpringDamper("engine", "a", actuator=100.0))
    m.force(mb.JointSpringDamper("drag", "b", actuator=-20.0))
    m.force(mb.DiscClutch("w", "a", dry(0.1), 4e5 * 0.008 * pi, 0.1, 0.1, "b", 2, preload=1.0))
    run = simulate(m.build(), 0.6, rtol=1e-9)
    assert run.happened[0][0] == pytest.approx(scene.happened[0][0], rel=1e-9)
    assert run.final["b_rate"] == pytest.approx(scene.final["w_2"], rel=1e-9)
    assert run["w_load_b"][-1] == pytest.approx(scene.final["torque"], rel=1e-9)


def test_a_shoe_above_its_limit_locks_itself() -> None:
    """mu k > 1: no torque turns the drum against the shoe; sliding has no solution there."""
    held, free, sliding = (driven(drum(dry(1.0), 100.0), rate) for rate in (0.0, 0.0, 9.0))
    run = simulate(held.build(), 1.0, u={"torque": ramp(1e6)})
    assert run.happened == ()
    assert abs(run.final["a"]) < 1e-9
    level = 0.2 * 100 * 0.3 / 0.16 / (1 + K)
    run = simulate(free.build(), 1.5, u={"torque": ramp(-level)})
    assert run.happened[0] == (pytest.approx(1.0, rel=1e-9), "w_slip")
    with pytest.raises(ValueError, match=r"friction jams, most of all through w_N.*lock itself"):
        simulate(sliding.build(), 1.0)
    near = at_start(turning(drum(dry(0.999 / K), 100.0), 9.0))
    assert near["w_locking"][0] == pytest.approx(0.999, rel=1e-9)


@pytest.mark.parametrize(("torque", "expected"), [(1.0, 1.0), (0.0, np.nan)])
def test_a_clutch_that_sticks_loses_nothing_and_rest_has_no_efficiency(
    torque: float, expected: float
) -> None:
    m = turning(mb.DiscClutch("w", "a", sf.ExactCoulomb(), 1e4, 0.2, 0.1, "b"), 0.0, 0.0)
    m.force(mb.JointSpringDamper("motor", "a", actuator=torque))
    run = simulate(m.build(), 1.0)
    assert mb.efficiency(run, "w") == pytest.approx(expected, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    "law",
    ["exact_coulomb", *(pytest.param(law, marks=pytest.mark.slow)
                        for law in ("brown_mcphee", "lugre_normalised"))],
)  # fmt: skip
def test_a_released_element_has_no_friction_and_never_pulls(law: str) -> None:
    def wave(t: ca.SX) -> ca.SX:
        return 50 * ca.sin(2 * pi * t)

    own = law_from_text(law)
    P = Variable("P", "N", start=1.0)
    for element in (
        drum(own, P, "leading and trailing"),
        mb.BandBrake("w", "a", own, P, 0.2, 4.0, 0.3, 0.05, 0.005),
        mb.DiscClutch("w", "a", own, P, 0.2, 0.1, "b"),
        mb.CapstanDrum("w", "rope", own, P, 0.1, 9.0, "a"),
        mb.Belt("w", "a", "b", own, P, 0.1, 0.2, 3.0),
    ):
        m = turning(element, 20.0, 0.0, rope=True)
        m.inputs.append(P)
        run = simulate(m.build(), 1.0, u={"P": wave}, samples=101)
        released = (run.t > 0.505) & (run.t < 1.0)
        assert np.abs(run["w_friction"][released]).max() < 1e-9
        assert np.ptp(run["a_rate"][released]) < 1e-5  # error of the run
        assert run["w_N"].min() > -1e-9
        assert run["w_friction"][1:50].max() > 1.0


ELEMENTS = ("DrumBrake", "DiscClutch", "BandBrake", "CapstanDrum", "Belt", "shoe_arms")
VALUES = {"np": np, "ca": ca, "sf": sf, "DRY": dry(0.3), "SHOE": SHOE}
VALUES |= {"LAW": sf.BrownMcPhee(), "kN": Variable("P", "kN")}
NAMES = Names({name: getattr(mb, name) for name in ELEMENTS} | VALUES)


def test_mistakes_are_described_in_one_sentence() -> None:
    """Elements in elements.toml, in a mechanism with the shafts a, b and the joint rope."""
    for text, message in table(__file__, "elements").items():
        with pytest.raises(ValueError) as caught:
            first, *more = NAMES.value(f"[{text}]")
            m = turning(first, 1.0, 2.0, rope=True)
            attach(m, mb.Revolute, "on_a", "pinion", "shaft_a")
            m.forces += more
            m.build()
        found = str(caught.value)
        assert message in found, (text, found)
        assert "\n" not in found, found
