"""Closed forms of static laws: values, peaks, slopes, limits to each other, refusals."""

from dataclasses import replace
from math import e, exp, expm1, inf, pi, sin, sqrt, tanh

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from symfric import BrownMcPhee, Coulomb, Law, LuGre, SelfTuning, Stribeck, Viscous
from symfric.laws import (
    Ambrosio,
    Andersson,
    BengisuAkay,
    Benson,
    Capstan,
    DuanSingh,
    Exudyn,
    Hollars,
    Lorentzian,
    MakkarDixon,
    ModifiedThrelfall,
    PoppStelter,
    PowerLawViscous,
    RuiWang,
    SimscapeBreakaway,
    Specker,
    SteadyStateLuGre,
    Step5,
    Table,
    Threlfall,
    Tustin,
    VelocityBased,
)

N = 5.0
V = np.concatenate([np.linspace(-0.1, 0.1, 41), np.geomspace(1e-7, 1.0, 60)])
LEVELS = {"mu_s": 0.3, "mu_d": 0.2}
BOTH = {"mu_s": 1.5, "mu_d": 1.0}
TUNED = SelfTuning(**LEVELS, B=500.0, E=-0.4)
STRIBECK = Stribeck(**LEVELS, v_s=2e-3, delta=1.0, v_eps=2e-4, sigma_2=0.4)
SAME: list[tuple[Law, Law, float]] = [
    (Tustin(**LEVELS, v_s=2e-3, v_eps=2e-4, sigma_2=0.4), STRIBECK, 1e-11),
    (Andersson(**LEVELS, v_s=2e-3, p=1.0, k_t=5e3, sigma_2=0.4), STRIBECK, 1e-11),
    (DuanSingh(mu_s=0.2, mu_d=0.2, sigma=1e3), Coulomb(0.2, v_eps=1e-3), 1e-14),
    (BrownMcPhee(mu_s=0.2, mu_d=0.2, v_t=4e-3), Coulomb(0.2, v_eps=1e-3), 1e-14),
    (Ambrosio(0.3, 0.0, 2e-3, "original"), Coulomb(0.3, 2e-3, "saturation"), 1e-14),
    (PowerLawViscous(0.4, d=1.0), Viscous(0.4), 0.0),
    (RuiWang(D=1.5, C=TUNED.C, B=500.0, E=-0.4), TUNED, 1e-13),
    (Capstan(0.3, beta=1e-6), Coulomb(0.3e-6), 1e-6),
]
"""A law, the law that it is with these numbers, and the relative rounding."""


def test_laws_are_the_limits_of_each_other() -> None:
    for one, other, rounding in SAME:
        expected = np.asarray(other.force(V, N))
        assert one.force(V, N) == pytest.approx(expected, rel=rounding, abs=1e-15), one
    one, other = Specker(**BOTH, v_sp=1e-3, v_t=1e-4), SimscapeBreakaway(**BOTH)
    assert one.force(V, 1.0) == pytest.approx(other.force(V, 1.0), abs=4.2e-9)
    bristle = LuGre(**LEVELS, v_s=2e-3, delta=3.2, sigma_2=0.4, v_eps=0.0)
    steady = SteadyStateLuGre(F_S=1.5, F_C=1.0, v_s=2e-3, sigma_2=0.4, delta=3.2, v_eps=0.0)
    for v in (-0.1, -1e-5, 2e-4, 0.03):
        force = bristle.force(v, N, bristle.steady_state(v, N))
        assert steady.force(v, 0.0) == pytest.approx(force)


