"""Slip in a plane and in space: every isotropic law as vectors, refusals by reason."""

from functools import cache
from itertools import product
from math import cos, pi, sin

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, EXAMPLE_INPUTS

import symfric as sf
from symfric.laws.composed.isotropic import Isotropic, anisotropy

pytestmark = pytest.mark.heavy

N = 7.848
SUMS: dict[str, sf.Law] = {
    "lugre+ambrosio": sf.Sum((sf.LuGre(), sf.Ambrosio())),
    "lagged(ambrosio)": sf.Lagged(sf.Ambrosio()),
    "dahl+gms+viscous": sf.Sum((sf.Dahl(n=1.5), sf.GMS(), sf.Viscous())),
}
LAWS = {name: law for name, law in (CASES | SUMS).items() if not anisotropy(law)}
DYNAMIC = [name for name, law in LAWS.items() if law.states and "," not in name]
"""Dynamic laws without their variants; runs along a path take `SOME` of them."""
SOME = ("lugre", "gms", "bouc_wen", "leuven", "elasto_plastic", "dahl+gms+viscous")
RNG = np.random.default_rng(5)


def turn(angle: float) -> np.ndarray:
    return np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])


def directed(law: sf.Law) -> list[bool]:
    return [not state.even for state in law.states]


def bent(law: Isotropic, *directions: np.ndarray) -> np.ndarray:
    """States of a size that sliding gives, the k-th vector along the k-th direction, cyclic."""
    odd, typical = directed(law.law), np.asarray(law.law.steady_state(1.0, N)).ravel()
    sizes = typical[odd]
    vectors = np.array([s * directions[k % len(directions)] for k, s in enumerate(sizes)])
    return np.concatenate([vectors.T.ravel(), 0.7 * typical[[not x for x in odd]]])


def given_inputs(law: sf.Law, direction: np.ndarray) -> dict[str, np.ndarray]:
    return {i.name: EXAMPLE_INPUTS[i.name] * direction for i in law.inputs}


def turned(law: Isotropic, R: np.ndarray, z: np.ndarray) -> np.ndarray:
    n = sum(directed(law.law))
    vectors = z[: n * len(R)].reshape(len(R), n)
    return np.concatenate([(R @ vectors).ravel(), z[n * len(R) :]])


def test_turned_slip_turns_force_and_rate() -> None:
    for name, scale in product(LAWS, (1.0, 1e-4)):
        v, a, b = RNG.uniform(-1.0, 1.0, (3, 2))
        law, v, R = sf.PlanarSlip(LAWS[name]), scale * v, turn(RNG.uniform(0.0, 2 * pi))
        z = bent(law, a, b)
        w, w_turned = given_inputs(law.law, b), given_inputs(law.law, R @ b)
        F, rate = law.force(v, N, z, **w), law.rate(v, N, z, **w)
        force = law.force(R @ v, N, turned(law, R, z), **w_turned)
        assert force == pytest.approx(R @ F, abs=1e-9 * (np.abs(F).max() + N)), name
        found = law.rate(R @ v, N, turned(law, R, z), **w_turned)
        expected = turned(law, R, np.asarray(rate).ravel())
        error = 1e-9 * (np.abs(expected).max(initial=0.0) + scale)
        assert found == pytest.approx(expected, abs=error), name


STEP, COUNT = 1e-5, 2000


@cache
def steps_of(name: str, axes: int) -> ca.Function:
    """COUNT Runge-Kutta steps (z, [v at 0, h/2, h]) -> (z, F), of the law itself for axes = 0."""
    one = LAWS[name]
    law = {0: one, 2: sf.PlanarSlip(one), 3: sf.SpatialSlip(one)}[axes]
    z, v = ca.SX.sym("z", len(law.states)), ca.SX.sym("v", max(axes, 1), 3)
    both = ca.Function("law", [z, v[:, 0]], [law.rate(v[:, 0], N, z), law.force(v[:, 0], N, z)])
    at = [v[:, k] for k in range(3)]
    k_1, _ = both(z, at[0])
    k_2, _ = both(z + STEP / 2 * k_1, at[1])
    k_3, _ = both(z + STEP / 2 * k_2, at[1])
    k_4, _ = both(z + STEP * k_3, at[2])
    new = z + STEP / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
    _, F = both(new, at[2])
    step = ca.Function("step", [z, ca.vec(v)], [new, F, ca.dot(F, at[2]) * STEP])
    return step.mapaccum(COUNT)


