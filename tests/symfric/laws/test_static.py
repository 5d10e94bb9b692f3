"""Closed forms of static laws: peaks, slopes and levels; `test_printed` compares their forces.

Laws with further inputs: applied forces, joints, servo drives, belts, quarter cars.
"""

from dataclasses import replace
from itertools import product
from math import atan, degrees, inf, pi, radians, sin, sqrt, tan

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

import symfric as sf
from symfric.laws.static.machines import tilt
from symfric.laws.static.self_tuning import brittleness, shape_factor
from symfric.scenes import Pendulum

N = 5.0
LEVELS = {"mu_s": 0.3, "mu_d": 0.2}
BOTH = {"mu_s": 1.5, "mu_d": 1.0}


PEAKS: list[tuple[sf.Law, float, float, float, float]] = [
    (sf.BrownMcPhee(**BOTH, v_t=1.0), 1.0068, 5e-5, 1.5 * 0.99957, 1e-5),
    (sf.SimscapeBreakaway(**BOTH), 1e-3, 2e-8, 1.5 - 4.1e-9, 4e-10),
    (sf.Stribeck(**BOTH, v_eps=1e-4), 2.7227e-4, 1e-8, 0.968 * 1.5, 7.5e-4),
    (sf.Andersson(**BOTH, k_t=1e4), 2.7227e-4, 1e-8, 0.968 * 1.5, 7.5e-4),
    (sf.MakkarDixon(), 2.415e-4, 1e-7, 0.905 * 1.5, 7.5e-4),
    (sf.BengisuAkay(**BOTH), 1e-3, 1e-8, 1.5, 0.0),
]
"""Law, velocity of its peak [m/s] and its error, force there under 1 N and its error."""


def test_peaks_have_their_stated_place_and_height() -> None:
    for law, place, near, height, error in PEAKS:
        v = place * np.append(np.linspace(0.5, 1.5, 200_001), 1.0)
        F = np.asarray(law.force(v, 1.0))
        assert v[F.argmax()] == pytest.approx(place, abs=near), law
        assert F.max() == pytest.approx(height, abs=error), law
    v = np.geomspace(1e-9, 1e-2, 20001)
    short = [1.5 - sf.Stribeck(**BOTH, v_eps=w).force(v, 1.0).max() for w in (1e-4, 1e-5, 1e-6)]
    assert short[0] > 10 * short[1] > 100 * short[2] > 0
    slow, middle, fast = sf.Stribeck(**BOTH, sigma_2=5.0).force(np.array([3e-4, 3e-3, 0.1]), 1.0)
    assert slow > middle < fast
    v = np.linspace(10, 800, 79_001) / 60000
    for law, speed, least in (
        (sf.SteadyStateLuGre.pilot(), 129, 3.1224), (sf.SteadyStateLuGre.main(), 532, 2.6527)
    ):  # fmt: skip
        F = np.asarray(law.force(v, 1.0))
        assert v[F.argmin()] * 60000 == pytest.approx(speed, abs=0.6)
        assert F.min() == pytest.approx(least, abs=5.1e-5)


def slope(law: sf.Law, v: float = 0.0, load: float = 1.0) -> float:
    x = ca.SX.sym("x")
    return float(ca.Function("slope", [x], [ca.gradient(law.force(x, load), x)])(v))


STEEPNESS = {"tanh": 1.0, "atan": 2 / pi, "erf": 2 / sqrt(pi), "sqrt": 1.0, "saturation": 1.0,
             "quadratic": 2.0}  # fmt: skip
SLOPES: list[tuple[sf.Law, float]] = [
    (sf.Threlfall(0.2, v_r=2e-3, form="original"), 3.0 * 0.2 / 2e-3),
    (sf.BengisuAkay(**BOTH, form="original"), 2 * 1.5 / 1e-3),
    (sf.VelocityBased(**BOTH, v_d=4e-3), 1.875 * 1.5 / 1e-3),
    (sf.Hollars(**BOTH), (2 * 1.5 - 1.0) / 1e-2),
    (sf.Step5(**BOTH), 0.0),
    *((sf.Coulomb(0.2, v_eps=1e-3, shape=shape), k * 200.0) for shape, k in STEEPNESS.items()),
]
"""Law, and its slope at rest under 1 N [N s/m]."""


