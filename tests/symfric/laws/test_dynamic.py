"""Properties of laws with states: steady sliding, dissipation, types of the states."""

from collections.abc import Callable
from itertools import product
from math import asinh, log

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import stribeck_curve
from rigs import prescribed_motion, through
from scipy.integrate import solve_ivp

import symfric as sf
from symfric.scenes import FourMass, Pendulum, PendulumBox

N = 7.848
YIELDS = [0.2e-6, 0.5e-6, 1.0e-6, 1.6e-6]
CURVE = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78}
"""Levels and yield points [m] of elements in the published comparison of Leuven and GMS."""
SLIDERS = tuple(sf.Slider(0.25 * 1.05 / x, 0.25 * 1.05 * 1.0001) for x in YIELDS)
ELEMENTS = tuple(sf.Element(0.25 * 1.05 / x, 0.25) for x in YIELDS)


def published(v: float, sigma_2: float = 0.0) -> float:
    return stribeck_curve(v, 1.0, 1.05, 0.2, 98e-6, 0.78, sigma_2)


def curve(v: float, delta: float = 2.0) -> float:
    return stribeck_curve(v, N, 0.15, 0.1, 1e-3, delta, 0.4)


SLOW = (5e-6, -5e-6, 2e-4, -2e-4)
ENDS: list[tuple[sf.Law, float, tuple[float, ...], float, Callable[[float], float], float]] = [
    *(
        (sf.LuGre(delta=d, sigma_2=0.4), N, (-0.2, -1e-3, 1e-5, 0.05), 5e-4,
         lambda v, d=d: curve(v, d), 1e-6 if d == 2.0 else 1e-4)
        for d in (0.78, 1.0, 2.0)
    ),
    *(
        (sf.ElastoPlastic(sigma_2=0.4, v_eps=w), N, (-0.2, 5e-4, 0.05), 1e-3, curve, 1e-6)
        for w in (1e-9, 0.0)
    ),
    (sf.Leuven(SLIDERS, **CURVE, sigma_1=0.08), 1.0, SLOW, 2e-5, published, 1e-3),
    *(
        (sf.GMS(ELEMENTS, **CURVE, sigma_2=100.0, form=form), 1.0, SLOW, 1e-4,
         lambda v: published(v, 100.0), 2e-4)
        for form in ("smooth", "event")
    ),
    *(
        (sf.HaessigFriedland(form=form), 10.0, (1e-4, -1e-4), 1e-4, np.sign, 1e-6)
        for form in ("smooth", "event")
    ),
    (
        sf.Armstrong(sigma_2=0.4), 8.0, (2e-3, -2e-3, 0.05), 4e-3,
        lambda v: np.sign(v) * 8 * (0.1 + 0.01 / (1 + (v / 1e-3) ** 2)) + 0.4 * v, 1e-6,
    ),
    (
        sf.BoucWen(A=2.0, beta=0.9, gamma=0.1, n=3.0), N, (-1e-4,), 1e-4,
        lambda v: -0.7848 * 2.0 ** (1 / 3), 1e-8,
    ),
]  # fmt: skip
"""Law, load [N], velocities [m/s], path [m], force at its end [N] and its error."""


def test_long_sliding_ends_on_the_steady_curve() -> None:
    for law, load, speeds, path, expected, error in ENDS:
        model = prescribed_motion(law, load, lambda t: ca.SX(1.0))
        for v in speeds:
            t_end = max(path / abs(v), 2.0 if isinstance(law, sf.Armstrong) else 0.0)
            run = sf.simulate(model, t_end, p={"scale": v}, rtol=1e-8, samples=2)
            assert run.final["friction"] == pytest.approx(expected(v), rel=error), (law, v)


GMS_CYCLE = [sf.GMS(ELEMENTS, **CURVE, form=form) for form in ("smooth", "event")]
CYCLES: list[tuple[sf.Law, float, tuple[float, ...]]] = [
    *((sf.Dahl(n=n), N, (1e-6, 1e-4)) for n in (0.5, 1.0, 2.0)),
    (sf.LuGre(), N, (2e-6, 5e-3)),
    (sf.BlimanSorine(), N, (3e-5,)),
    *((sf.BoucWen(gamma=gamma), N, (1e-6, 3e-5)) for gamma in (-0.4, 0.0, 0.5)),
    *((sf.MaxwellSlip(n=n), 10.0, (3e-5,)) for n in (2.0, 100.0)),
    (sf.Leuven(SLIDERS, **CURVE, sigma_1=0.08), 1.0, (3e-6,)),
    *((law, 1.0, (1e-6, 3e-5)) for law in GMS_CYCLE),
]
"""Law, load [N], amplitudes [m] of a motion to and fro."""


