"""What laws with states share: steady sliding, dissipation, states as people give them."""

from collections.abc import Callable
from itertools import product

import casadi as ca
import numpy as np
import pytest
from oracles import stribeck_curve
from rigs import prescribed_motion, through

from symfric import Dahl, Law, LuGre, drive, simulate
from symfric.laws import (
    ALL_LAWS,
    GMS,
    Armstrong,
    BlimanSorine,
    BoucWen,
    ElastoPlastic,
    Element,
    HaessigFriedland,
    Leuven,
    MaxwellSlip,
    Slider,
    State,
    StickSlip,
)

N = 7.848
YIELDS = [0.2e-6, 0.5e-6, 1.0e-6, 1.6e-6]
CURVE = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98e-6, "delta": 0.78}
"""Levels and yield points [m] of elements in the published comparison of Leuven and GMS."""
SLIDERS = tuple(Slider(0.25 * 1.05 / x, 0.25 * 1.05 * 1.0001) for x in YIELDS)
ELEMENTS = tuple(Element(0.25 * 1.05 / x, 0.25) for x in YIELDS)


def published(v: float, sigma_2: float = 0.0) -> float:
    return stribeck_curve(v, 1.0, 1.05, 0.2, 98e-6, 0.78, sigma_2)


def curve(v: float, delta: float = 2.0) -> float:
    return stribeck_curve(v, N, 0.15, 0.1, 1e-3, delta, 0.4)


SLOW = (5e-6, -5e-6, 2e-4, -2e-4)
ENDS: list[tuple[Law, float, tuple[float, ...], float, Callable[[float], float], float]] = [
    *(
        (LuGre(delta=d, sigma_2=0.4), N, (-0.2, -1e-3, 1e-5, 0.05), 5e-4,
         lambda v, d=d: curve(v, d), 1e-6 if d == 2.0 else 1e-4)
        for d in (0.78, 1.0, 2.0)
    ),
    *(
        (ElastoPlastic(sigma_2=0.4, v_eps=w), N, (-0.2, 5e-4, 0.05), 1e-3, curve, 1e-6)
        for w in (1e-9, 0.0)
    ),
    (Leuven(SLIDERS, **CURVE, sigma_1=0.08), 1.0, SLOW, 2e-5, published, 1e-3),
    *(
        (GMS(ELEMENTS, **CURVE, sigma_2=100.0, form=form), 1.0, SLOW, 1e-4,
         lambda v: published(v, 100.0), 2e-4)
        for form in ("smooth", "event")
    ),
    *(
        (HaessigFriedland(form=form), 10.0, (1e-4, -1e-4), 1e-4, np.sign, 1e-6)
        for form in ("smooth", "event")
    ),
    (
        Armstrong(sigma_2=0.4), 8.0, (2e-3, -2e-3, 0.05), 4e-3,
        lambda v: np.sign(v) * 8 * (0.1 + 0.01 / (1 + (v / 1e-3) ** 2)) + 0.4 * v, 1e-6,
    ),
    (
        BoucWen(A=2.0, beta=0.9, gamma=0.1, n=3.0), N, (-1e-4,), 1e-4,
        lambda v: -0.7848 * 2.0 ** (1 / 3), 1e-8,
    ),
]  # fmt: skip
"""Law, load [N], velocities [m/s], path [m], force at its end [N] and its error."""


def test_long_sliding_ends_on_the_steady_curve() -> None:
    for law, load, speeds, path, expected, error in ENDS:
        model = prescribed_motion(law, load, lambda t: ca.SX(1.0))
        for v in speeds:
            t_end = max(path / abs(v), 2.0 if isinstance(law, Armstrong) else 0.0)
            run = simulate(model, t_end, p={"scale": v}, rtol=1e-8, samples=2)
            assert run.final["friction"] == pytest.approx(expected(v), rel=error), (law, v)


GMS_CYCLE = [GMS(ELEMENTS, **CURVE, form=form) for form in ("smooth", "event")]
CYCLES: list[tuple[Law, float, tuple[float, ...]]] = [
    *((Dahl(n=n), N, (1e-6, 1e-4)) for n in (0.5, 1.0, 2.0)),
    (LuGre(), N, (2e-6, 5e-3)),
    (BlimanSorine(), N, (3e-5,)),
    *((BoucWen(gamma=gamma), N, (1e-6, 3e-5)) for gamma in (-0.4, 0.0, 0.5)),
    *((MaxwellSlip(n=n), 10.0, (3e-5,)) for n in (2.0, 100.0)),
    (Leuven(SLIDERS, **CURVE, sigma_1=0.08), 1.0, (3e-6,)),
    *((law, 1.0, (1e-6, 3e-5)) for law in GMS_CYCLE),
]
"""Law, load [N], amplitudes [m] of a motion to and fro."""