def along_path(name: str, axes: int, z: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, ...]:
    """States, forces and works; v has shape (axes, 2 COUNT + 1)."""
    triples = np.concatenate([v[:, :-2:2], v[:, 1::2], v[:, 2::2]])
    result = steps_of(name, axes)(z, triples)
    return tuple(x.full() for x in result)


def at_rest(law: sf.Law) -> np.ndarray:
    return np.zeros(len(law.states)) + [0.5 if s.even else 0.0 for s in law.states]


TIMES = STEP / 2 * np.arange(2 * COUNT + 1)
REVERSING = 5e-3 * np.sin(2 * pi * 100 * TIMES) + 2e-3 * np.sin(2 * pi * 330 * TIMES)


def test_straight_slip_with_reversals_is_the_law_itself() -> None:
    in_space = product(SOME[:3], ((2 / 3, -1 / 3, 2 / 3),))
    for name, direction in (*product(SOME, ((0.6, -0.8),)), *in_space):
        one, e = LAWS[name], np.array(direction)
        law = sf.PlanarSlip(one) if len(e) == 2 else sf.SpatialSlip(one)
        z, F, _ = along_path(name, 0, at_rest(one), REVERSING[None, :])
        states, forces, _ = along_path(name, len(e), at_rest(law), e[:, None] * REVERSING)
        assert np.isfinite(F).all(), name
        assert np.ptp(F) > 0.1, name
        np.testing.assert_allclose(forces, e[:, None] * F, atol=1e-9 * np.abs(F).max())
        odd = directed(one)
        expected = [*(c * row for c in e for row in z[odd]), *z[[not x for x in odd]]]
        sizes = np.abs(expected).max(axis=1, initial=1e-30)[:, None]
        np.testing.assert_allclose(states / sizes, expected / sizes, atol=1e-9, err_msg=name)


def test_straight_slip_of_a_memoryless_law_is_the_law_itself() -> None:
    for name, v in product([n for n in LAWS if not LAWS[n].states], (0.0, 2e-5, -3e-3, 0.7)):
        one, e = LAWS[name], turn(RNG.uniform(0.0, 2 * pi))[0]
        inputs = {n: x[0] for n, x in given_inputs(one, np.ones(1)).items()}
        found = sf.PlanarSlip(one, v_eps=1e-12).force(v * e, N, **given_inputs(one, e))
        expected = e * one.force(v, N, **inputs)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9), name


ANGLES = 2 * pi * 100 * TIMES