VALUES: list[tuple[Law, float, float, float, float]] = [
    *((Viscous(sigma_2=3.0), -0.5, load, -1.5, 0.0) for load in (0.0, 1.0, 1e3)),
    (Lorentzian(mu_s=0.3, mu_d=0.1, v_s=2e-3, v_eps=0.0), -2e-3, N, -1.0, 1e-14),
    (PoppStelter(mu_s=0.3, eta=0.4, d=1e6, v_eps=0.0), 1e3, N, 0.6, 1e-8),
    (BrownMcPhee(**BOTH, v_t=0.02), 0.02, 1.0, 1.5 - 6.7e-4, 2e-6),
    (BrownMcPhee(**BOTH, v_t=1e-3), 0.1, 1.0, 1.0 + 8e-6, 1e-8),
    (BrownMcPhee(**BOTH, v_t=1e-3, mu_v=0.4, N_t=2.0), 10.0, 0.5, 0.5 + 4 * tanh(1.0), 1e-9),
    (SimscapeBreakaway(**BOTH), 1e-2, 1.0, 1.0, 1e-15),
    (Specker(**BOTH, v_sp=1e-3, v_t=5e-4, sigma_2=100.0), 1e-3, 2.0, 3.0, 1e-15),
    (MakkarDixon(gamma_4=2.0, gamma_6=0.3), 10.0, 1.0, 5.0, 1e-15),
    *((RuiWang(D=2.0, C=C), 1e9, 1.0, 2.0 * sin(C * pi / 2), 1e-9) for C in (0.5, 1.0, 1.7)),
    (Threlfall(1.0, form="original"), 1.000001e-3, 1.0, 0.95, 0.0),
    *((Hollars(**BOTH, u_eps=u), 1e-2, 2.0, 3 - 0.5625 * u, 1e-14) for u in (0.0, 0.1, 0.4)),
    *(
        (Exudyn(**BOTH, u_eps=u), 1e-3, 2.0, (2 + exp(-0.1875 * u)) * (1 - 0.1875 * u), 1e-14)
        for u in (0.1, 0.4)
    ),
    *(
        (Capstan(0.3, beta=2 * pi, v_eps=0.0), s, 50.0, 50.0 * expm1(s * 0.6 * pi), 1e-13)
        for s in (1.0, -1.0)
    ),
    *(
        (PowerLawViscous(0.4, d=d, v_eps=1e-4), v, 1.0,
         0.4 * np.copysign(abs(v) ** d, v) * (1 + (d - 1) / 2 * (1e-4 / v) ** 2), 1e-8)
        for d in (0.5, 1.5, 3.0) for v in (-0.1, 1e-2)
    ),
]  # fmt: skip
"""Law, velocity [m/s], load [N], force [N], relative rounding."""


def test_forces_at_marked_velocities_are_the_closed_forms() -> None:
    for law, v, load, F, rounding in VALUES:
        assert law.force(v, load) == pytest.approx(F, rel=rounding, abs=1e-300), (law, v)


PEAKS: list[tuple[Law, float, float, float, float]] = [
    (BrownMcPhee(**BOTH, v_t=1.0), 1.0068, 5e-5, 1.5 * 0.99957, 1e-5),
    (SimscapeBreakaway(**BOTH), 1e-3, 2e-8, 1.5 - 4.1e-9, 4e-10),
    (Stribeck(**BOTH, v_eps=1e-4), 2.7227e-4, 1e-8, 0.968 * 1.5, 7.5e-4),
    (Andersson(**BOTH, k_t=1e4), 2.7227e-4, 1e-8, 0.968 * 1.5, 7.5e-4),
    (MakkarDixon(), 2.415e-4, 1e-7, 0.905 * 1.5, 7.5e-4),
    (BengisuAkay(**BOTH), 1e-3, 1e-8, 1.5, 0.0),
]
"""Law, velocity of its peak [m/s] and its error, force there under 1 N and its error."""


def test_peaks_have_their_stated_place_and_height() -> None:
    for law, place, near, height, error in PEAKS:
        v = place * np.append(np.linspace(0.5, 1.5, 200_001), 1.0)
        F = np.asarray(law.force(v, 1.0))
        assert v[F.argmax()] == pytest.approx(place, abs=near), law
        assert F.max() == pytest.approx(height, abs=error), law
    v = np.geomspace(1e-9, 1e-2, 20001)
    short = [1.5 - Stribeck(**BOTH, v_eps=w).force(v, 1.0).max() for w in (1e-4, 1e-5, 1e-6)]
    assert short[0] > 10 * short[1] > 100 * short[2] > 0
    slow, middle, fast = Stribeck(**BOTH, sigma_2=5.0).force(np.array([3e-4, 3e-3, 0.1]), 1.0)
    assert slow > middle < fast
    v = np.linspace(10, 800, 79_001) / 60000
    for law, speed, least in (
        (SteadyStateLuGre.pilot(), 129, 3.1224), (SteadyStateLuGre.main(), 532, 2.6527)
    ):  # fmt: skip
        F = np.asarray(law.force(v, 1.0))
        assert v[F.argmin()] * 60000 == pytest.approx(speed, abs=0.6)
        assert F.min() == pytest.approx(least, abs=5.1e-5)