def test_slopes_are_exact_although_equations_have_a_modulus() -> None:
    for law, expected in SLOPES:
        assert slope(law) == pytest.approx(expected, rel=1e-12), law
    behind = 1e-3 * (1 + 1e-9)
    assert slope(sf.BengisuAkay(**BOTH, form="original"), behind) == pytest.approx(-500.0, rel=1e-6)
    assert slope(sf.BengisuAkay(**BOTH), behind) == pytest.approx(0.0, abs=1e-2)


def test_smoothed_laws_tend_to_their_originals() -> None:
    falling = (kind(**LEVELS) for kind in (sf.Tustin, sf.Benson, sf.Stribeck))
    for law in (*falling, sf.SteadyStateLuGre(delta=0.78), sf.Coulomb(0.2)):
        original = replace(law, v_eps=0.0)
        assert original.force(0.0, N) == 0.0
        for v in (-3e-3, 1e-4, 5e-4, 2e-3):
            exact = float(original.force(v, N))
            errors = [
                abs(replace(law, v_eps=w).force(v, N) / exact - 1) for w in (1e-4, 1e-5, 1e-7)
            ]
            assert errors[0] >= errors[1] >= errors[2], law
            assert errors[0] > 0 or abs(v) > 1e-3, law
            assert errors[2] < 5e-4, law
    for shape in ("tanh", "atan", "quadratic"):
        law = sf.Coulomb(0.2, v_eps=0.0, shape=shape)
        assert [law.force(v, N) for v in (-1e-300, 0.0, 1e-9, 7.0)] == [-1.0, 0.0, 1.0, 1.0]
        assert law.velocity_scale == inf


SPEEDS = (0.0, 1e-3, 3e-3, 4e-3, 0.01, 0.1)
MU = (0.15, 0.16, 0.12, 0.1, 0.1, 0.2)


def test_table_is_the_monotone_cubic_of_its_points_and_constant_beyond() -> None:
    law = sf.Table(SPEEDS, MU, v_eps=1e-6)
    slopes = PchipInterpolator(SPEEDS, MU).derivative()(SPEEDS)
    slopes[[0, -1]] = 0.0
    v = np.linspace(1e-3, 0.1, 1001)
    expected = 2.0 * CubicHermiteSpline(SPEEDS, MU, slopes)(v)
    np.testing.assert_allclose(law.force(v, 2.0), expected, rtol=1e-12)
    np.testing.assert_allclose(law.force(-np.array(SPEEDS[1:]), N), -N * np.array(MU[1:]))
    assert law.force(7.0, N) == pytest.approx(1.0, rel=1e-14)
    assert law.force(0.0, N) == 0.0
    for knot in SPEEDS[1:]:
        sides = [slope(sf.Table(SPEEDS, MU), knot * (1 + s)) for s in (-1e-9, 0.0, 1e-9)]
        assert sides == pytest.approx([sides[1]] * 3, abs=1e-4)


RATIOS = (0.0, 0.3, 0.55, 0.8, 0.95)


def rest_slope(law: sf.SelfTuning, load: float = N) -> float:
    return float(law.force(1e-12, load)) / 1e-12


