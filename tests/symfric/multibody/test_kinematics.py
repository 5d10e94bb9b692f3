"""Velocities and accelerations are the derivatives of positions, through every joint."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from chains import chain, state

from symfric.multibody.kinematics import Kinematics
from symfric.multibody.prepare import Prepared


@cache
def prepared(reverse: bool) -> Prepared:
    return chain(reverse).prepare()


def derivative(kin: Kinematics, a: ca.SX, expression: ca.SX) -> ca.SX:
    """d/dt of an expression of q and q'."""
    return ca.jtimes(expression, kin.q, kin.qd) + ca.jtimes(expression, kin.qd, a)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("name", [f"b{i}" for i in range(8)])
def test_motion_of_every_body_is_consistent(reverse: bool, name: str) -> None:
    made = prepared(reverse)
    kin, a = made.eq.kin, made.eq.a
    m = kin.motion[name]
    skewed = derivative(kin, a, ca.densify(m.R)) @ m.R.T
    w = ca.vertcat(skewed[2, 1], skewed[0, 2], skewed[1, 0])
    pairs = [
        (derivative(kin, a, ca.densify(m.p)), m.v),
        (w, m.w),
        (derivative(kin, a, ca.densify(m.v)), m.R @ m.dv_B - kin.motion["ground"].dv_B),
        (derivative(kin, a, ca.densify(m.w)), m.R @ m.dw_B),
        (m.R.T @ m.R, ca.SX.eye(3)),
    ]
    q, qd = state(made)
    # accelerations of Euler parameters that keep their length: p'a = -p''p'
    acceleration = np.random.default_rng(3).normal(size=made.eq.n)
    for link in kin.topology.links:
        if link.joint.quaternion is not None:
            rows = slice(link.first + link.joint.quaternion, link.first + link.joint.quaternion + 4)
            acceleration[rows] -= q[rows] * (q[rows] @ acceleration[rows] + qd[rows] @ qd[rows])
    values = ca.Function("m", [kin.q, kin.qd, a], [ca.densify(x) for pair in pairs for x in pair])
    found = [x.full() for x in values.call([q, qd, acceleration])]
    for ours, expected in zip(found[::2], found[1::2], strict=True):
        assert ours == pytest.approx(expected, abs=1e-12)


def test_places_are_found_by_name() -> None:
    kin = prepared(False).eq.kin
    point, velocity = kin.point("ground.out")
    assert ca.DM(point).full().ravel() == pytest.approx([0.1, 0.2, 0.3])
    assert velocity.is_zero()
