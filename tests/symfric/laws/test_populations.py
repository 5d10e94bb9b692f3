"""Random contacts: what the asperities show together, and what they refuse."""

import numpy as np
import pytest

from symfric.laws.populations import GenericAsperity, RandomBristles

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


def test_scatter_falls_with_the_root_of_the_count() -> None:
    def scatter(count: int) -> float:
        late = [
            GenericAsperity(count=count, seed=s).force(*sliding(1e-4), N)[-1] for s in range(60)
        ]
        return float(np.std(late))

    assert scatter(50) / scatter(800) == pytest.approx(4.0, rel=0.35)


def test_force_is_proportional_to_load_at_fixed_stretch_over_load() -> None:
    motion = sliding(1e-4)
    one = GenericAsperity(k=1e6).force(*motion, N)
    two = GenericAsperity(k=2e6).force(*motion, 2 * N)
    assert two == pytest.approx(2 * one, rel=1e-12)


def cyclic(law: GenericAsperity, amplitude: float) -> tuple[np.ndarray, np.ndarray]:
    s = np.linspace(0.0, 3.0, 6001)
    x = amplitude * np.sin(2 * np.pi * s)
    return x, law.force(s, x, N)


@pytest.mark.parametrize("amplitude", [1e-6, 1e-5, 1e-4])
def test_cycle_dissipates(amplitude: float) -> None:
    x, F = cyclic(GenericAsperity(), amplitude)
    last = slice(4000, None)
    assert np.trapezoid(F[last], x[last]) > 0


def test_small_inner_loop_returns_to_the_outer_one() -> None:
    """Memory: after a small excursion the force comes back to where it was."""
    out, back = np.linspace(0.0, 2e-6, 400), np.linspace(2e-6, 1.6e-6, 80)
    x = np.concatenate([out, back, back[::-1]])
    t = np.linspace(0.0, 1.0, x.size) * 1e-3
    F = GenericAsperity(tau_c=1e-6).force(t, x, N)
    assert F[399] - F[479] > 0.05
    assert F[-1] == pytest.approx(F[399], rel=0.05)


def test_velocity_that_swings_opens_a_loop() -> None:
    t = np.linspace(0.0, 0.6, 24_001)
    v = 3e-4 + 2.5e-4 * np.sin(2 * np.pi * 10 * t)
    x = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 * np.diff(t))])
    F = GenericAsperity(count=2000).force(t, x, N)
    late, speeding = t > 0.1, np.gradient(v) > 0
    near = np.abs(v - 3e-4) < 5e-5
    assert F[late & near & speeding].mean() > F[late & near & ~speeding].mean() + 0.01


def test_bristles_slide_at_a_mean_force_below_their_limit() -> None:
    law = RandomBristles(count=500)
    t, x = sliding(1e-4, 3e-4)
    F = law.force(t, x)
    assert 0.3 < F[-100:].mean() < 0.7
    assert F.max() < 1.0
    mirrored = law.force(t, -x)
    assert mirrored[-100:].mean() == pytest.approx(-F[-100:].mean(), rel=0.1)


def test_bristles_that_do_not_snap_are_a_spring() -> None:
    x = np.linspace(0.0, 1e-9, 11)
    F = RandomBristles().force(np.arange(11.0), x)
    assert F - F[0] == pytest.approx(1e5 * x, abs=1e-15)


@pytest.mark.parametrize(
    ("t", "x", "message"),
    [
        ([0.0, 1.0], [0.0], "rising times t and as many positions x, got shapes"),
        ([0.0, 0.0], [0.0, 1e-7], "rising times"),
        ([0.0, 1.0], [0.0, 1e-5], "expected steps of x up to 1e-06 m, got 1e-05 m; give the"),
    ],
)
def test_bad_motion_is_refused(t: list[float], x: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GenericAsperity().force(t, x, N)
    with pytest.raises(ValueError, match="RandomBristles: expected"):
        RandomBristles().force(t, [2 * y for y in x])