def stored(law: sf.Law, z: np.ndarray) -> float:
    """Return the energy of the springs of a law, up to a factor near one."""
    if isinstance(law, sf.Dahl | sf.LuGre):
        return float(0.5 * 1e5 * z[0] ** 2)
    if isinstance(law, sf.BoucWen):
        return float(0.7848 * 7.848e-6 * z[0] ** 2 / 2)
    elements = getattr(law, "elements", ())
    return float(sum(F**2 / (2 * e.k) for F, e in zip(z, elements, strict=False)))


def test_settled_cycles_dissipate() -> None:
    for law, load, amplitudes in CYCLES:
        model = prescribed_motion(law, load, through([0.0, 1.0, -1.0, 1.0, -1.0, 1.0], 0.25))
        for A in amplitudes:
            run = sf.simulate(model, 1.25, p={"scale": A}, t_eval=[0.75, 1.25], rtol=1e-8)
            work = run["work"][1] - run["work"][0]
            states = np.array([run[s.name] for s in law.states])
            gained = stored(law, states[:, 1]) - stored(law, states[:, 0])
            assert work > max(gained, 0.0), (law, A)
            level = float(law.static_level(load))
            assert work < 4 * A * level * 1.01, (law, A)
            assert abs(gained) < 0.1 * work + 1e-9 * A * level, (law, A)


def test_contact_at_rest_keeps_its_states() -> None:
    for law in (sf.Dahl(), sf.Dahl(v_eps=0.0), sf.LuGre(), sf.LuGre(v_eps=0.0), *GMS_CYCLE):
        z = 0.6 * np.asarray(law.steady_state(2e-4, N))
        assert np.abs(np.asarray(law.rate(0.0, N, z))[:4]).max() == 0.0, law


def test_states_have_the_number_of_the_law() -> None:
    for kind in sf.ALL_LAWS.values():
        law = kind()
        with pytest.raises(ValueError, match=f"{kind.__name__}: expected "):
            law.force(0.1, 7.8, np.zeros(len(law.states) + 1))
        z = list(np.ravel(law.steady_state(0.1, 7.8)))
        assert np.isfinite(float(law.force(0.1, 7.8, z))), kind
    assert sf.GMS(elements=[sf.Element()]).elements[0].k == 1e5  # type: ignore[arg-type]


def test_states_are_numbers_lists_arrays_or_matrices() -> None:
    law = sf.LuGre()

    def by_hand(v: float, z: float) -> float:
        g = 7.8 * (law.mu_d + (law.mu_s - law.mu_d) * np.exp(-((v / law.v_s) ** 2)))
        rate = v - law.sigma_0 * abs(v) * z / g
        return float(law.sigma_0 * z + law.sigma_1 * rate + law.sigma_2 * v)

    wanted = by_hand(0.1, 1e-5)
    one = (1e-5, np.float64(1e-5), np.array(1e-5), [1e-5], (1e-5,), np.array([1e-5]), ca.DM(1e-5))
    for z in one:
        assert float(law.force(0.1, 7.8, z)) == pytest.approx(wanted, rel=1e-12)
        assert float(law.rate(0.1, 7.8, z)[0]) == pytest.approx(
            (wanted - law.sigma_0 * 1e-5) / law.sigma_1, rel=1e-9
        )
    v, z = np.linspace(0.01, 0.1, 5), np.linspace(0.0, 1e-5, 5)
    many = [by_hand(a, b) for a, b in zip(v, z, strict=True)]
    np.testing.assert_allclose(law.force(v, 7.8, z), many, rtol=1e-12)
    np.testing.assert_allclose(law.force(v, 7.8, z[None]), many, rtol=1e-12)


