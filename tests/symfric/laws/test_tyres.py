"""Tyres against bristles that are integrated over the contact, and closed forms."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import symfric as sf
from identification import Dataset, Fit, Points

TYRES = [(1.0, 8e4, 4e3), (0.3, 500.0, 20.0), (1.7, 2e6, 3e5)]
"""Friction coefficient, cornering stiffness [N] and load [N], from a toy to an aircraft."""


@pytest.mark.parametrize(("mu", "C", "N"), TYRES)
def test_brush_tyre_is_the_integral_of_its_bristles(mu: float, C: float, N: float) -> None:
    """Bristles deflect by (a - x) tan(alpha) until the pressure cannot hold them."""
    law, a = sf.BrushTyre(mu, C, v_eps=1e-9), 0.07

    def stress(x: float, slip: float) -> float:
        pressure = 3 * N / (4 * a) * (1 - (x / a) ** 2)
        return min(C / (2 * a * a) * (a - x) * slip, mu * pressure)

    full = 3 * mu * N / C
    for share, v_r in ((1e-3, 30.0), (0.2, 0.5), (0.7, 30.0), (0.99, 8.0), (1.5, 30.0)):
        slip = share * full
        adheres = a * (2 * min(share, 1.0) - 1)
        expected = quad(stress, -a, a, (slip,), points=[adheres], epsabs=1e-12 * N)[0]
        assert law.force(v_r * slip, N, v_r=v_r) == pytest.approx(expected, rel=1e-9)
        assert law.force(-v_r * slip, N, v_r=-v_r) == pytest.approx(-expected, rel=1e-9)


def test_slope_and_limit_over_the_slip_angle() -> None:
    law = sf.BrushTyre(0.9, 6e4)
    alpha = 1e-7
    found = float(law.force(20.0 * np.tan(alpha), 3e3, v_r=20.0))
    assert found == pytest.approx(6e4 * alpha, rel=1e-4)
    assert law.force(5.0, 3e3, v_r=20.0) == pytest.approx(2700.0)
    assert law.force(-0.5, 3e3) == pytest.approx(-2700.0)  # a locked wheel


@pytest.mark.parametrize(("mu", "C", "N"), TYRES)
def test_combined_slip_acts_along_the_slip(mu: float, C: float, N: float) -> None:
    tyre, v_r = sf.PlanarSlip(sf.BrushTyre(mu, C, v_eps=1e-9)), np.array([12.0, 0.0])
    for share, angle in ((1e-3, 0.3), (0.5, 2.0), (0.9, -1.0), (2.0, -2.5)):
        way = np.array([np.cos(angle), np.sin(angle)])
        expected = mu * N * (1 - (1 - min(share, 1.0)) ** 3) * way
        found = tyre.force(share * 3 * mu * N / C * 12.0 * way, N, v_r=v_r)
        assert np.ravel(found) == pytest.approx(expected, rel=1e-9)


def steady(law: sf.LuGreTyre, v: float, N: float, v_r: float) -> float:
    """Return the force after long rolling, from the equations of the law."""

    def rate(_: float, z: np.ndarray) -> np.ndarray:
        return np.ravel(law.rate(v, N, z, v_r=v_r))

    found = solve_ivp(rate, (0.0, 1.5), [0.0], method="LSODA", rtol=1e-10, atol=1e-14)
    return float(law.force(v, N, found.y[:, -1], v_r=v_r))


def test_lugre_tyre_tends_to_its_closed_form_in_steady_rolling() -> None:
    for law in (sf.LuGreTyre(), sf.LuGreTyre(mu_s=0.5, mu_d=0.3, sigma_0=40.0, sigma_2=0.01)):
        for v, v_r in ((0.02, 10.0), (-1.0, 10.0), (8.0, 25.0), (0.3, 0.0), (-4.0, -3.0)):
            fall = np.exp(-((v / law.v_s) ** law.delta))
            g = law.mu_d + (law.mu_s - law.mu_d) * fall
            z = v / (law.sigma_0 * abs(v) / g + law.kappa * abs(v_r))
            expected = 3e3 * (law.sigma_0 * z + law.sigma_2 * v)
            assert steady(law, v, 3e3, v_r) == pytest.approx(expected, rel=1e-7)
            for one in (law, sf.Sum((law, sf.Coulomb(0.0)))):
                rests = np.ravel(one.steady_state_at(v, 3e3, v_r=v_r))
                assert one.rate(v, 3e3, rests, v_r=v_r) == pytest.approx(0.0, abs=1e-12)
                assert one.force(v, 3e3, rests, v_r=v_r) == pytest.approx(expected, rel=1e-12)


def test_lumped_tyre_is_near_the_distributed_one() -> None:
    """Bristles enter undeflected and obey v_r dz/dx = v - sigma_0 |v| z / g over the length L.

    With kappa = 2/L the stiffness at small slip is that of the mean over the contact.
    """
    L, v_r, N = 0.2, 15.0, 4e3
    law = sf.LuGreTyre(mu_s=0.9, mu_d=0.9, kappa=2 / L)
    for slip, most in ((1e-4, 1e-3), (0.02, 0.1), (0.1, 0.2), (1.0, 0.1), (10.0, 0.02)):
        v = slip * v_r
        decay = 0.9 * v_r / (law.sigma_0 * v)
        mean = 0.9 * (1 - decay / L * (1 - np.exp(-L / decay)))
        assert steady(law, v, N, v_r) == pytest.approx(N * mean, rel=most)


def test_a_locked_wheel_is_normalised_lugre() -> None:
    tyre = sf.LuGreTyre()
    names = ("mu_s", "mu_d", "v_s", "sigma_0", "sigma_1")
    plain = sf.LuGreNormalised(**{n: getattr(tyre, n) for n in names})
    for v, z in ((0.3, 1e-3), (-2.0, 4e-3)):
        assert tyre.rate(v, 5.0, [z]) == pytest.approx(np.ravel(plain.rate(v, 5.0, [z])))
        assert tyre.force(v, 5.0, [z]) == pytest.approx(float(plain.force(v, 5.0, [z])))


def test_a_braked_car_decelerates_at_the_slip_of_the_closed_form() -> None:
    """The brake torque turns into the force of the tyre and into the inertia of the wheel."""
    m, J, r, torque = 400.0, 1.5, 0.3, 300.0
    N, F = m * 9.81, torque / (r + J / (m * r))
    for law in (sf.LuGreTyre(), sf.BrushTyre(mu_d=0.9)):
        u, w = sf.Variable("u", "m/s", start=20.0), sf.Variable("w", "m/s", start=20.0)
        tyre = sf.Contact("tyre", u.symbol - w.symbol, N, law, {"v_r": w.symbol})
        spin = r * (r * tyre.force - torque) / J
        car = sf.Model("car", x=(u, w), ode=ca.vertcat(-tyre.force / m, spin), contacts=(tyre,))
        run = sf.simulate(car, 2.0, rtol=1e-8)
        assert run.final["u"] == pytest.approx(20.0 - F / m * 2.0, abs=0.02)
        slip = (run.final["u"] - run.final["w"]) / run.final["w"]
        if isinstance(law, sf.BrushTyre):
            expected = 3 * 0.9 * N / law.C * (1 - (1 - F / (0.9 * N)) ** (1 / 3))
            assert slip == pytest.approx(expected, rel=1e-3)
        else:
            assert pytest.approx(steady(law, slip * 16.0, N, 16.0), rel=0.02) == F


def test_points_of_a_rolling_tyre_determine_its_parameters() -> None:
    true = {"mu_s": 1.1, "mu_d": 0.7, "v_s": 4.0, "kappa": 7.0}
    v, v_r = np.linspace(-6.0, 6.0, 240), np.tile([8.0, 20.0], 120)
    g = 0.7 + 0.4 * np.exp(-((v / 4.0) ** 2))
    noise = 1 + 0.01 * np.random.default_rng(0).standard_normal(v.size)
    F = 180.0 * v / (180.0 * np.abs(v) / g + 7.0 * v_r) * noise
    data = Dataset.of(v=v, F=F, v_r=v_r, points=True)
    fit = Fit(Points(), sf.LuGreTyre(), data, free=["kappa"], fixed={"sigma_2": 0.0}).solve()
    for name, value in true.items():
        found = fit.parameters[name]
        assert found.standard_error is not None
        assert abs(found.value - value) < 3 * found.standard_error
    assert fit.curve is not None
    assert fit.curve.says == "measured points, line at v_r = 0 m/s"
    at_rest = Dataset.of(
        v=np.append(v, 0.0), F=np.append(F, 0.0), v_r=np.append(v_r, 9.0), points=True
    )
    with pytest.raises(ValueError, match=r"break-away at v = 0: .* rolling tyre does not jump"):
        Fit(Points(), sf.LuGreTyre(), at_rest).solve()
