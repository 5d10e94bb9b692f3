"""Rotations and Euler parameters against their defining identities."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from symfric.multibody import Frame
from symfric.multibody.spatial import (
    euler_e,
    euler_g,
    euler_parameters,
    rotation,
    rotation_x,
    rotation_y,
    rotation_z,
    skew,
)


def unit(seed: int) -> np.ndarray:
    p = np.random.default_rng(seed).normal(size=4)
    return p / np.linalg.norm(p)


def full(expression: ca.SX) -> np.ndarray:
    return ca.DM(expression).full()


def test_turns_about_an_axis_agree_with_scipy() -> None:
    for turn, axis in ((rotation_x, "x"), (rotation_y, "y"), (rotation_z, "z")):
        expected = Rotation.from_euler(axis, 0.7).as_matrix()
        assert full(turn(ca.SX(0.7))) == pytest.approx(expected)
    a, b = np.random.default_rng(0).normal(size=(2, 3))
    assert full(skew(ca.SX(a))) @ b == pytest.approx(np.cross(a, b))


def test_euler_parameters_agree_with_scipy_and_come_back() -> None:
    for p in (*map(unit, range(4)), *np.eye(4)[1:]):  # half turns, too
        R = full(rotation(ca.SX(p)))
        assert pytest.approx(Rotation.from_quat([*p[1:], p[0]]).as_matrix()) == R
        back = euler_parameters(ca.DM(R)).full().ravel()
        assert back * np.sign(back @ p) == pytest.approx(p)
        assert back[0] >= 0.0


def test_identities_of_e_and_g() -> None:
    p = unit(0)
    E, G, R = (full(f(ca.SX(p))) for f in (euler_e, euler_g, rotation))
    assert pytest.approx(R) == E @ G.T
    assert E @ p == pytest.approx(np.zeros(3))
    assert pytest.approx(np.eye(3)) == E @ E.T
    assert pytest.approx(np.eye(4) - np.outer(p, p)) == E.T @ E


def test_rates_of_euler_parameters_give_both_angular_velocities() -> None:
    p, pd = ca.SX(unit(1)), np.random.default_rng(5).normal(size=4)
    pd = ca.SX(pd - unit(1) * (unit(1) @ pd))
    symbol = ca.SX.sym("p", 4)
    R_dot = ca.jtimes(ca.vec(rotation(symbol)), symbol, pd)
    R_dot = full(ca.reshape(ca.substitute(R_dot, symbol, p), 3, 3))
    R = full(rotation(p))
    assert full(skew(2 * euler_e(p) @ pd)) @ R == pytest.approx(R_dot)
    assert R @ full(skew(2 * euler_g(p) @ pd)) == pytest.approx(R_dot)


def test_axes_of_a_frame_are_right_handed_and_z_is_kept() -> None:
    R = full(Frame(z=(0.0, 3.0, 4.0), x=(1.0, 1.0, 0.0)).R)
    assert pytest.approx(np.eye(3)) == R.T @ R
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert R[:, 2] == pytest.approx([0.0, 0.6, 0.8])
    for more, message in (
        ({"z": (0, 0, 0)}, "z: expected three numbers that are not all zero, got (0, 0, 0)"),
        ({"z": (1, 0)}, "z: expected three numbers that are not all zero, got (1, 0)"),
        ({"x": (0, 0, 2)}, "x: expected a direction not parallel to z, got (0, 0, 2)"),
        ({"at": (1.0, 2.0)}, "frame: at: expected three numbers"),
    ):
        with pytest.raises(ValueError) as caught:
            Frame(**more)  # type: ignore[arg-type]
        assert message in str(caught.value)