def test_stick_slip_law_holds_loads_and_slips_at_its_velocity_law() -> None:
    law, level = sf.StickSlip(), 0.15 * N
    for D, v in product(np.linspace(-1.5e-6, 1.5e-6, 5), (1e-3, 1.5e-3, 2e-3, 0.1)):
        expected = level if v <= 1e-3 else 0.1 * N
        F = [float(law.force(s * v, N, np.array([D]))) for s in (1, -1)]
        assert [expected, -expected] == pytest.approx(F, rel=1e-12)
    v, full = np.linspace(1e-5, 1e-3, 101), np.full((1, 101), 1e-6)
    published, plateau = (
        sf.StickSlip(branch=b).force(v, N, full) for b in ("published", "plateau")
    )
    assert published.min() < 0.9 * level
    assert plateau == pytest.approx(level, rel=1e-12)
    assert law.rate(0.1, N, np.array([1e-6]))[0] == pytest.approx(-0.1), "forgotten in slip"
    assert law.rate(1e-5, N, np.array([0.0]))[0] == pytest.approx(1e-5, rel=1e-4)
    for share, branch in ((0.5, "plateau"), (0.99, "published")):
        # the spring at rest is undamped: load within many periods of 4 ms
        pull = lambda t, s=share: ca.fmin(2 * t, 1) ** 2 * (3 - 2 * ca.fmin(2 * t, 1)) * s * level  # noqa: E731
        run = sf.simulate(sf.drive(sf.StickSlip(branch=branch)), 0.8, u={"force": pull}, rtol=1e-6)
        assert abs(run.final["x"]) < 2e-6
        assert np.abs(run["v"]).max() < 3e-4
    run = sf.simulate(sf.drive(law), 0.5, u={"force": 1.05 * level})
    assert run.final["v"] > 0.1


def test_nominal_value_of_a_state_is_a_number() -> None:
    with pytest.raises(
        ValueError, match="expected a number > 0, got the expression v_s; parameters are symbols"
    ):
        sf.State("w", "m/s", ca.SX.sym("v_s"))  # pyright: ignore[reportArgumentType]


LOAD = 8.0


def test_dwell_follows_its_closed_form() -> None:
    model, t = (
        prescribed_motion(sf.Armstrong(), N, lambda t: ca.SX(0.0)),
        np.array([0.05, 0.2, 1.0]),
    )
    run = sf.simulate(model, 1.0, x0={"q": 0.0}, rtol=1e-10, t_eval=t)
    assert run["q"] == pytest.approx(t / (t + 0.2), rel=1e-7)


def test_force_after_a_step_of_velocity_follows_the_filtered_one() -> None:
    """The lag is that of a first-order filter on the velocity in the Stribeck term."""
    law = sf.Armstrong(mu_a=0.05, mu_inf=0.05, k_t=1e8)
    jump = lambda t: ca.if_else(t < 1.0, ca.SX(1e-3), 5e-3)  # noqa: E731
    run = sf.simulate(
        prescribed_motion(law, LOAD, jump), 1.1, rtol=1e-9, t_eval=[0.999, 1.01, 1.03]
    )
    w = 5e-3 + (1e-3 - 5e-3) * np.exp(-np.array([0.01, 0.03]) / 0.02)
    expected = LOAD * (0.1 + 0.05 / (1 + (w / 1e-3) ** 2))
    assert run["friction"][0] == pytest.approx(LOAD * 0.125, rel=1e-6)
    assert run["friction"][1:] == pytest.approx(expected, rel=2e-3)


def break_away(rest: float) -> float:
    """Peak of the friction after a rest of the given duration, pulled up within 20 ms."""
    pull = {"force": lambda t: ca.fmin(ca.fmax((t - rest) / 0.02, 0), 1) * 2}
    run = sf.simulate(
        sf.drive(sf.Armstrong(), N=LOAD), rest + 0.05, u=pull, x0={"q": 0.0}, rtol=1e-8
    )
    return float(run["friction"].max())


def test_break_away_grows_with_the_rest() -> None:
    peaks = [break_away(rest) for rest in (0.02, 0.2, 2.0)]
    assert (np.diff(peaks) > 0.02).all()
    assert peaks[0] > LOAD * 0.105
    assert peaks[-1] < LOAD * 0.15


ROCK = {"mu_0": 0.6, "a": 0.005, "b": 0.01, "v_0": 1e-6, "D_c": 1e-5}


@given(e=st.floats(-9.0, -1.0), sign=st.sampled_from([1.0, -1.0]))
def test_steady_force_falls_with_the_logarithm_of_the_velocity(e: float, sign: float) -> None:
    law, v = sf.RateAndState(**ROCK), sign * 10.0**e
    force = law.force(v, 2.0, law.steady_state(v, 2.0))
    assert force == pytest.approx(sign * 2.0 * (0.6 - 0.005 * log(abs(v) / 1e-6)), abs=1e-7)


