"""Identification of a simulated arm with seven joints, compared with least squares by hand."""

from collections.abc import Iterator
from time import process_time

import numpy as np

from identification.data.dataset import Dataset
from identification.data.filters import lowpass
from identification.data.record import Array
from identification.robot.dynamics import RobotModel
from identification.robot.identify import identify_robot
from symfric.bench.report import Found, goal

MASSES = (5.0, 0.65, 3.2, 3.6, 1.2, 1.7, 0.7)
PLACES = ("0 0 .333", "0 0 0", "0 -.316 0", ".0825 0 0", "-.0825 .384 0", "0 0 0", ".088 0 0")
TURNS = (0.0, -1.5708, 1.5708, 1.5708, -1.5708, 1.5708, 1.5708)
COULOMB = np.array([0.55, 0.86, 0.63, 1.27, 0.84, 0.30, 0.42])
VISCOUS = np.array([0.25, 0.23, 0.17, 0.36, 0.40, 0.21, 0.22])
NOISE, COUNT = 0.05, 1e-5
"""Noise of the torques [N m], and resolution of the encoders [rad]."""


def arm() -> str:
    """Return a URDF with the kinematics of a usual light arm."""
    text, before = '<robot name="arm"><link name="base"/>', "base"
    for k, (mass, place, turn) in enumerate(zip(MASSES, PLACES, TURNS, strict=True), start=1):
        J = 0.01 * mass * np.array([1.0, 1.2, 0.8])
        text += (
            f'<link name="l{k}"><inertial><origin xyz="0.03 {0.02 * k:g} -0.04"/>'
            f'<mass value="{mass}"/><inertia ixx="{J[0]}" iyy="{J[1]}" izz="{J[2]}" ixy="0" '
            f'ixz="0" iyz="0"/></inertial></link><joint name="j{k}" type="revolute">'
            f'<parent link="{before}"/><child link="l{k}"/><origin xyz="{place}" rpy="{turn} 0 0"/>'
            '<axis xyz="0 0 1"/>'
            '<limit lower="-2.5" upper="2.5" velocity="2.2" effort="80"/></joint>'
        )
        before = f"l{k}"
    return f"{text}</robot>"


Motion = tuple[Array, Array, Array]


def motion(seed: int, t: Array) -> Motion:
    """Return a random Fourier series of five harmonics of 0.1 Hz, shape (N, 7) each."""
    rng, w = np.random.default_rng(seed), 0.2 * np.pi * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, 7))
    sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, v = sine @ (a / w[:, None]) - cosine @ (b / w[:, None]), cosine @ a + sine @ b
    size = np.minimum(2.2 / np.abs(q).max(axis=0), 1.8 / np.abs(v).max(axis=0))
    return q * size, v * size, ((cosine * w) @ b - (sine * w) @ a) * size


def recorded(model: RobotModel, seed: int, duration: float) -> Dataset:
    """Return a log at 1 kHz with noise of the torques and rounded positions."""
    t = np.arange(0.0, duration, 1e-3)
    q, v, a = motion(seed, t)
    tau = model.torques(q, v, a) + COULOMB * np.sign(v) + VISCOUS * v
    tau += NOISE * np.random.default_rng(100 + seed).standard_normal(q.shape)
    columns = {f"j{k}": COUNT * np.rint(q[:, k - 1] / COUNT) for k in range(1, 8)}
    columns |= {f"j{k}_torque": tau[:, k - 1] for k in range(1, 8)}
    units = {name: "N m" if name.endswith("torque") else "rad" for name in columns}
    return Dataset.of({"t": t, **columns}, units=units, name=f"seed {seed}")


def columns_of(model: RobotModel, q: Array, v: Array, a: Array) -> Array:
    """Return the columns of inertias, Coulomb and viscous friction, shape (N, 7, p)."""
    each = [y[:, :, None] * np.eye(7) for y in (np.sign(v), v)]
    return np.concatenate([model.inertial_columns(q, v, a), *each], axis=2)


def by_hand(model: RobotModel, data: Dataset, rounds: int) -> Array:
    """Return inertias and friction by (iteratively weighted) least squares, shape (p,).

    Positions pass a zero-phase low pass of 10 Hz and central differences; every tenth sample is
    used, with its sign of the velocity.
    """
    record, inner = data[0], slice(500, -500, 10)
    q = np.column_stack([lowpass(record[f"j{k}"], 10.0, 1e-3) for k in range(1, 8)])
    v = np.gradient(q, 1e-3, axis=0)
    A = columns_of(model, q[inner], v[inner], np.gradient(v, 1e-3, axis=0)[inner])
    tau = np.column_stack([record[f"j{k}_torque"] for k in range(1, 8)])[inner]
    w, x = np.ones(7), np.zeros(A.shape[2])
    for _ in range(rounds):
        rows = (A * w[:, None]).reshape(-1, A.shape[2])
        x = np.asarray(np.linalg.lstsq(rows, (tau * w).ravel(), rcond=1e-10)[0], np.float64)
        w = 1 / np.std(A @ x - tau, axis=0)
    return x


def robot(quick: bool = False) -> Iterator[Found]:
    """Measure friction and torques of an arm with seven joints from 20 s at 1 kHz.

    The friction error is the root mean square of all relative errors of Coulomb and viscous
    friction. The torque error is that of another motion without noise, relative to the noise of the
    log. The reference is least squares by hand, ordinary and iteratively weighted.
    """
    urdf, seconds, inside = arm(), list[float](), list[bool]()
    model = RobotModel.read(urdf)
    other = motion(1000, np.arange(0.0, 10.0, 0.02))
    truth = model.torques(*other) + COULOMB * np.sign(other[1]) + VISCOUS * other[1]
    friction, torques = list[list[float]](), list[list[float]]()
    for seed in range(1 if quick else 5):
        data = recorded(model, seed, 20.0)
        start = process_time()
        fit = identify_robot(urdf, data)
        seconds.append(process_time() - start)
        every = [fit.friction[j][n] for n in ("mu_d", "sigma_2") for j in model.names]
        for one, value in zip(every, (*COULOMB, *VISCOUS), strict=True):
            inside.append((one.low or 0.0) <= value <= (one.high or 0.0))
        found = [by_hand(model, data, rounds) for rounds in (1, 10)]
        levels = [np.array([one.value for one in every]), *(x[-14:] for x in found)]
        scale = np.append(COULOMB, VISCOUS)
        friction.append([_rms(x / scale - 1) for x in levels])
        each = [fit.torques(*other), *(columns_of(model, *other) @ x for x in found)]
        torques.append([_rms(tau - truth) for tau in each])
    for what, errors in (("friction", friction), ("torque", torques)):
        ours, *hand = np.mean(errors, axis=0).tolist()
        for name, error in zip(("ordinary", "weighted"), hand, strict=True):
            yield goal(f"{what} error relative to {name} least squares", ours / error, 1.0)
    worst = 100 * float(np.max(torques, axis=0)[0]) / NOISE
    yield goal("worst error of the torques [% of the noise]", worst, 100.0)
    yield goal("friction inside the 95 % intervals", float(np.mean(inside)), 0.85, ">=")
    yield goal("processor time of a fit [s]", max(seconds), 5.0, seconds=sum(seconds))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