def test_a_closed_circle_takes_energy() -> None:
    """The second of two turns at 100 Hz, of a size below and far above the break-away path."""
    for name, radius in product(SOME, (1e-6, 4e-5)):
        v = 2 * pi * 100 * radius * np.array([np.cos(ANGLES), np.sin(ANGLES)])
        _, F, work = along_path(name, 2, at_rest(sf.PlanarSlip(LAWS[name])), v)
        assert np.isfinite(F).all(), name
        assert work[0, COUNT // 2 :].sum() >= 0.0, name


def limits(law: sf.Law) -> np.ndarray:
    """The largest size of each vector state in straight slip."""
    if isinstance(law, sf.Leuven):
        return np.array([e.mu * N for e in law.elements])
    found = [np.abs(np.asarray(law.steady_state(v, N)).ravel()) for v in np.logspace(-7, 0, 200)]
    return np.max(found, axis=0)[directed(law)]


def test_states_never_leave_the_ball_of_their_limit_in_curved_slip() -> None:
    for name in SOME:
        law = sf.PlanarSlip(LAWS[name])
        speed = 8e-3 * np.abs(np.sin(2 * pi * RNG.uniform(20, 120) * TIMES))
        waves = (RNG.uniform(0, 3) * np.sin(2 * pi * f * TIMES + f) for f in (30.0, 110.0, 270.0))
        angle = sum(waves, start=0.0)
        v = speed * np.array([np.cos(angle), np.sin(angle)])
        z, _, _ = along_path(name, 2, at_rest(law), v)
        n = sum(directed(law.law))
        sizes = np.hypot(z[:n], z[n : 2 * n]).max(axis=1)
        assert (sizes <= limits(law.law) * (1 + 1e-6)).all(), name


def test_value_gradient_and_hessian_are_finite_and_rest_has_no_force() -> None:
    for name in LAWS:
        law, v = sf.PlanarSlip(LAWS[name]), ca.SX.sym("v", 2)
        assert np.abs(law.force((0.0, 0.0), N, at_rest(law))).max() == 0.0, name
        z, w = ca.SX.sym("z", len(law.states)), ca.SX.sym("w", 2)
        inputs = {i.name: EXAMPLE_INPUTS[i.name] * w for i in law.inputs}
        x = ca.vertcat(v, z, w)
        y = ca.vertcat(law.force(v, N, z, **inputs), law.rate(v, N, z, **inputs))
        # a sum is finite only if every term is; the weights keep infinities from cancelling
        hessian, gradient = ca.hessian(ca.dot(y, np.arange(1.0, 1.0 + y.numel())), x)
        derivatives = ca.Function("f", [v, z, w], [y, ca.jacobian(y, x), gradient, hessian])
        for share in (0.0, 1.0):
            bend = bent(law, share * np.array([0.6, 0.8]))
            for slip in ((0.0, 0.0), (1e-300, 0.0), (-1e-12, 1e-12), (1e-9, 0.0), (0.0, 1e3)):
                results = derivatives(slip, bend, 0.1)
                assert all(result.is_regular() for result in results), (name, share, slip)


def test_all_number_types_give_the_same() -> None:
    v, e = np.array([3e-4, -2e-3]), np.array([0.6, 0.8])
    for name in (*SOME, "stribeck"):
        one, law = LAWS[name], sf.PlanarSlip(LAWS[name])
        z, w = bent(law, 0.7 * e, turn(1.0)[0]), given_inputs(one, e)
        expected = np.append(law.force(v, N, z, **w), law.rate(v, N, z, **w))
        for kind in (ca.SX, ca.MX):
            a, s = kind.sym("v", 2), kind.sym("z", z.size)
            rows = ca.vertcat(law.force(a, N, s, **w), law.rate(a, N, s, **w))
            found = ca.Function("f", [a, s], [rows])(v, z).full().ravel()
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14, err_msg=name)
        many = np.tile(v[:, None], (1, 3)), N, np.tile(z[:, None], (1, 3))
        np.testing.assert_allclose(law.force(*many, **w)[:, 1], expected[:2], rtol=1e-10)


def test_slip_in_a_plane_of_space_is_slip_in_the_plane() -> None:
    for k, name in enumerate(LAWS):
        plane = ((0, 1), (1, 2), (2, 0))[k % 3]
        flat, law = sf.PlanarSlip(LAWS[name]), sf.SpatialSlip(LAWS[name])
        P = np.eye(3)[:, [*plane]]
        v, a, b = np.array([0.03, -0.04]), np.array([0.5, 0.2]), np.array([0.1, -0.6])
        n = sum(directed(flat.law))
        w, w_3 = given_inputs(flat.law, b), given_inputs(flat.law, P @ b)
        F = law.force(P @ v, N, bent(law, P @ a, P @ b), **w_3)
        assert pytest.approx(P @ flat.force(v, N, bent(flat, a, b), **w), rel=1e-10, abs=1e-12) == F
        rate = np.asarray(law.rate(P @ v, N, bent(law, P @ a, P @ b), **w_3)).ravel()
        expected = np.asarray(flat.rate(v, N, bent(flat, a, b), **w)).ravel()
        vectors = P @ expected[: 2 * n].reshape(2, n)
        whole = np.concatenate([vectors.ravel(), expected[2 * n :]])
        assert rate == pytest.approx(whole, rel=1e-9, abs=1e-12)


