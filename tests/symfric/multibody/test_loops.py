"""Loops that are closed by balls, rub where they close, or hold more than they need."""

import numpy as np
import pytest

from symfric import BrownMcPhee, simulate
from symfric.multibody import Cylindrical, JointFriction, Mechanism, Prismatic, Revolute, Spherical

LAW = BrownMcPhee()
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def crank_with_a_ball(*rubbing: str) -> Mechanism:
    """A crank on a shaft that may slide, a rod, and a piston whose ball closes the loop."""
    m = Mechanism("crank")
    for name in ("crank", "rod", "piston"):
        m.body(name, mass=0.5, inertia=(1e-3, 1e-3, 1e-3))
    for place, at, z in (
        ("ground.shaft", 0.0, Y), ("crank.shaft", 0.0, Y), ("crank.pin", 0.1, Y),
        ("rod.pin", -0.15, Y), ("rod.end", 0.15, Y), ("ground.bore", 0.0, X),
        ("piston.bore", 0.0, X), ("piston.end", 0.0, Y),
    ):  # fmt: skip
        m.frame(place, at=(at, 0.0, 0.0), z=z)

    def friction(name: str, radius: float | None = 0.01) -> JointFriction | None:
        return JointFriction(LAW, radius=radius) if name in rubbing else None

    m.joint(Cylindrical("shaft", "ground.shaft", "crank.shaft", (0.0, 0.5), (0.0, 10.0),
                        friction("shaft")))  # fmt: skip
    m.joint(Revolute("pin", "crank.pin", "rod.pin", -0.7, friction=friction("pin")))
    m.joint(Prismatic("bore", "ground.bore", "piston.bore", 0.38, friction=friction("bore", None)))
    m.joint(Spherical("end", "rod.end", "piston.end", friction=friction("end")))
    return m.assembled()


def test_a_ball_that_closes_a_loop_rubs_with_a_law_without_states() -> None:
    # some components of its slip are zero for every motion: CasADi then refused to put them in
    run = simulate(crank_with_a_ball("pin", "bore", "end").build(), 0.02, backend="vm")
    pressed = np.sqrt(sum(run[f"end_{c}"] ** 2 for c in ("Fx", "Fy", "Fz")))
    np.testing.assert_allclose(run["end_N"], pressed, atol=2e-4)
    np.testing.assert_allclose(run["end_friction"] * run["end_slip"], run["end_power"], rtol=1e-2)
    assert run["end_power"].max() > 1e-4


@pytest.mark.parametrize("rubbing", ["floor face", "face guide", "floor face guide"])
def test_redundant_loops_that_rub_twice_are_refused_in_words(rubbing: str) -> None:
    m = Mechanism("wedge")
    slope = (-np.cos(0.3), 0.0, np.sin(0.3))
    m.body("wedge", 1.0, (0.01, 0.01, 0.01))
    m.body("block", 10.0, (0.01, 0.01, 0.01))
    ends = {"floor": ("ground", "wedge", X), "face": ("wedge", "block", slope),
            "guide": ("ground", "block", Z)}  # fmt: skip
    for name, (a, b, z) in ends.items():
        m.frame(f"{a}.{name}", z=z)
        m.frame(f"{b}.{name}", z=z)
        friction = JointFriction(LAW) if name in rubbing.split() else None
        m.joint(Prismatic(name, f"{a}.{name}", f"{b}.{name}", friction=friction))
    with pytest.raises(ValueError, match="normal force that the redundant constraints"):
        m.assembled().build()


def spatial_crank() -> Mechanism:
    """Crank about x, slider along x, and a rod with balls at both ends, which may spin."""
    m = Mechanism("crank", gravity=(0.0, 0.0, -9.8))
    r, length, b, c, e = 0.08, 0.3, 0.1, 0.12, 0.02
    m.body("wheel", 0.5, (0.2, 0.2, 0.2))
    m.body("block", 5.0, (0.2, 0.2, 0.2))
    m.body("rod", 0.1, (1e-3, 1e-3, 1e-5))
    m.frame("ground.bearing", at=(0.0, b, c), z=X, x=Z)
    m.frame("ground.guide", z=X, x=Z)
    m.frame("wheel.bearing", z=X, x=Z)
    m.frame("wheel.pin", at=(0.0, 0.0, r))
    m.frame("block.guide", z=X, x=Z)
    m.frame("block.pin", at=(0.0, 0.0, e))
    m.frame("rod.a", at=(0.0, 0.0, -length / 2))
    m.frame("rod.b", at=(0.0, 0.0, length / 2))
    reach = float(np.sqrt(length**2 - b**2 - (c + r - e) ** 2))
    along = (np.array([reach, 0.0, e]) - np.array([0.0, b, c + r])) / length
    # the turn that brings z along the rod, as Euler parameters
    half = np.array([1.0 + along[2], -along[1], along[0], 0.0])
    half /= np.linalg.norm(half)
    m.joint(Revolute("theta", "ground.bearing", "wheel.bearing", 0.0, 120.0))
    m.joint(Prismatic("slider", "ground.guide", "block.guide", reach, b * r * 120.0 / reach))
    m.joint(Spherical("near", "wheel.pin", "rod.a", start=tuple(half.tolist())))
    m.joint(Spherical("far", "rod.b", "block.pin"))
    return m.assembled()


def test_unknowns_that_are_zero_but_for_rounding_are_found() -> None:
    # the multiplier of the norm is 1e-15 beside accelerations of 1e3: Newton's method went on
    # for ever and said that there was no solution
    run = simulate(spatial_crank().build(), 0.02, backend="vm")
    assert run.final["energy"] == pytest.approx(run["energy"][0], rel=1e-6)