def test_peak_and_slope_are_the_chosen_ones() -> None:
    for ratio in RATIOS:
        for v_p in (1e-5, 3e-3, 1.0):
            for E in (-5.0, 0.0, 0.9) if ratio else (0.0,):
                law = sf.SelfTuning.from_peak_velocity(v_p, mu_s=0.4, mu_d=0.4 * ratio, E=E)
                near = [float(law.force(share * v_p, N)) for share in (0.99, 1.0, 1.01)]
                assert near[1] == pytest.approx(2.0, rel=1e-14)
                assert near[0] < near[1] > near[2]
        for E in (0.0, 0.5, -2.0):
            law = sf.SelfTuning.from_slope(3e3, N, mu_s=0.4, mu_d=0.4 * ratio, E=E)
            assert rest_slope(law) == pytest.approx(3e3, rel=1e-6)
    for rho, stiffness in ((0.5, 1.376), (0.8, 2.036), (0.9, 2.736)):  # as published
        found = sf.SelfTuning.from_peak_velocity(1.0, mu_s=1.0, mu_d=rho).B
        assert found == pytest.approx(stiffness, abs=5.1e-4)
    for ratio, y_p in ((0.1, 1.2), (0.5, 1.1), (0.5, 1.5), (0.9, 2.95)):
        # stiffness and peak velocity given: E = (B v_p - tan(pi/2C)) / (B v_p - atan(B v_p))
        E = (y_p - tan(pi / (2 * shape_factor(ratio)))) / (y_p - atan(y_p))
        law = sf.SelfTuning(mu_s=0.4, mu_d=0.4 * ratio, B=200.0, E=E)
        assert law.force(y_p / 200.0, N) == pytest.approx(2.0, rel=1e-14)


def test_symbols_give_stiffnesses_except_of_a_curved_peak() -> None:
    mu_s, load = ca.SX.sym("mu_s"), ca.SX.sym("N")
    assert isinstance(sf.SelfTuning.from_slope(3e3, N, mu_s=mu_s).B, ca.SX)
    assert isinstance(sf.SelfTuning.from_peak_velocity(1e-3, mu_s=mu_s).B, ca.SX)
    brittle = sf.SelfTuning(B=brittleness(load, 0.05))
    v_p = ca.Function("peak", [load], [tan(pi / (2 * brittle.C)) / brittle.B])
    assert float(v_p(200.0)) < float(v_p(N))
    law, (mu_d,) = sf.symbolise(sf.SelfTuning(mu_s=0.2, mu_d=0.1), "mu_d")
    slope = ca.Function("slope", [mu_d.symbol], [ca.gradient(law.C, mu_d.symbol)])
    assert float(slope(0.2)) == -inf, "where the levels meet"


def test_brittleness_has_the_tabulated_values() -> None:
    for load, B in ((5.0, 186), (10.0, 263), (50.0, 669), (200.0, 984)):
        assert brittleness(load, 0.05) == pytest.approx(B, abs=0.51)
        law = sf.BrittleSelfTuning(mu_s=0.15, mu_d=0.1)
        same = sf.SelfTuning(mu_s=0.15, mu_d=0.1, B=brittleness(load, 0.05))
        assert law.force(1e-3, load) == pytest.approx(same.force(1e-3, load), rel=1e-12)


RATES = np.linspace(-0.1, 0.1, 41)
STICKING = [
    sf.Karnopp(**LEVELS),
    sf.Karnopp(**LEVELS, form="original"),
    sf.Awrejcewicz(**LEVELS),
    sf.Awrejcewicz(**LEVELS, form="original"),
    sf.LeineSwitch(0.3, form="original"),
]
SMOOTH = STICKING[0], STICKING[2]


def test_contact_at_rest_carries_the_applied_force_up_to_the_static_level() -> None:
    for law in STICKING:
        F_e = np.linspace(-1.499, 1.499, 31)
        assert (law.force(0.0, N, F_e=F_e) == F_e).all(), law
        F_e = np.array([1.51, -1.7, 80.0])
        assert law.force(0.0, N, F_e=F_e) == pytest.approx(1.5 * np.sign(F_e), rel=1e-14)
        for pull in (0.0, 0.7, -99.0):
            assert law.force(0.3, N, F_e=pull) == law.force(0.3, N), "fast sliding has no F_e"
    v = np.array([-0.1, -2e-3, 2e-3, 0.05])
    for law in SMOOTH:
        original = replace(law, form="original")
        np.testing.assert_allclose(law.force(v, N, F_e=0.4), original.force(v, N, F_e=0.4))


