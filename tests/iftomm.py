"""Benchmark mechanisms of the IFToMM library of computational benchmark problems, as Mechanisms.

Source: Gonzalez, Dopico, Lugris, Cuadrado, A benchmarking system for MBS simulation software,
Multibody System Dynamics 16, 2006. Lengths 1 m, masses 1 kg unless stated otherwise.
"""

from itertools import pairwise
from math import pi

from symfric.multibody import Mechanism, PointOnLine, Prismatic, Revolute, SpringDamper

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
G = 9.81
LIGHT = 1e-6
"""Moment of inertia of a slender rod about its own axis [kg m^2]; the library has zero."""


def four_bars(n: int) -> Mechanism:
    """n loops of slender rods, all square at the start, that move to the right at 1 m/s."""
    m = Mechanism("four_bars", gravity=(0.0, -G, 0.0))
    J = 1.0 / 12
    for k in range(n + 1):
        m.body(f"post_{k}", 1.0, (LIGHT, J, J), com=(0.5, 0.0, 0.0))
        m.frame(f"post_{k}.top", at=X)
        m.frame(f"ground.foot_{k}", at=(float(k), 0.0, 0.0))
        m.joint(Revolute(f"theta_{k}", f"ground.foot_{k}", f"post_{k}", start=pi / 2, rate=-1.0))
    for k in range(n):
        m.body(f"bar_{k}", 1.0, (LIGHT, J, J), com=(0.5, 0.0, 0.0))
        m.frame(f"bar_{k}.end", at=X)
        m.joint(Revolute(f"beta_{k}", f"post_{k}.top", f"bar_{k}", start=-pi / 2, rate=1.0))
        m.joint(PointOnLine(f"pin_{k}", f"post_{k + 1}.top", f"bar_{k}.end"))
    return m


CORNERS = ((0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1))
AXES = (Y, Z, X, Y, Z, X)


def bricard() -> Mechanism:
    """Six rods and hinges in space, one of the 30 constraints redundant in every position."""
    m = Mechanism("bricard", gravity=(0.0, -G, 0.0))
    across = {Y: X, Z: X, X: Y}
    middles = [tuple((a + b) / 2 for a, b in zip(*ends, strict=True)) for ends in pairwise(CORNERS)]
    for k, (a, b) in enumerate(pairwise(CORNERS)):
        inertia = tuple(LIGHT if p != q else 1 / 12 for p, q in zip(a, b, strict=True))
        m.body(f"rod_{k}", 1.0, inertia)
    for k, (corner, axis) in enumerate(zip(CORNERS, AXES, strict=True)):
        ends = [f"rod_{i}" if 0 <= i < 5 else "ground" for i in (k - 1, k)]
        for body, i in zip(ends, (k - 1, k), strict=True):
            origin = middles[i] if body != "ground" else (0.0, 0.0, 0.0)
            at = tuple(float(c - o) for c, o in zip(corner, origin, strict=True))
            m.frame(f"{body}.hinge_{k}", at=at, z=axis, x=across[axis])
        m.joint(Revolute(f"q_{k}", *(f"{body}.hinge_{k}" for body in ends)))
    return m


def governor() -> Mechanism:
    """Two balls on rods that a turning shaft throws outwards; stiff springs lift a slider.

    Rods of 1 m with 1 kg and balls of 5 kg at their ends hang at 30 degrees on top of a shaft; the
    middle of each carries a spring of 8e5 N/m, 0.5 m long and damped with 4e4 N s/m, to a slider of
    3 kg that runs along the shaft. All turns at 2 pi rad/s at the start.
    """
    m = Mechanism("governor", gravity=(0.0, -G, 0.0))
    half = pi / 6
    m.body("shaft", 1.0, (0.01, 0.01, 0.01))
    m.frame("ground.axis", z=Y, x=X)
    m.frame("shaft.axis", z=Y, x=X)
    m.joint(Revolute("turn", "ground.axis", "shaft.axis", rate=2 * pi))
    m.body("slider", 3.0, (0.1, 0.1, 0.1))
    down = (0.0, -1.0, 0.0)
    m.frame("shaft.top", z=down, x=X)
    m.frame("slider.guide", z=down, x=X)
    m.joint(Prismatic("s", "shaft.top", "slider.guide", start=0.5 * 2 * 0.8660254037844386))
    for side, sign in (("left", -1.0), ("right", 1.0)):
        ball, rod = 5.0, 1.0
        mass, c = rod + ball, (0.5 * rod + ball) / (rod + ball)
        J = rod / 12 + rod * (0.5 - c) ** 2 + ball * (1 - c) ** 2
        m.body(side, mass, (LIGHT, J, J), com=(c, 0.0, 0.0))
        # turns about z from pointing down, outwards
        m.frame(f"shaft.{side}", z=(0.0, 0.0, sign), x=down)
        m.joint(Revolute(f"angle_{side}", f"shaft.{side}", side, start=half))
        m.frame(f"{side}.middle", at=(0.5, 0.0, 0.0))
        m.force(SpringDamper(f"strut_{side}", f"{side}.middle", "slider",
                             stiffness=8e5, free_length=0.5, damping=4e4))  # fmt: skip
    return m
