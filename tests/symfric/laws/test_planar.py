"""Slip in a plane: isotropy, straight slip, circular slip, refusals."""

from math import cos, pi, sin

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import ALL_LAWS, BrownMcPhee, Coulomb, Dahl, LuGre, StaticLaw, Sum, Viscous
from symfric.laws import GMS, Bristle2D, Karnopp
from symfric.laws.planar import Planar, Spatial

N = 7.848
PLANAR = [
    name
    for name, kind in ALL_LAWS.items()
    if issubclass(kind, StaticLaw) and kind.facts.odd and not kind().inputs
] + ["dahl", "bliman_sorine", "lugre", "lugre_normalised", "lugre_passive"]
each = pytest.mark.parametrize("name", PLANAR)
pair = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)).map(np.array)
logs = st.floats(-6.0, 0.0).map(lambda e: 10.0**e)


def turn(angle: float) -> np.ndarray:
    return np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])


def bent(law: Planar, z: np.ndarray) -> np.ndarray:
    """States of a size that sliding gives, x and y of each in a column."""
    n = len(law.states) // 2
    typical = np.asarray(law.law.steady_state(1.0, N)).ravel()
    return np.concatenate([typical * z[0], typical * z[1]]) if n else np.zeros(0)


@each
@given(v=pair, scale=logs, z=pair, angle=st.floats(0.0, 2 * pi))
def test_turned_slip_turns_the_force(
    name: str, v: np.ndarray, scale: float, z: np.ndarray, angle: float
) -> None:
    law, v, R = Planar(ALL_LAWS[name]()), scale * v, turn(angle)
    F = law.force(v, N, bent(law, z))
    turned = law.force(R @ v, N, bent(law, R @ z))
    size = np.abs(F).max() + N
    assert turned == pytest.approx(R @ F, abs=1e-11 * size)


@each
@given(speed=logs, sign=st.sampled_from([1.0, -1.0]), share=st.floats(-1.0, 1.0))
def test_straight_slip_is_the_law_itself(
    name: str, speed: float, sign: float, share: float
) -> None:
    one, law, v = ALL_LAWS[name](), Planar(ALL_LAWS[name]()), sign * speed
    z = bent(law, np.array([share, 0.0]))
    straight = z[: len(one.states)]
    expected = one.force(v, N, straight)
    assert law.force((v, 0.0), N, z) == pytest.approx([expected, 0.0], rel=1e-5, abs=1e-5)
    if one.states:
        rate = np.asarray(one.rate(v, N, straight))
        found = law.rate((v, 0.0), N, z)
        assert found[: rate.size] == pytest.approx(
            rate, abs=1e-5 * np.abs(rate).max() + 1e-5 * speed
        )
        assert np.abs(found[rate.size :]).max() == 0.0


@each
def test_force_at_rest_is_smooth(name: str) -> None:
    law, v = Planar(ALL_LAWS[name]()), ca.SX.sym("v", 2)
    z = ca.SX.sym("z", len(law.states))
    F = law.force(v, N, z)
    f = ca.Function("f", [v, z], [F, ca.jacobian(F, v), ca.hessian(F[0], v)[0]])
    at_rest = f([0.0, 0.0], 0.0)
    assert all(np.isfinite(result.full()).all() for result in at_rest)
    assert np.abs(at_rest[0].full()).max() == 0.0


def test_sideways_slip_lowers_the_resistance_along() -> None:
    """Coulomb's cone: while sliding fast across, a slow push along meets viscous friction only."""
    law = Planar(Coulomb(mu_d=0.1, v_eps=1e-3))
    F = law.force((0.01, 1.0), N)
    assert F[1] == pytest.approx(0.1 * N, rel=1e-4)
    assert F[0] == pytest.approx(0.1 * N * 0.01, rel=1e-3)


def test_sliding_bristle_points_against_the_motion() -> None:
    law, v = Planar(LuGre()), 0.1 * np.array([0.6, -0.8])
    z = law.steady_state(v, N)
    assert law.force(v, N, z) == pytest.approx(0.1 * N * np.array([0.6, -0.8]), rel=1e-9)
    assert np.abs(law.rate(v, N, z)).max() < 1e-12


def test_states_are_numbered_by_axis() -> None:
    assert [s.name for s in Planar(Sum((LuGre(), Dahl()))).states] == [
        "z_1_x",
        "z_2_x",
        "z_1_y",
        "z_2_y",
    ]
    assert Planar(BrownMcPhee()).states == ()


@each
@pytest.mark.parametrize("plane", [(0, 1), (1, 2), (2, 0)])
def test_slip_in_a_plane_of_space_is_slip_in_the_plane(name: str, plane: tuple[int, int]) -> None:
    flat, law = Planar(ALL_LAWS[name]()), Spatial(ALL_LAWS[name]())
    v, z = np.array([0.03, -0.04]), bent(flat, np.array([0.5, 0.2]))
    n = len(flat.states) // 2
    v_3, z_3 = np.zeros(3), np.zeros(3 * n)
    v_3[list(plane)] = v
    for k, axis in enumerate(plane):
        z_3[axis * n : (axis + 1) * n] = z[k * n : (k + 1) * n]
    F, rate = law.force(v_3, N, z_3), np.asarray(law.rate(v_3, N, z_3))
    assert F[list(plane)] == pytest.approx(flat.force(v, N, z), rel=1e-12)
    assert np.delete(F, plane) == pytest.approx([0.0])
    expected = np.asarray(flat.rate(v, N, z)).ravel()
    for k, axis in enumerate(plane):
        own = rate[axis * n : (axis + 1) * n]
        assert own == pytest.approx(expected[k * n : (k + 1) * n], rel=1e-12)


@pytest.mark.parametrize("law", [GMS(), Bristle2D(), Karnopp(), Dahl(n=2.0)])
def test_law_without_a_planar_form_is_refused(law: object) -> None:
    with pytest.raises(ValueError, match=r"Planar: expected an odd law .* got \w+; Bristle2D"):
        Planar(law)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="Planar: expected a law such as"):
        Planar(Viscous)  # type: ignore[arg-type]
