"""Loops that are closed by balls, rub where they close, or hold more than they need."""

import numpy as np
import pytest
from chains import X, Y, Z, attach

from symfric import BrownMcPhee, simulate
from symfric.multibody import Cylindrical, JointFriction, Mechanism, Prismatic, Revolute, Spherical

LAW = BrownMcPhee()


def crank_with_a_ball() -> Mechanism:
    """A crank on a shaft that may slide, a rod, and a piston whose ball closes the loop."""
    m = Mechanism("crank")
    rubs, light = JointFriction(LAW, radius=0.01), {"mass": 0.5, "J": 1e-3}
    begin = {"start": (0.0, 0.5), "rate": (0.0, 10.0)}
    attach(m, Cylindrical, "shaft", "crank", z=Y, **light, **begin)
    attach(m, Revolute, "pin", "rod", "crank", at=(0.1, 0.0, 0.0), to=(-0.15, 0.0, 0.0), z=Y,
           start=-0.7, friction=rubs, **light)  # fmt: skip
    attach(m, Prismatic, "bore", "piston", z=X, start=0.38, friction=JointFriction(LAW), **light)
    attach(m, Spherical, "end", "piston", "rod", at=(0.15, 0.0, 0.0), z=Y, friction=rubs)
    return m.assembled()


def test_a_ball_that_closes_a_loop_rubs_with_a_law_without_states() -> None:
    # some components of its slip are zero for every motion: CasADi then refused to put them in
    run = simulate(crank_with_a_ball().build(), 0.02, backend="vm")
    pressed = np.sqrt(sum(run[f"end_{c}"] ** 2 for c in ("Fx", "Fy", "Fz")))
    np.testing.assert_allclose(run["end_N"], pressed, atol=2e-4)
    np.testing.assert_allclose(run["end_friction"] * run["end_slip"], run["end_power"], rtol=1e-2)
    assert run["end_power"].max() > 1e-4


@pytest.mark.parametrize("rubbing", ["floor face", "face guide"])
def test_redundant_loops_that_rub_twice_are_refused_in_words(rubbing: str) -> None:
    m = Mechanism("wedge")
    slope = (-np.cos(0.3), 0.0, np.sin(0.3))
    m.body("block", 10.0, (0.01, 0.01, 0.01))
    ends = {"floor": ("ground", "wedge", X), "face": ("wedge", "block", slope),
            "guide": ("ground", "block", Z)}  # fmt: skip
    for name, (a, b, z) in ends.items():
        friction = JointFriction(LAW) if name in rubbing.split() else None
        attach(m, Prismatic, name, b, a, J=0.01, z=z, friction=friction)
    with pytest.raises(ValueError, match="normal force that the redundant constraints"):
        m.assembled().build()


def spatial_crank() -> Mechanism:
    """Crank about x, slider along x, and a rod with balls at both ends, which may spin."""
    m = Mechanism("crank", gravity=(0.0, 0.0, -9.8))
    r, length, b, c, e = 0.08, 0.3, 0.1, 0.12, 0.02
    reach = float(np.sqrt(length**2 - b**2 - (c + r - e) ** 2))
    along = (np.array([reach, 0.0, e]) - np.array([0.0, b, c + r])) / length
    # the turn that brings z along the rod, as Euler parameters
    half = np.array([1.0 + along[2], -along[1], along[0], 0.0])
    half /= np.linalg.norm(half)
    attach(m, Revolute, "theta", "wheel", mass=0.5, J=0.2, at=(0.0, b, c), z=X, x=Z, rate=120.0)
    attach(m, Prismatic, "slider", "block", mass=5.0, J=0.2, z=X, x=Z, start=reach,
           rate=b * r * 120.0 / reach)  # fmt: skip
    attach(m, Spherical, "near", "rod", "wheel", mass=0.1, J=(1e-3, 1e-3, 1e-5), at=(0.0, 0.0, r),
           to=(0.0, 0.0, -length / 2), start=tuple(half.tolist()))  # fmt: skip
    attach(m, Spherical, "far", "block", "rod", at=(0.0, 0.0, length / 2), to=(0.0, 0.0, e))
    return m.assembled()


def test_unknowns_that_are_zero_but_for_rounding_are_found() -> None:
    # the multiplier of the norm is 1e-15 beside accelerations of 1e3: Newton's method went on
    # for ever and said that there was no solution
    run = simulate(spatial_crank().build(), 0.02, backend="vm")
    assert run.final["energy"] == pytest.approx(run["energy"][0], rel=1e-6)