def stored(law: Law, z: np.ndarray) -> float:
    """Return the energy of the springs of a law, up to a factor near one."""
    if isinstance(law, Dahl | LuGre):
        return float(0.5 * 1e5 * z[0] ** 2)
    if isinstance(law, BoucWen):
        return float(0.7848 * 7.848e-6 * z[0] ** 2 / 2)
    elements = getattr(law, "elements", ())
    return float(sum(F**2 / (2 * e.k) for F, e in zip(z, elements, strict=False)))


def test_settled_cycles_dissipate() -> None:
    for law, load, amplitudes in CYCLES:
        model = prescribed_motion(law, load, through([0.0, 1.0, -1.0, 1.0, -1.0, 1.0], 0.25))
        for A in amplitudes:
            run = simulate(model, 1.25, p={"scale": A}, t_eval=[0.75, 1.25], rtol=1e-8)
            work = run["work"][1] - run["work"][0]
            states = np.array([run[s.name] for s in law.states])
            gained = stored(law, states[:, 1]) - stored(law, states[:, 0])
            assert work > max(gained, 0.0), (law, A)
            level = float(law.static_level(load))
            assert work < 4 * A * level * 1.01, (law, A)
            assert abs(gained) < 0.1 * work + 1e-9 * A * level, (law, A)


def test_contact_at_rest_keeps_its_states() -> None:
    for law in (Dahl(), Dahl(v_eps=0.0), LuGre(), LuGre(v_eps=0.0), *GMS_CYCLE):
        z = 0.6 * np.asarray(law.steady_state(2e-4, N))
        assert np.abs(np.asarray(law.rate(0.0, N, z))[:4]).max() == 0.0, law


def test_states_have_the_number_of_the_law() -> None:
    for kind in ALL_LAWS.values():
        law = kind()
        with pytest.raises(ValueError, match=f"{kind.__name__}: expected "):
            law.force(0.1, 7.8, np.zeros(len(law.states) + 1))
        z = list(np.ravel(law.steady_state(0.1, 7.8)))
        assert np.isfinite(float(law.force(0.1, 7.8, z))), kind
    assert GMS(elements=[Element()]).elements[0].k == 1e5  # type: ignore[arg-type]


def test_states_are_numbers_lists_arrays_or_matrices() -> None:
    law = LuGre()

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
    law, level = StickSlip(), 0.15 * N
    for D, v in product(np.linspace(-1.5e-6, 1.5e-6, 5), (1e-3, 1.5e-3, 2e-3, 0.1)):
        expected = level if v <= 1e-3 else 0.1 * N
        F = [float(law.force(s * v, N, np.array([D]))) for s in (1, -1)]
        assert [expected, -expected] == pytest.approx(F, rel=1e-12)
    v, full = np.linspace(1e-5, 1e-3, 101), np.full((1, 101), 1e-6)
    published, plateau = (StickSlip(branch=b).force(v, N, full) for b in ("published", "plateau"))
    assert published.min() < 0.9 * level
    assert plateau == pytest.approx(level, rel=1e-12)
    assert law.rate(0.1, N, np.array([1e-6]))[0] == pytest.approx(-0.1), "forgotten in slip"
    assert law.rate(1e-5, N, np.array([0.0]))[0] == pytest.approx(1e-5, rel=1e-4)
    for share, branch in ((0.5, "plateau"), (0.99, "published")):
        # the spring at rest is undamped: load within many periods of 4 ms
        pull = lambda t, s=share: ca.fmin(2 * t, 1) ** 2 * (3 - 2 * ca.fmin(2 * t, 1)) * s * level  # noqa: E731
        run = simulate(drive(StickSlip(branch=branch)), 0.8, u={"force": pull}, rtol=1e-6)
        assert abs(run.final["x"]) < 2e-6
        assert np.abs(run["v"]).max() < 3e-4
    run = simulate(drive(law), 0.5, u={"force": 1.05 * level})
    assert run.final["v"] > 0.1


def test_nominal_value_of_a_state_is_a_number() -> None:
    with pytest.raises(
        ValueError, match="expected a number > 0, got the expression v_s; parameters are symbols"
    ):
        State("w", "m/s", ca.SX.sym("v_s"))  # pyright: ignore[reportArgumentType]