def test_steady_sliding_has_the_force_of_the_law_along_the_motion() -> None:
    e = np.array([0.6, -0.8])
    for name in DYNAMIC:
        one, law = LAWS[name], sf.PlanarSlip(LAWS[name])
        expected = one.force(0.1, N, one.steady_state(0.1, N)) * e
        force = law.force(0.1 * e, N, law.steady_state(0.1 * e, N))
        assert force == pytest.approx(expected, rel=1e-9), name


def test_lugre_on_a_circle_lags_by_the_angle_of_its_linear_equation() -> None:
    """dz/dt = v - lambda z with turning v: z = v/(lambda + i omega)."""
    speed, omega = 4e-3, 2 * pi * 100
    law = sf.PlanarSlip(sf.LuGre(mu_s=0.1, sigma_1=0.0))
    pull = 1e5 * speed / (0.1 * N)
    z = (speed / (pull + 1j * omega)) * np.exp(0.3j)
    v = speed * np.array([cos(0.3), sin(0.3)])
    rate = law.rate(v, N, np.array([z.real, z.imag]))
    turning = 1j * omega * z
    assert rate == pytest.approx([turning.real, turning.imag], rel=1e-12)


def test_bouc_wen_is_the_biaxial_element() -> None:
    """Of Park, Wen, Ang with n = 2 and one product for both axes; loads along z only."""
    law = sf.PlanarSlip(sf.BoucWen(n=2.0, A=1.2), turn=1e-9)
    for v, z in RNG.uniform(-1.0, 1.0, (30, 2, 2)):
        rate, power = law.rate(v, N, z) * 0.1 * N / 1e5, v @ z
        assert rate == pytest.approx(1.2 * v - 0.5 * z * (abs(power) + power), abs=1e-6)


def test_sharp_maxwell_slip_is_radial_return() -> None:
    """Against steps of perfect plasticity: a spring returned to the disc after each."""
    slider = sf.Slider(k=1e5, mu=0.1)
    law, limit = sf.PlanarSlip(sf.MaxwellSlip(elements=(slider,), n=300.0), turn=1e-4), 0.1 * N
    t = np.linspace(0.0, 1.0, 20_001)
    x = 3e-5 * np.array([np.sin(2 * pi * t), np.sin(6 * pi * t + 1.0) * np.cos(3 * t)])
    v = np.diff(x) / np.diff(t)
    exact, worst = np.zeros(2), 0.0
    z, a = ca.SX.sym("z", 2), ca.SX.sym("v", 2)
    dt = t[1] - t[0]
    midpoint = z + dt * law.rate(a, N, z + dt / 2 * law.rate(a, N, z))
    smooth = ca.Function("step", [z, a], [midpoint]).mapaccum(v.shape[1])
    found = smooth(np.zeros(2), v).full()
    for k in range(v.shape[1]):
        exact = exact + 1e5 * v[:, k] * dt
        exact *= min(1.0, limit / np.hypot(*exact))
        worst = max(worst, np.hypot(*(found[:, k] - exact)))
    assert worst < 0.02 * limit


class Crooked(sf.StaticLaw):
    """A law of a user who adds to v in the argument of a product."""

    facts = sf.LuGre.facts
    velocity_scale = 1.0
    states = sf.LuGre().states

    def force(self, v, N, z=()):
        return z[0] * (1 + v) - z[0] * (1 - v)


def test_expressions_without_vectors_are_refused_by_what_they_do() -> None:
    assert anisotropy(Crooked()) == "it adds a number to a vector"


def test_every_law_without_sides_and_modes_has_a_vector_form() -> None:
    missing = {name for name, kind in sf.ALL_LAWS.items() if anisotropy(kind())}
    assert missing == {"capstan", "quarter_car_general", "exact_coulomb"}
