"""States as people give them to laws: numbers, lists, arrays; and sentences for wrong ones."""

import casadi as ca
import numpy as np
import pytest

from symfric.laws import ALL_LAWS, GMS, Coulomb, LuGre, Sum, Viscous

LAW = LuGre()


def by_hand(v: float, N: float, z: float) -> float:
    """The force of `LAW`, written out."""
    g = N * (LAW.mu_d + (LAW.mu_s - LAW.mu_d) * np.exp(-((v / LAW.v_s) ** 2)))
    rate = v - LAW.sigma_0 * abs(v) * z / g
    return float(LAW.sigma_0 * z + LAW.sigma_1 * rate + LAW.sigma_2 * v)


def test_one_state_is_a_number_a_list_or_an_array() -> None:
    wanted = by_hand(0.1, 7.8, 1e-5)
    for z in (1e-5, np.float64(1e-5), np.array(1e-5), [1e-5], (1e-5,), np.array([1e-5]),
              ca.DM(1e-5)):  # fmt: skip
        assert float(LAW.force(0.1, 7.8, z)) == pytest.approx(wanted, rel=1e-12)
        assert float(LAW.rate(0.1, 7.8, z)[0]) == pytest.approx(
            (wanted - LAW.sigma_0 * 1e-5) / LAW.sigma_1, rel=1e-9
        )


def test_an_array_beside_velocities_has_a_state_for_each() -> None:
    v, z = np.linspace(0.01, 0.1, 5), np.linspace(0.0, 1e-5, 5)
    wanted = [by_hand(a, 7.8, b) for a, b in zip(v, z, strict=True)]
    np.testing.assert_allclose(LAW.force(v, 7.8, z), wanted, rtol=1e-12)
    np.testing.assert_allclose(LAW.force(v, 7.8, z[None]), wanted, rtol=1e-12)


def test_wrong_states_are_refused_with_the_right_ones() -> None:
    for z in ((), [], ca.SX(0, 1)):
        with pytest.raises(ValueError, match="LuGre: expected z with 1 state, z, got none; z ="):
            LAW.force(0.1, 7.8, z)
    for z in ([1e-5, 2.0], np.zeros(2), ca.SX.sym("z", 2), np.zeros((3, 1))):
        with pytest.raises(ValueError, match="LuGre: expected z with 1 state, z, got"):
            LAW.force(0.1, 7.8, z)
    with pytest.raises(ValueError, match="LuGre: expected z with 1 state, z, got 'z'"):
        LAW.rate(0.1, 7.8, "z")
    with pytest.raises(ValueError, match=r"GMS: expected z with 8 states, .* and 2 more, got 0.1"):
        GMS().force(0.1, 7.8, 0.1)
    with pytest.raises(ValueError, match=r"Coulomb: expected no states, got 0.1; leave z out"):
        Coulomb().force(0.1, 7.8, 0.1)
    with pytest.raises(ValueError, match=r"Sum: expected z with 1 state, z, got none"):
        Sum((LuGre(), Viscous())).force(0.1, 7.8)


def test_every_law_takes_its_steady_states_and_as_many_only() -> None:
    for name, kind in ALL_LAWS.items():
        law = kind()
        z = law.steady_state(0.1, 7.8)
        assert np.isfinite(float(law.force(0.1, 7.8, z))), name
        assert np.isfinite(float(law.force(0.1, 7.8, list(np.ravel(z))))), name
        with pytest.raises(ValueError, match=f"{kind.__name__}: expected "):
            law.force(0.1, 7.8, np.zeros(len(law.states) + 1))
