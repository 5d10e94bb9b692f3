"""Describing functions and harmonic balance against closed forms, other solvers and orbits."""

from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hunting import hunting
from scipy.integrate import quad, solve_ivp

from symfric import ExactCoulomb, LuGre, Model, Variable, contact, drive, rabinowicz, simulate
from symfric.dynamics import describing_function, harmonic_balance, periodic_orbit
from symfric.laws import ALL_LAWS, Coulomb, Dahl, MaxwellSlip, Stribeck, Viscous, Wojewoda
from symfric.laws.base.law import FORCE


def test_coulomb_and_viscous_have_their_closed_forms() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        mu, N, sigma = rng.uniform(0.05, 0.8), 10 ** rng.uniform(-2, 3), rng.uniform(0.1, 9.0)
        V, w = 10 ** rng.uniform(-9, 2, 4), 10 ** rng.uniform(-3, 4, 3)
        found = describing_function(ExactCoulomb(mu_s=2 * mu, mu_d=mu), V, w, N=N)
        assert found.values.shape == (4, 3)
        expected = np.repeat(4 * mu * N / (np.pi * V[:, None]), 3, axis=1)
        np.testing.assert_allclose(found.values, expected, rtol=1e-12)
        viscous = describing_function(Viscous(sigma_2=sigma), V, w).values
        np.testing.assert_allclose(viscous, np.full((4, 3), sigma), rtol=1e-12)


def test_smoothing_much_narrower_than_the_amplitude_is_resolved() -> None:
    V = np.array([1e-6, 1e-3, 1.0, 1e3])
    found = describing_function(Coulomb(mu_d=0.2, v_eps=1e-9), V, [1.0]).values[:, 0]
    np.testing.assert_allclose(found, 0.8 / (np.pi * V), rtol=1e-5)
    law = Stribeck(mu_s=0.3, mu_d=0.1, v_s=0.1)
    for one in (0.02, 0.3, 4.0):
        whole = quad(
            lambda a, one=one: float(law.force(one * np.sin(a), 1.0)) * np.sin(a),
            0, np.pi / 2, points=[1e-4, 1e-3, 1e-2, 0.1], limit=500, epsabs=1e-13,
        )[0]  # fmt: skip
        value = describing_function(law, [one], [1.0]).values[0, 0]
        assert value == pytest.approx(4 / (np.pi * one) * whole, rel=1e-10)


def test_bristles_are_springs_at_small_amplitudes() -> None:
    law, w = LuGre(sigma_0=3e4, sigma_1=50.0, sigma_2=2.0), np.array([0.5, 20.0, 3e3])
    # the slip in a period relaxes a share of about V / w / 3e-6 m
    found = describing_function(law, [1e-12], w).values[0]
    np.testing.assert_allclose(found, 3e4 / (1j * w) + 52.0, rtol=1e-5)
    springs = sum(e.k for e in MaxwellSlip().elements)
    stiff = describing_function(MaxwellSlip(), [1e-8], [10.0]).values[0, 0]
    assert stiff == pytest.approx(springs / 10j, rel=1e-6)


