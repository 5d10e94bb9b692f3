"""Random contacts: what the asperities show together, and what they refuse."""

import casadi as ca
import numpy as np
import pytest

from symfric.laws.composed.populations import GenericAsperity, Population, RandomBristles

N = 10.0


def sliding(v: float, path: float = 6e-5, step: float = 5e-7) -> tuple[np.ndarray, np.ndarray]:
    x = np.arange(0.0, path, step)
    return x / v, x


def mean_force(v: float, law: GenericAsperity) -> float:
    F = law.force(*sliding(v), N)
    return float(F[-40:].mean())


def test_sliding_force_weakens_with_the_velocity_between_its_coefficients() -> None:
    forces = [mean_force(v, GenericAsperity()) for v in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)]
    assert (np.diff(forces) < 0).all()
    assert forces[0] < 0.2 * N
    assert forces[-1] > 0.2 * 0.05 * N
    assert forces[0] > 2 * forces[-1]


def test_same_seed_gives_the_same_force_and_another_seed_another() -> None:
    motion = sliding(1e-4)
    one, again, other = (
        GenericAsperity(seed=seed, count=200).force(*motion, N) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 1e-3


def test_force_is_proportional_to_load_at_fixed_stretch_over_load() -> None:
    motion = sliding(1e-4)
    one = GenericAsperity(k=1e6).force(*motion, N)
    two = GenericAsperity(k=2e6).force(*motion, 2 * N)
    assert two == pytest.approx(2 * one, rel=1e-12)


def test_small_inner_loop_returns_to_the_outer_one() -> None:
    """Memory: after a small excursion the force comes back to where it was."""
    out, back = np.linspace(0.0, 2e-6, 400), np.linspace(2e-6, 1.6e-6, 80)
    x = np.concatenate([out, back, back[::-1]])
    t = np.linspace(0.0, 1.0, x.size) * 1e-3
    F = GenericAsperity(tau_c=1e-6).force(t, x, N)
    assert F[399] - F[479] > 0.05
    assert F[-1] == pytest.approx(F[399], rel=0.05)


def test_bristles_slide_at_a_mean_force_below_their_limit() -> None:
    law = RandomBristles(count=500)
    t, x = sliding(1e-4, 3e-4)
    F = law.force(t, x, N)
    assert 0.3 < F[-100:].mean() < 0.7
    assert F.max() < 1.0
    mirrored = law.force(t, -x, N)
    assert mirrored[-100:].mean() == pytest.approx(-F[-100:].mean(), rel=0.1)


def test_bristles_that_do_not_snap_are_a_spring() -> None:
    x = np.linspace(0.0, 1e-9, 11)
    F = RandomBristles().force(np.arange(11.0), x, N)
    assert F - F[0] == pytest.approx(1e5 * x, abs=1e-15)


@pytest.mark.parametrize("law", [GenericAsperity(count=50), RandomBristles()])
def test_a_long_way_is_made_in_steps(law: Population) -> None:
    one, F = law.advance(law.begin(), 7.3 * law.step, 1e-3, N)
    other = law.begin()
    for _ in range(8):
        other, G = law.advance(other, 7.3 * law.step / 8, 1e-3 / 8, N)
    np.testing.assert_allclose(one.z, other.z, rtol=1e-12, atol=1e-18)
    assert pytest.approx(G, rel=1e-12) == F


def test_one_contact_is_the_same_as_an_array_and_as_an_expression() -> None:
    law = GenericAsperity()
    z, r, dx = ca.SX.sym("z", 3), ca.SX.sym("r"), ca.SX.sym("dx")
    step = ca.Function("step", [z, r, dx], [law.contact(z, r, dx, 1e-3, N)])
    start = law.begin()
    after = law.contact(start.z, start.r, 3e-7, 1e-3, N)
    for i in (0, 17, 999):
        one = step(start.z[:, i], start.r[i], 3e-7).full().ravel()
        np.testing.assert_allclose(one, after[:, i], rtol=1e-14, atol=1e-300)


def test_a_single_old_asperity_slips_at_its_closed_form() -> None:
    """In the middle of its contact it bears pi/(2 duty) N and slips at mu_inf of that."""
    law = GenericAsperity(count=1, k=1e12, tau_c=1e-9)
    z = np.array([[0.299], [0.0], [1.0]])
    F = law.contact(z, np.zeros(1), 0.001 * law.lam, 1.0, N)[-1]
    assert F[0] == pytest.approx(0.2 * N * np.pi / 1.2, rel=1e-9)


def test_steady_force_of_stiff_old_asperities_is_that_of_coulomb() -> None:
    law = GenericAsperity(k=1e9, tau_c=1e-9)
    F = law.steady_force([-1e-3, 0.0, 1e-3], N)
    assert list(F) == pytest.approx([-0.2 * N, 0.0, 0.2 * N], rel=2e-3)


def test_rest_makes_the_next_break_away_harder() -> None:
    law, peaks = GenericAsperity(), []
    for rest in (1e-3, 0.02, 0.5):
        contacts = law.begin()
        for _ in range(60):
            contacts, _ = law.advance(contacts, law.step, law.step / 1e-2, N)
        contacts, _ = law.advance(contacts, 0.0, rest, N)
        forces = []
        for _ in range(40):
            contacts, F = law.advance(contacts, law.step / 4, law.step / 4e-2, N)
            forces.append(F)
        peaks.append(max(forces))
    assert peaks[0] < 0.8 * peaks[1] < 0.64 * peaks[2]
