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


def recorded(model: RobotModel, seed: int, duration: float) -> Dataset:
    """Return a log at 1 kHz of random Fourier series of five harmonics of 0.1 Hz."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, duration, 1e-3)
    w = 0.2 * np.pi * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, 7))
    sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, v = sine @ (a / w[:, None]) - cosine @ (b / w[:, None]), cosine @ a + sine @ b
    qdd = (cosine * w) @ b - (sine * w) @ a
    size = np.minimum(2.2 / np.abs(q).max(axis=0), 1.8 / np.abs(v).max(axis=0))
    tau = model.torques(q * size, v * size, qdd * size)
    tau += COULOMB * np.sign(v) + VISCOUS * v * size + NOISE * rng.standard_normal(q.shape)
    columns = {f"j{k}": COUNT * np.rint(q[:, k - 1] * size[k - 1] / COUNT) for k in range(1, 8)}
    columns |= {f"j{k}_torque": tau[:, k - 1] for k in range(1, 8)}
    units = {name: "N m" if name.endswith("torque") else "rad" for name in columns}
    return Dataset.of({"t": t, **columns}, units=units, name=f"seed {seed}")


def by_hand(model: RobotModel, data: Dataset, rounds: int) -> Array:
    """Return Coulomb and viscous friction, (2, 7), by (iteratively weighted) least squares.

    Positions pass a zero-phase low pass of 10 Hz and central differences; every tenth sample is
    used, with its sign of the velocity.
    """
    record, n = data[0], 7
    q = np.column_stack([lowpass(record[f"j{k}"], 10.0, 1e-3) for k in range(1, 8)])
    v = np.gradient(q, 1e-3, axis=0)
    a = np.gradient(v, 1e-3, axis=0)
    q, v, a = (y[500:-500:10] for y in (q, v, a))
    each = [y[:, :, None] * np.eye(n) for y in (np.sign(v), v)]
    A = np.concatenate([model.inertial_columns(q, v, a), *each], axis=2)
    tau = np.column_stack([record[f"j{k}_torque"] for k in range(1, 8)])[500:-500:10]
    w, x = np.ones(n), np.zeros(A.shape[2])
    for _ in range(rounds):
        rows = (A * w[:, None]).reshape(-1, A.shape[2])
        x = np.linalg.lstsq(rows, (tau * w).ravel(), rcond=1e-10)[0]
        w = 1 / np.std(A @ x - tau, axis=0)
    return np.asarray(x[-2 * n :], np.float64).reshape(2, n)


def robot(quick: bool = False) -> Iterator[Found]:
    """Measure friction and torques of an arm with seven joints from 20 s at 1 kHz.

    The friction error is the root mean square of all relative errors of Coulomb and viscous
    friction. The reference is least squares by hand, ordinary and iteratively weighted. The torque
    error is that of another log, relative to the noise that remains after the filter.
    """
    urdf, truth = arm(), np.array([COULOMB, VISCOUS])
    model = RobotModel.read(urdf)
    seconds, ours, hand, inside = list[float](), list[float](), list[list[float]](), list[bool]()
    for seed in range(1 if quick else 5):
        data = recorded(model, seed, 20.0)
        start = process_time()
        fit = identify_robot(urdf, data)
        seconds.append(process_time() - start)
        rows = [[fit.friction[j][n] for j in model.names] for n in ("mu_d", "sigma_2")]
        found = np.array([[one.value for one in row] for row in rows])
        ours.append(_error(found, truth))
        hand.append([_error(by_hand(model, data, rounds), truth) for rounds in (1, 10)])
        for row, values in zip(rows, truth, strict=True):
            pairs = zip(row, values.tolist(), strict=True)
            inside += [(e.low or 0.0) <= x <= (e.high or 0.0) for e, x in pairs]
        errors = [100 * e.rms / NOISE for e in fit.validation.values()]
        yield goal(f"error of the torques, seed {seed} [% of the noise]", max(errors), 100.0)
    ordinary, weighted = np.mean(hand, axis=0).tolist()
    error = float(np.mean(ours))
    yield goal("friction error relative to ordinary least squares", error / ordinary, 1.0)
    yield goal("friction error relative to weighted least squares", error / weighted, 1.0)
    yield goal("friction inside the 95 % intervals", float(np.mean(inside)), 0.85, ">=")
    yield goal("processor time [s]", max(seconds), 5.0, seconds=sum(seconds))


def _error(found: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((found / truth - 1) ** 2)))