@pytest.mark.parametrize("evolution", ["ageing", "slip"])
def test_velocity_step_raises_by_a_and_settles_by_b(evolution: str) -> None:
    law = sf.RateAndState(**ROCK, evolution=evolution)
    before = law.steady_state(1e-6, 1.0)
    jump = law.force(1e-5, 1.0, before) - law.force(1e-6, 1.0, before)
    assert jump == pytest.approx(0.011513, abs=5e-7)
    model = prescribed_motion(law, 1.0, lambda t: ca.SX(1e-5))
    run = sf.simulate(model, 50.0, x0={"psi": float(before[0])}, rtol=1e-9)
    assert run["friction"][0] == pytest.approx(0.611513, abs=5e-7)
    assert run.final["friction"] == pytest.approx(0.588487, abs=5e-7)


def test_ageing_and_slip_evolution_relax_as_their_closed_forms() -> None:
    """theta = D_c/v + (theta_0 - D_c/v) exp(-v t/D_c);  ln(v theta/D_c) ~ exp(-v t/D_c)."""
    t, v = 0.7, 1e-5
    decay = np.exp(-v * t / 1e-5)
    expected = {"ageing": log(0.1 * (1 + 9 * decay)), "slip": log(0.1) + log(10) * decay}
    for evolution, psi in expected.items():
        law = sf.RateAndState(**ROCK, evolution=evolution)
        model = prescribed_motion(law, 1.0, lambda t: ca.SX(v))
        run = sf.simulate(model, t, x0={"psi": 0.0}, rtol=1e-10)
        assert run.final["psi"] == pytest.approx(psi, rel=1e-7)


def test_rest_heals_with_the_logarithm_of_time_in_the_ageing_law_only() -> None:
    for evolution, healed in (("ageing", log(1 + 100.0 / 10.0)), ("slip", 0.0)):
        law = sf.RateAndState(**ROCK, evolution=evolution)
        model = prescribed_motion(law, 1.0, lambda t: ca.SX(0.0))
        run = sf.simulate(model, 100.0, x0={"psi": 0.0}, rtol=1e-10)
        assert run.final["psi"] == pytest.approx(healed, abs=1e-3)


@given(v=st.floats(-1e-3, 1e-3), psi=st.floats(-5.0, 5.0))
def test_regularised_form_is_odd_and_agrees_with_the_logarithm(v: float, psi: float) -> None:
    law, z = sf.RateAndState(**ROCK), np.array([psi])
    assert law.force(-v, 1.0, z) == -law.force(v, 1.0, z)
    if abs(v) > 1e-12:
        expected = 0.6 + 0.005 * log(abs(v) / 1e-6) + 0.01 * psi
        assert abs(law.force(v, 1.0, z)) == pytest.approx(expected, abs=1e-12)


def test_creep_under_load_is_that_of_an_independent_integrator() -> None:
    """0.8 kg pulled with 0.9 of its steady strength, for ten seconds."""
    law = sf.RateAndState(mu_0=0.12, a=0.005, b=0.01)
    pull = 0.9 * 0.12 * N

    def rates(t: float, y: np.ndarray) -> list[float]:
        _, v, psi = y
        mu = 0.005 * asinh(v / 2e-6 * np.exp((0.12 + 0.01 * psi) / 0.005))
        return [v, (pull - N * mu) / 0.8, 0.1 * (np.exp(-psi) - abs(v) / 1e-6)]

    other = solve_ivp(rates, (0, 10), [0, 0, 0], "Radau", rtol=1e-10, atol=[1e-16, 1e-16, 1e-10])
    run = sf.simulate(sf.drive(law), 10.0, x0={"psi": 0.0}, u={"force": pull}, rtol=1e-10)
    assert run.final["x"] == pytest.approx(other.y[0, -1], rel=1e-4)
    assert 0 < run.final["x"] < 1e-5


def test_machines_that_are_let_go_from_rest_run_with_defaults() -> None:
    """They stopped at once: the start was an age of months, with a slope of 1e25 N s/m at rest."""
    for scene in (Pendulum, PendulumBox, FourMass):
        run = sf.simulate(scene(sf.RateAndState()).model(), 0.2, samples=2, backend="vm")
        assert run.status.ok, scene
    assert sf.RateAndState().steady_state(0.0, 1.0)[0] == 0.0
    assert sf.RateAndState().steady_state(-1e-9, 1.0)[0] == pytest.approx(np.log(1e3))