def test_body_at_rest_stays_below_break_away_and_leaves_above() -> None:
    for law in SMOOTH:
        model = sf.drive(law, m=1.0, N=N)
        below, above = (sf.simulate(model, 1.0, u={"force": F}).final["v"] for F in (1.49, 1.55))
        assert below == 0.0
        assert above > 0.3
    model = sf.drive(SMOOTH[0], m=1.0, N=N)
    at = [sf.simulate(model, t, x0={"v": 0.1}, rtol=1e-9).final["v"] for t in (20.0, 80.0)]
    assert at[0] / at[1] == pytest.approx(2.0, rel=0.05), "v ~ 1/sqrt(t) inside the band"


LEVEL = 0.15 * N
BAND: dict[str, tuple[sf.Law, float, float]] = {
    "karnopp": (sf.Karnopp(), 1e-3, -0.274 * LEVEL * 1e-3),
    "karnopp, original": (sf.Karnopp(form="original"), 1e-3, -LEVEL * 1e-3),
    "awrejcewicz": (sf.Awrejcewicz(), 1e-3, -0.204 * LEVEL * 1e-3),
    "awrejcewicz, original": (sf.Awrejcewicz(form="original"), 1e-3, -0.204 * LEVEL * 1e-3),
    "leine_switch, original": (sf.LeineSwitch(form="original"), 1e-6, -LEVEL * 1e-6),
}
"""Laws that hold what is applied in a band: the law, the band's half width, least power [W]."""


def test_friction_in_a_band_of_rest_gains_no_more_power_than_stated() -> None:
    for law, width, least in BAND.values():
        v = width * np.concatenate([np.linspace(-3.0, 3.0, 2001), [0.999999]])
        power = np.asarray(law.force(v, N, F_e=np.linspace(-3.0, 3.0, 61)[:, None])) * v
        assert least <= power.min() < 0.75 * least, "the bound, that for mu_d = 0, is not idle"
        assert power[:, np.abs(v) > width].min() > 0
    for name, least in (("karnopp", -0.274), ("awrejcewicz", -0.204)):
        law, width, _ = BAND[name]
        run = sf.simulate(Pendulum(law).model(), 2.0)
        load = np.abs(run["phi_N"]).max()
        lowest, highest = run.extremes["phi_power"]
        assert least * 0.15 * load * width <= lowest < 0 < highest


def settled(run: sf.Trajectory, since: float) -> tuple[float, float]:
    """Return period and largest position."""
    late, x = run.t > since, run["x"] - 0.5
    falling = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0) & late[1:])
    share = x[falling] / (x[falling] - x[falling + 1])
    times = run.t[falling] + share * np.diff(run.t)[falling]
    return float(np.diff(times)[-1]), float(run["x"][late].max())


def test_smooth_switch_model_has_the_published_stick_slip() -> None:
    for v_eps, period, x_max in ((1e-3, 11.298, 1.0671), (1e-2, 9.7097, None)):
        law = sf.LeineSwitch(mu_s=1.0, delta=3.0, v_eps=v_eps)
        model = sf.rabinowicz(law, m=1.0, k=1.0, v_belt=0.2, g=1.0)
        found = settled(sf.simulate(model, 60.0, rtol=1e-9, samples=60_001), 30.0)
        assert found[0] == pytest.approx(period, abs=1e-3)
        assert x_max is None or found[1] == pytest.approx(x_max, abs=2e-4)


def test_wojewoda_is_coulomb_without_acceleration_and_opposes_the_motion() -> None:
    expected = sf.Coulomb(0.2, v_eps=1e-4).force(RATES, N)
    assert sf.Wojewoda(**LEVELS).force(RATES, N, dv=0.0) == pytest.approx(
        expected, rel=1e-14, abs=1e-300
    )
    v, dv = np.meshgrid(np.geomspace(1e-6, 1.0, 20), np.linspace(-100.0, 100.0, 41))
    assert (np.asarray(sf.Wojewoda(mu_s=0.2, mu_d=0.1).force(v, N, dv=dv)) >= 0).all()


