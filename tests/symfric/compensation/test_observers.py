"""Observers of friction: closed forms, bounds for every step, gain and input, stability."""

from itertools import product

import numpy as np
import pytest
from one_program import along
from tables import sampled

from symfric import GMS, LuGre, LuGreNormalised, LuGrePassive
from symfric.codegen import Block, law_block
from symfric.compensation import disturbance_observer, gms_observer, lugre_observer

H = 1e-3
LAWS = [LuGre(mu_s=6.0, mu_d=4.0, sigma_2=1.0), LuGreNormalised(), LuGrePassive()]
SPRINGS = GMS(form="event", mu_s=6.0, mu_d=4.0)


def rolled(block: Block, rows: np.ndarray, **parameters: float) -> tuple[np.ndarray, np.ndarray]:
    """States and forces after each row of inputs."""
    p = np.array([parameters.get(v.name, float(v.start)) for v in block.parameters])
    states, outputs = along(block, rows, p)
    return states, outputs[:, 0]


@pytest.mark.parametrize("law", sampled([SPRINGS, *LAWS], of=2), ids=lambda law: type(law).__name__)
def test_without_a_gain_an_observer_makes_the_steps_of_the_law(law) -> None:
    make = gms_observer if isinstance(law, GMS) else lugre_observer
    velocities = 2e-3 * np.sin(0.05 * np.arange(200.0))
    zeros = np.zeros_like(velocities)
    _, found = rolled(make(law, 0.0, N=2.0, ramp=None), np.column_stack([velocities, zeros]))
    _, wanted = rolled(law_block(law), np.column_stack([velocities, zeros + 2.0]))
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12)


def test_states_stay_in_the_invariant_set_of_the_law() -> None:
    """|z| <= mu_s N / sigma_0, |F_i| <= alpha_i mu_s N, for steps, gains and inputs of any size."""
    random = np.random.default_rng(0)
    rows = 10.0 ** random.uniform(-9, 2, (200, 2)) * random.choice([-1.0, 1.0], (200, 2))
    shares = np.array([float(share) for share in SPRINGS.shares()])
    springs = gms_observer(SPRINGS, 1e4, N=3.0, ramp=None)
    for h in (1e-6, 1e-3, 1.0, 1e3):
        for law, gain in ((LAWS[0], 1e6), (LAWS[1], 1e6), (LAWS[0], 1.0)):
            states, forces = rolled(lugre_observer(law, gain, N=3.0, ramp=None), rows, h=h)
            load = 3.0 if isinstance(law, LuGreNormalised) else 1.0
            most = law.mu_s * (3.0 / load) / law.sigma_0
            assert np.abs(states).max() <= most
            bristle = law.sigma_0 * most + law.sigma_1 * 2 * most / h
            bound = load * (bristle + law.sigma_2 * np.abs(rows[:, 0]))
            assert (np.abs(forces) <= bound * (1 + 1e-9)).all()
        states, forces = rolled(springs, rows, h=h)
        assert (np.abs(states[:, :4]) <= shares * 6.0 * 3.0).all()
        assert np.isfinite(forces).all()


def test_a_constant_error_moves_the_states_and_no_load_leaves_no_force() -> None:
    """At rest dz/dt = k e and F_i+ = F_i + k_i h k e; F is that of the middle of the step."""
    e, gain, n = 1e-6, 20.0, np.arange(10)
    law, k = LuGre(mu_s=6.0, mu_d=4.0), np.array([float(el.k) for el in SPRINGS.elements])
    rows = np.tile([0.0, e], (10, 1))
    states, forces = rolled(lugre_observer(law, gain, ramp=None), rows)
    assert states[:, 0] == pytest.approx(H * gain * e * (n + 1))
    assert forces == pytest.approx(law.sigma_0 * H * gain * e * (n + 0.5) + law.sigma_1 * gain * e)
    states, forces = rolled(gms_observer(SPRINGS, gain, ramp=None), rows)
    assert states[:, : k.size] == pytest.approx(np.outer(n + 1, k * H * gain * e))
    assert forces == pytest.approx((k * H * gain * e).sum() * (n + 0.5))
    for block in (lugre_observer(LAWS[0], 1.0), gms_observer(SPRINGS, 1.0)):
        _, forces = rolled(block, np.tile([1e-2, 1e-6, 1.0], (200, 1)), N=0.0, sigma_2=0.0)
        assert np.abs(forces[1:]).max() < 1e-6


@pytest.mark.parametrize("order", [1, 2])
def test_a_disturbance_is_found_by_the_balance_of_impulse(order: int) -> None:
    """Mass 2 kg under u = 5 N against 3 N, held: d_k = 3 (1 - q^k), or twice filtered."""
    w, k = 100.0, np.arange(1, 61)
    v = (5.0 - 3.0) / 2.0 * H * k
    rows = np.column_stack([np.full(60, 5.0), v])
    _, forces = rolled(disturbance_observer(2.0, w, order=order, ramp=None), rows)
    b, d = 1 - np.exp(-w * H), np.zeros(order)
    for found in forces:
        f = 3.0
        for i in range(order):
            d[i] = f = d[i] + b * (f - d[i])
        assert found == pytest.approx(f, rel=1e-9)
    if order == 1:
        assert forces == pytest.approx(3.0 * (1 - (1 - b) ** k))


def slowest(ratio: float, b: float, delay: int, order: int) -> float:
    """Largest pole of mass M and observer with m = ratio M, its force `delay` samples late.

    f = ratio F + (1 - ratio) u,  d+ = d + b (f - d) for each order,  u = d `delay` samples before.
    """
    n = order + delay + 1
    A = np.zeros((n, n))  # d_1 .. d_order, then u now and later
    first = np.zeros(n)
    first[order] = 1 - ratio
    for i in range(order):
        before = first if i == 0 else A[i - 1]
        A[i] = b * before
        A[i, i] += 1 - b
    A[order:-1, order + 1 :] = np.eye(delay)
    A[-1] = A[order - 1]
    return float(np.abs(np.linalg.eigvals(A)).max())


def test_the_disturbance_observer_is_stable_up_to_twice_the_mass() -> None:
    """It is stable for every bandwidth, step and delay; beyond twice the mass, not for all."""
    for ratio, wh, delay, order in product(
        (0.01, 0.5, 1.0, 1.5, 1.99), (1e-3, 0.1, 1.0, 10.0), (0, 1, 3, 10), (1, 2)
    ):
        assert slowest(ratio, 1 - np.exp(-wh), delay, order) < 1.0
    assert slowest(2.5, 1 - np.exp(-10.0), 1, 1) > 1.0
    block = disturbance_observer(1.0, 100.0, turning=True)
    assert {v.name: v.unit for v in block.parameters}["m"] == "kg m^2"
    assert block.outputs["F"].unit == "N m"