def lugre_by_scipy(law: LuGre, V: float, w: float) -> complex:
    """Return the value after four half periods by an implicit Runge-Kutta method of SciPy."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        v = V * np.cos(w * t)
        level = law.mu_d + (law.mu_s - law.mu_d) * np.exp(-((v / law.v_s) ** 2))
        rate = v - law.sigma_0 * abs(v) * y[0] / level
        force = law.sigma_0 * y[0] + law.sigma_1 * rate + law.sigma_2 * v
        return [rate, force * np.cos(w * t), -force * np.sin(w * t)]

    z, y, quarter = 0.0, np.zeros(3), np.pi / w / 2
    for k in range(4):
        y = np.array([z, 0.0, 0.0])
        for i in (2 * k, 2 * k + 1):
            span = (i * quarter, (i + 1) * quarter)
            y = solve_ivp(rates, span, y, "LSODA", rtol=1e-9, atol=1e-14).y[:, -1]
        z = y[0]
    return 2 * w / (np.pi * V) * complex(y[1], y[2])


def test_lugre_agrees_with_a_long_run_of_another_solver() -> None:
    law = LuGre(sigma_0=1e4, sigma_1=60.0, sigma_2=0.4, v_s=1e-2)
    for V, w in ((1e-3, 5.0), (0.05, 40.0)):
        value = describing_function(law, [V], [w]).values[0, 0]
        assert value == pytest.approx(lugre_by_scipy(law, V, w), rel=1e-6)


def test_dahl_does_not_depend_on_the_rate() -> None:
    # at equal strokes V / w the loop is the same, so w n(V, w) is
    values = [
        w * describing_function(Dahl(), [stroke * w], [w]).values[0, 0]
        for w in (0.1, 200.0)
        for stroke in (1e-6, 2e-5)
    ]
    np.testing.assert_allclose(values[2:], values[:2], rtol=1e-6)


@pytest.mark.slow
def test_every_law_dissipates_and_tends_to_its_sliding_force() -> None:
    for name, kind in ALL_LAWS.items():
        law = kind()
        if any(i.name != FORCE for i in law.inputs):
            with pytest.raises(ValueError, match="a law without the inputs"):
                describing_function(law, [1.0], [1.0])
            continue
        found = describing_function(law, [1e-4, 1e-2, 1.0], [1.0, 30.0]).values
        assert (found.real > -1e-12).all(), name


def test_the_balance_of_coulomb_friction_has_its_closed_form() -> None:
    # i w (k_p - w^2) - (k_d + n) w^2 + k_i = 0: w^2 = k_p and n = k_i / k_p - k_d
    for k_d, k_i, k_p, mu in (
        (0.5, 80.0, 60.0, 0.1),
        (0.1, 30.0, 90.0, 0.2),
    ):
        machine = hunting(ExactCoulomb(mu_s=1.5 * mu, mu_d=mu), k_d, k_i, k_p, target=0.2)
        (one,) = harmonic_balance(machine, (1e-3, 50.0), (0.5, 30.0))
        speed = 4 * mu * 9.81 / (np.pi * (k_i / k_p - k_d))
        assert one.speed == pytest.approx(speed, rel=1e-6)
        assert one.period == pytest.approx(2 * np.pi / np.sqrt(k_p), rel=1e-6)
        assert one.amplitudes["x"] == pytest.approx(speed / np.sqrt(k_p), rel=1e-6)
        assert one.x["v"] == pytest.approx(speed, rel=1e-6)
        assert one.x["x"] == pytest.approx(0.2, abs=1e-6)


def test_the_balance_is_near_the_exact_orbit_and_nearer_at_larger_motions() -> None:
    law, errors = ExactCoulomb(mu_s=0.1, mu_d=0.1), list[float]()
    for k_i in (90.0, 50.0):
        (one,) = harmonic_balance(hunting(law, 0.5, k_i, target=0.2), (0.1, 20.0), (4.0, 15.0))
        orbit = one.orbit()
        assert orbit.stable is False
        errors.append(abs(one.period / orbit.period - 1))
        assert one.amplitudes["x"] == pytest.approx(orbit.amplitude("x"), rel=0.02)
    assert errors[0] < 0.01
    assert errors == sorted(errors, reverse=True)


@pytest.mark.slow
def test_bristles_keep_the_balance_near_the_orbit() -> None:
    law = LuGre(mu_s=0.3, mu_d=0.1, sigma_0=1e3, sigma_1=30.0, v_s=0.05)
    (one,) = harmonic_balance(hunting(law, 0.5, 80.0, target=0.2), (0.3, 6.0), (4.0, 15.0))
    orbit = one.orbit()
    assert one.value.imag > 1e-3
    assert one.period == pytest.approx(orbit.period, rel=0.01)
    assert one.amplitudes["x"] == pytest.approx(orbit.amplitude("x"), rel=0.02)


def test_hunting_by_static_friction_is_not_predicted() -> None:
    machine = hunting(ExactCoulomb(mu_s=0.3, mu_d=0.1), 3.0, 25.0, target=0.2)
    orbit = periodic_orbit(machine, simulate(machine, 100.0))
    assert orbit.stable and "stick" in orbit.events
    assert harmonic_balance(machine, (1e-4, 10.0), (0.05, 30.0)) == ()


def test_pictures_and_descriptions_name_units(tmp_path: Path) -> None:
    found = describing_function(LuGre(), [1e-3], [1.0, 10.0])
    assert "magnitude [N s/m]" in repr(found)
    found.plot(tmp_path / "over_frequency.png")
    single = describing_function(Coulomb(), [1e-5, 1e-3], [1.0]).plot(tmp_path / "one.png")
    assert single.axes[1].get_xlabel() == "amplitude of the velocity [m/s]"
    assert (tmp_path / "over_frequency.png").exists()
    (one,) = harmonic_balance(
        hunting(ExactCoulomb(), 0.5, 80.0, target=0.2), (0.1, 9.0), (4.0, 15.0)
    )
    assert "period" in repr(one) and "m s" in repr(one)


def loaded() -> Model:
    v = Variable("v", "m/s")
    guide = contact("guide", ExactCoulomb(), v.symbol, 9.81)
    return Model("loaded", x=(v,), ode=1.0 - guide.force, contacts=(guide,))


def forced() -> Model:
    v, t = Variable("v", "m/s"), ca.SX.sym("t")
    guide = contact("guide", ExactCoulomb(), v.symbol, 9.81)
    return Model("forced", x=(v,), t=t, ode=ca.sin(t) - guide.force, contacts=(guide,))


BAD: list[tuple[Callable[[], object], str]] = [
    (lambda: describing_function("lugre", [1.0], [1.0]), "law: expected a law"),  # pyright: ignore
    (lambda: describing_function(LuGre(), [0.0], [1.0]), "amplitudes: expected amplitudes > 0"),
    (lambda: describing_function(LuGre(), [], [1.0]), "got 'none'"),
    (lambda: describing_function(LuGre(), [1.0], [-2.0]), "expected frequencies > 0"),
    (lambda: describing_function(LuGre(), [1.0], [1.0], N=-1.0), "N: expected"),
    (lambda: describing_function(LuGre(), [1.0], [1.0], N=0.0), "at N = 0 N, V = 1 m/s"),
    (lambda: describing_function(Wojewoda(), [1.0], [1.0]), "without the inputs dv"),
    (lambda: harmonic_balance(forced(), (0.1, 1.0), (1.0, 9.0)), "without explicit time"),
    (lambda: harmonic_balance(loaded(), (0.1, 1.0), (1.0, 9.0)), "rests without friction force"),
    (lambda: harmonic_balance(rabinowicz(LuGre()), (1.0, 0.1), (1.0, 9.0)), "0 < low < high"),
    (lambda: harmonic_balance(rabinowicz(LuGre()), (0.1, 1.0), (1.0, 9.0)), "rests without"),
    (lambda: harmonic_balance(drive(LuGre()), (0.1, 1.0), (1.0, 9.0), u={"f": 1.0}), "force"),
]  # fmt: skip


def test_bad_input_is_one_sentence() -> None:
    for call, message in BAD:
        with pytest.raises(ValueError, match=message):
            call()