def test_bittencourt_depends_on_temperature() -> None:
    """Its formula is compared with the printed equation."""
    cold = sf.Bittencourt(T=5.0, v_s0=10.0, F_eps=0.0)
    assert cold.force(0.1, 0.0) == sf.with_values(cold, {"F_s0": 0.0, "F_sT": 0.0}).force(0.1, 0.0)
    assert sf.Bittencourt(T=5.0, v_s0=10.0).force(0.1, 0.0) >= cold.force(0.1, 0.0)
    T = ca.SX.sym("T")
    slope = ca.Function("slope", [T], [ca.gradient(sf.Bittencourt(T=T).force(50.0, 1.0), T)])
    step = (sf.Bittencourt(T=31.0).force(50.0, 1.0) - sf.Bittencourt(T=29.0).force(50.0, 1.0)) / 2
    assert float(slope(30.0)) == pytest.approx(step, rel=1e-3)


def test_bam_has_the_inputs_of_its_terms() -> None:
    """Its formula is compared with the printed equation."""
    unloaded = {"K_e": 0.0, "K_m": 0.0, "K_es": 0.0, "K_ms": 0.0}
    assert sf.BAM(**unloaded).inputs == ()
    assert [i.name for i in sf.BAM(**{**unloaded, "K_m": 0.1}).inputs] == ["tau_m", "tau_e"]
    assert sf.BAM(**unloaded, K_s=ca.SX.sym("K_s")).inputs == ()
    law = sf.BAM(tau_eps=1e-9)  # equal coefficients see the torque through the gear alone
    one = law.force(0.5, 1.0, tau_m=0.7, tau_e=0.2)
    assert one == pytest.approx(law.force(0.5, 1.0, tau_m=0.1, tau_e=-0.4), rel=1e-12)


def test_linkage_of_a_quarter_car_turns_by_its_angle() -> None:
    for x_rel, angle in ((6.9e-3, 0.7075), (-6.9e-3, -0.6905), (0.0, 0.0)):
        assert degrees(tilt(x_rel, pi / 4, 0.4)) == pytest.approx(angle, abs=5.1e-5)
    for theta, x_rel in product((radians(30), pi / 4, radians(70)), (-0.05, 0.02)):
        # the strut of length L turns as its end moves by x across the angle theta
        shortened, across = 0.4 - x_rel * sin(theta), x_rel * sin(pi / 2 - theta)
        assert shortened * sin(tilt(x_rel, theta, 0.4)) == pytest.approx(across, rel=1e-12)


def test_quarter_car_holds_at_rest_and_drives_as_printed_only() -> None:
    law, printed = sf.QuarterCarGeneral(), sf.QuarterCarGeneral(form="as_printed")
    x = np.linspace(-0.0066, 0.0066, 21)
    assert (law.force(0.0, 0.0, x_rel=x) == 28900.0 * x).all()
    for sign in (1.0, -1.0):
        assert law.force(0.0, 0.0, x_rel=sign * 0.01) == pytest.approx(sign * 193.8)
        assert printed.force(0.0, 0.0, x_rel=sign * 0.01) == pytest.approx(sign * 289.0)
    simple = sf.QuarterCarSimple(v_eps=0.0).force(RATES, 0.0)
    plain = sf.QuarterCarGeneral(mu=0.0).force(RATES, 0.0, x_rel=0.02)
    moving = np.abs(RATES) > 2e-3
    assert plain[moving] == pytest.approx(simple[moving], rel=1e-13)
    v, x = np.meshgrid(np.linspace(-1.0, 1.0, 200), np.linspace(-0.05, 0.05, 21))
    powers = [
        np.asarray(replace(one, C_e=10.0, sigma_v=5.0).force(v, 0.0, x_rel=x, v_rel=0.0)) * v
        for one in (law, printed)
    ]
    outside = np.abs(v) > 1e-3
    assert powers[0][outside].min() > 0 > powers[1][outside].min()
    v = np.linspace(-3e-3, 3e-3, 2001)
    inside = np.asarray(law.force(v, N, x_rel=np.linspace(-0.02, 0.02, 41)[:, None])) * v
    assert -0.274 * 193.8 * 1e-3 <= inside.min() < 0
