"""A robot with two revolute joints and a slide, its Newton-Euler equations, and simulated logs."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification import Dataset

Array = NDArray[np.float64]


class Link(NamedTuple):
    """Joint and link: origin in the previous link, axis, slide, mass, centre, principal moments."""

    joint: str
    at: tuple[float, float, float]
    axis: tuple[float, float, float]
    slides: bool
    mass: float
    com: tuple[float, float, float]
    J: tuple[float, float, float]
    limits: tuple[float, float, float, float]


LINKS = (
    Link("shoulder", (0, 0, 0.3), (0, 0, 1), False, 6.0, (0.02, 0.05, 0.1), (0.08, 0.07, 0.04),
         (-2.5, 2.5, 3.0, 60.0)),
    Link("elbow", (0.1, 0, 0.2), (0, 1, 0), False, 4.0, (0.15, 0.01, 0.0), (0.01, 0.05, 0.05),
         (-1.5, 1.5, 3.0, 60.0)),
    Link("slide", (0.3, 0, 0), (1, 0, 0), True, 2.0, (0.05, 0.0, 0.02), (0.004, 0.01, 0.01),
         (0.0, 0.5, 1.0, 200.0)),
)  # fmt: skip
TOOL = 0.5, (0.1, 0.0, -0.05)
"""Mass and place of a point mass that is fixed to the slide."""
COULOMB, VISCOUS, OFFSET = (
    np.array([1.2, 0.8, 5.0]),
    np.array([0.6, 0.4, 8.0]),
    np.array([0.1, 0, 1]),
)
NAMES = tuple(link.joint for link in LINKS)
FORCES = ("N m", "N m", "N")


def urdf(scale: float = 1.0, dynamics: str = "") -> str:
    """Return the robot as URDF, with inertias multiplied by a factor."""
    text, before = '<robot name="crane"><!-- kept --><link name="base"/>', "base"
    for link in LINKS:
        low, high, speed, effort = link.limits
        J = [scale * moment for moment in link.J]
        text += f"""
        <link name="{link.joint}_link"><inertial><origin xyz="{_text(link.com)}"/>
        <mass value="{scale * link.mass}"/><inertia ixx="{J[0]}" iyy="{J[1]}"
        izz="{J[2]}" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="{link.joint}" type="{"prismatic" if link.slides else "revolute"}">
        <parent link="{before}"/><child link="{link.joint}_link"/><origin xyz="{_text(link.at)}"/>
        <axis xyz="{_text(link.axis)}"/>{dynamics}
        <limit lower="{low}" upper="{high}" velocity="{speed}" effort="{effort}"/></joint>"""
        before = f"{link.joint}_link"
    mass, at = TOOL
    return f"""{text}<link name="tool"><inertial><mass value="{scale * mass}"/>
        <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="flange" type="fixed"><parent link="{before}"/><child link="tool"/>
        <origin xyz="{_text(at)}"/></joint></robot>"""


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(map(str, numbers))


def _turned(R: Array, axis: Array, angle: Array) -> Array:
    """Return R times rotations about an axis (Rodrigues), shape (N, 3, 3)."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return R @ (np.eye(3) + sine * K + (1 - cosine) * K @ K)


def newton_euler(q: Array, v: Array, a: Array) -> Array:
    """Return joint forces without friction by virtual work of all masses, shape (N, n)."""
    N = len(q)
    R, p, w, dw = (
        np.tile(np.eye(3), (N, 1, 1)),
        np.zeros((N, 3)),
        np.zeros((N, 3)),
        np.zeros((N, 3)),
    )
    ddp, axes, wrenches = np.tile([0.0, 0.0, 9.81], (N, 1)), list[Any](), list[Any]()

    def carried(r: Array) -> Array:
        return np.cross(dw, r) + np.cross(w, np.cross(w, r))

    for k, link in enumerate(LINKS):
        e, r = R @ np.array(link.axis, float), R @ np.array(link.at, float)
        ddp, p = ddp + carried(r), p + r
        axes.append((p, e, link.slides))
        along, rate, more = (e * y[:, [k]] for y in (q, v, a))
        if link.slides:
            ddp, p = ddp + carried(along) + 2 * np.cross(w, rate) + more, p + along
        else:
            dw, w = dw + more + np.cross(w, rate), w + rate
            R = _turned(R, np.array(link.axis, float), q[:, k])
        parts = [(link.mass, link.com, np.diag(link.J))]
        parts += [(*TOOL, np.zeros((3, 3)))] * (k == len(LINKS) - 1)
        for mass, com, J in parts:
            c, spin = R @ np.array(com, float), R @ J @ R.transpose(0, 2, 1)
            turn = np.einsum("nij,nj->ni", spin, dw) + np.cross(w, np.einsum("nij,nj->ni", spin, w))
            wrenches.append((k, p + c, mass * (ddp + carried(c)), turn))
    tau = np.zeros_like(q)
    for k, (at, e, slides) in enumerate(axes):
        for body, place, force, moment in wrenches:
            load = force if slides else moment + np.cross(place - at, force)
            tau[:, k] += np.sum(e * load, axis=1) * (body >= k)
    return tau


def waves(seed: int, t: Array, size: float = 0.8) -> tuple[Array, Array, Array]:
    """Return a smooth random motion within the limits, shape (N, n) each."""
    rng = np.random.default_rng(seed)
    w = 2 * np.pi * np.array([0.15, 0.3, 0.55, 0.8])
    phase, (q, v, a) = rng.uniform(0, 2 * np.pi, (3, 4)), np.zeros((3, t.size, 3))
    for k, link in enumerate(LINKS):
        low, high, *_ = link.limits
        half = size * (high - low) / 2
        for i in range(4):
            s = w[i] * t + phase[k, i]
            b = half * (0.4, 0.3, 0.2, 0.1)[i]
            q[:, k] += b * np.sin(s)
            v[:, k] += b * w[i] * np.cos(s)
            a[:, k] -= b * w[i] ** 2 * np.sin(s)
        q[:, k] += (low + high) / 2
    return q, v, a


def log(
    seed: int = 0, duration: float = 10.0, rate: float = 250.0, noise: float = 0.1,
    encoder: float = 0.0, colour: float = 0.0, **changed: Any,
) -> Dataset:  # fmt: skip
    """Return positions and torques; `changed` replaces or, by None, removes columns."""
    rng, t = np.random.default_rng(seed + 1000), np.arange(round(duration * rate)) / rate
    q, v, a = waves(seed, t)
    tau = newton_euler(q, v, a)
    tau += COULOMB * np.sign(v) + VISCOUS * v + OFFSET
    e = rng.standard_normal(tau.shape)
    tau += noise * lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], e, axis=0)
    if encoder:
        q = encoder * np.rint(q / encoder)
    columns: Mapping[str, Any] = {
        **dict(zip(NAMES, q.T, strict=True)),
        **{f"{name}_torque": y for name, y in zip(NAMES, tau.T, strict=True)},
        **changed,
    }
    signals = {name: y(t) if callable(y) else y for name, y in columns.items() if y is not None}
    units = {n: "m" if n == "slide" else "rad" for n in NAMES}
    units |= {f"{n}_torque": f for n, f in zip(NAMES, FORCES, strict=True)}
    known = {n: u for n, u in units.items() if n in signals}
    return Dataset.of({"t": t, **signals}, units=known, name=f"log {seed}")