def slope(law: Law, v: float = 0.0, load: float = 1.0) -> float:
    x = ca.SX.sym("x")
    return float(ca.Function("slope", [x], [ca.gradient(law.force(x, load), x)])(v))


OLD_THRELFALL = Threlfall(0.2, v_r=2e-3, form="original")
SLOPES: list[tuple[Law, float]] = [
    (BrownMcPhee(**BOTH, v_t=1e-3), (4 + 16 / 9 * 0.5) / 1e-3),
    (SimscapeBreakaway(**BOTH), (sqrt(e) * 0.5 + 10 * 1.0) / 1e-3),
    (OLD_THRELFALL, 3.0 * 0.2 / 2e-3),
    (ModifiedThrelfall(0.2, 2e-3, "original"), 3.0 / (1 - exp(-3)) * 0.2 / 2e-3),
    (Threlfall(0.2, v_r=2e-3), 3.0 * 0.2 / 2e-3),
    (BengisuAkay(**BOTH), 2 * 1.5 / 1e-3),
    (BengisuAkay(**BOTH, form="original"), 2 * 1.5 / 1e-3),
    (VelocityBased(**BOTH, v_d=4e-3, form="original"), 1.5 * 1.5 / 1e-3),
    (VelocityBased(**BOTH, v_d=4e-3), 1.875 * 1.5 / 1e-3),
    (Ambrosio(0.3, v_0=0.0, v_1=2e-3, form="original"), 0.3 / 2e-3),
    (Hollars(**BOTH), (2 * 1.5 - 1.0) / 1e-2),
    (Exudyn(**BOTH), 1.5 / 1e-3),
    (Step5(**BOTH), 0.0),
    *(
        (Coulomb(0.2, v_eps=1e-3, shape=shape), steepness * 0.2 / 1e-3)
        for shape, steepness in {
            "tanh": 1.0, "atan": 2 / pi, "erf": 2 / sqrt(pi), "sqrt": 1.0, "saturation": 1.0,
            "quadratic": 2.0,
        }.items()
    ),
]  # fmt: skip
"""Law, and its slope at rest under 1 N [N s/m]."""


def test_slopes_are_exact_although_equations_have_a_modulus() -> None:
    for law, expected in SLOPES:
        assert slope(law) == pytest.approx(expected, rel=1e-12), law
    behind = 1e-3 * (1 + 1e-9)
    assert slope(BengisuAkay(**BOTH, form="original"), behind) == pytest.approx(-500.0, rel=1e-6)
    assert slope(BengisuAkay(**BOTH), behind) == pytest.approx(0.0, abs=1e-2)


def test_smoothed_laws_tend_to_their_originals() -> None:
    for law in (Tustin(**LEVELS), Benson(**LEVELS), SteadyStateLuGre(delta=0.78), Coulomb(0.2),
                Stribeck(**LEVELS)):  # fmt: skip
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
        law = Coulomb(0.2, v_eps=0.0, shape=shape)
        assert [law.force(v, N) for v in (-1e-300, 0.0, 1e-9, 7.0)] == [-1.0, 0.0, 1.0, 1.0]
        assert law.velocity_scale == inf


SPEEDS = (0.0, 1e-3, 3e-3, 4e-3, 0.01, 0.1)
MU = (0.15, 0.16, 0.12, 0.1, 0.1, 0.2)


def test_table_is_the_monotone_cubic_of_its_points_and_constant_beyond() -> None:
    law = Table(SPEEDS, MU, v_eps=1e-6)
    slopes = PchipInterpolator(SPEEDS, MU).derivative()(SPEEDS)
    slopes[[0, -1]] = 0.0
    v = np.linspace(1e-3, 0.1, 1001)
    expected = 2.0 * CubicHermiteSpline(SPEEDS, MU, slopes)(v)
    np.testing.assert_allclose(law.force(v, 2.0), expected, rtol=1e-12)
    np.testing.assert_allclose(law.force(-np.array(SPEEDS[1:]), N), -N * np.array(MU[1:]))
    assert law.force(7.0, N) == pytest.approx(1.0, rel=1e-14)
    assert law.force(0.0, N) == 0.0
    for knot in SPEEDS[1:]:
        sides = [slope(Table(SPEEDS, MU), knot * (1 + s)) for s in (-1e-9, 0.0, 1e-9)]
        assert sides == pytest.approx([sides[1]] * 3, abs=1e-4)
