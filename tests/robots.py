"""Robots for tests: URDF texts with random numbers, by seed."""

import numpy as np

MOVING = ("revolute", "continuous", "prismatic")
SMALL = """<robot name="small">
  <link name="world"/>
  <joint name="hinge" type="revolute">
    <parent link="world"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <dynamics damping="0.3" friction="0.2"/>
  </joint>
  <link name="arm"><inertial>
    <origin xyz="0 0 -0.25"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>
</robot>"""
"""A rod on a hinge with friction and damping."""


def rod(**changes: str) -> str:
    """The rod with some of its text replaced."""
    text = SMALL
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    return text


def numbers(values: object) -> str:
    """Texts that read back as the same numbers."""
    return " ".join(repr(float(x)) for x in np.atleast_1d(np.asarray(values)))


def inertial(rng: np.random.Generator) -> str:
    """A body of 0.5 to 3 kg with a full inertia, turned and shifted."""
    A = rng.normal(size=(3, 3)) * 0.3
    spread = A @ A.T + 0.01 * np.eye(3)
    J = np.trace(spread) * np.eye(3) - spread
    keys = {
        "ixx": (0, 0),
        "iyy": (1, 1),
        "izz": (2, 2),
        "ixy": (0, 1),
        "ixz": (0, 2),
        "iyz": (1, 2),
    }
    entries = " ".join(f'{key}="{numbers(J[at])}"' for key, at in keys.items())
    return (
        f'<inertial><origin xyz="{numbers(rng.normal(size=3) * 0.2)}" '
        f'rpy="{numbers(rng.uniform(-3, 3, 3))}"/><mass value="{numbers(rng.uniform(0.5, 3))}"/>'
        f"<inertia {entries}/></inertial>"
    )


def joint(rng: np.random.Generator, i: int, parent: int, kind: str, dynamics: str = "") -> str:
    """Joint j<i> of link l<i> on link l<parent>, anywhere and along any axis."""
    axis = rng.normal(size=3)
    turn = numbers(rng.uniform(-3, 3, 3))
    return (
        f'<joint name="j{i}" type="{kind}"><parent link="l{parent}"/><child link="l{i}"/>'
        f'<origin xyz="{numbers(rng.normal(size=3) * 0.4)}" rpy="{turn}"/>'
        f'<axis xyz="{numbers(axis / np.linalg.norm(axis))}"/>{dynamics}</joint>'
    )


def random_robot(seed: int, n: int, kinds: tuple[str, ...] = (*MOVING, "fixed")) -> str:
    """A tree of n links on a massless world; every joint has damping, friction or none.

    The first joint moves, the second is fixed, the third branches off the first link; the others
    hang anywhere. Links that are fixed to others may be massless.
    """
    rng = np.random.default_rng(seed)
    parts = ['<link name="l0"/>']
    for i in range(1, n + 1):
        kind = {1: kinds[0], 2: "fixed"}.get(i, str(rng.choice(kinds)))
        parent = {1: 0, 3: 1}.get(i, int(rng.integers(0, i)))
        levels = rng.uniform(0.1, 1, 2) * rng.integers(0, 2, 2)
        tag = f'<dynamics damping="{numbers(levels[0])}" friction="{numbers(levels[1])}"/>'
        weight = "" if kind == "fixed" and rng.random() < 0.3 else inertial(rng)
        parts += [joint(rng, i, parent, kind, tag if kind in MOVING else "")]
        parts += [f'<link name="l{i}">{weight}</link>']
    order = rng.permutation(len(parts))
    return f'<robot name="r{seed}">{"".join(parts[k] for k in order)}</robot>'
