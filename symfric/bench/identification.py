"""Identification with goals: convergence to the true parameters, admissible starts, and cost."""

import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from identification import Dataset, Fit, Fitted, InverseDynamics, identify_robot, lowpass
from identification.robot.dynamics import RobotModel
from symfric.bench.identification_files import File, campaign
from symfric.bench.identification_measured import emps, franka
from symfric.bench.identification_online import online
from symfric.bench.identification_simulated import gms, lugre, starts, velocity
from symfric.bench.identification_verdicts import TITLE, draw, verdicts
from symfric.bench.report import Found, Progress, Report, goal, timed
from symfric.foundation.numeric import Array
from symfric.foundation.status import SolveError

TRUTH = {"m": 95.0, "offset": -3.0, "mu_s": 28.0, "mu_d": 20.0, "v_s": 0.01, "sigma_2": 200.0}
"""Parameters of the stage of `identification_files`."""
CLOSE = 0.05
"""Largest relative error of a parameter that counts as right."""
EVERY = 12
"""Quick runs read every twelfth file."""


def outcome(file: File) -> str:
    """Return the outcome of reading, checking and fitting one file, see `files`."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        path = Path(folder) / f"log{file.suffix}"
        path.write_bytes(file.content)
        try:
            return _judged(Dataset.read(path, **file.options))
        except (ValueError, SolveError):
            return "refused"
        except Exception:  # noqa: BLE001  (any error is counted)
            return "crashed"


def _judged(data: Dataset) -> str:
    findings = data.check()
    if findings.errors:
        return "refused"
    if {"gap", "irregular"} & set(findings.kinds):  # the findings advise it
        data = data.resampled()
    fit = Fit(InverseDynamics(), "stribeck", data).solve()
    if not fit.verdict.good:
        return "flagged"
    if all(_is_close(fit, name) for name in TRUTH):
        return "right"
    return "flagged" if findings.warnings else "silent"


def _is_close(fit: Fitted, name: str) -> bool:
    """Return True if a parameter is right or if its interval includes the true value."""
    estimate = fit.parameters[name]
    error = abs(estimate.value - TRUTH[name])
    low, high = estimate.low, estimate.high
    inside = low is not None and high is not None and low <= TRUTH[name] <= high
    return error <= CLOSE * abs(TRUTH[name]) or inside


def files(quick: bool = False) -> Iterator[Found]:
    """Measure silent errors and crashes on damaged files, and right results on intact files.

    Each file of `identification_files` is read, checked and fitted by inverse dynamics with a
    Stribeck law and default settings. Its outcome is one of

        refused   the reader, the fit or the status explains why there is no result,
        flagged   the result has a warning about the data or the residuals,
        right     every parameter is within 5 % of the truth, or its 95 % interval includes it,
        silent    the result is wrong and has no warning,
        crashed   there is an error without an explanation.

    All good files must be right, and no bad file may be silent. Files whose defects leave no trace
    are counted separately.
    """
    chosen = [*campaign()][:: EVERY if quick else 1]
    seconds, kinds = timed(lambda: [outcome(file) for file in chosen])
    found = [(file.name, file.truth, kind) for file, kind in zip(chosen, kinds, strict=True)]
    counts = Counter((truth, kind) for _, truth, kind in found)
    total = Counter(file.truth for file in chosen)
    silent = [name for name, *both in found if both == ["bad", "silent"]]
    note = f"{total['bad']} bad: {counts['bad', 'refused']} refused, {counts['bad', 'flagged']} "
    note = "; ".join([note + f"flagged, {counts['bad', 'right']} right", *silent])
    yield goal("bad files with a wrong result and no warning", len(silent), 0, "<=", seconds, note)
    lost = ", ".join(name for name, truth, kind in found if truth == "good" and kind != "right")
    share = counts["good", "right"] / max(total["good"], 1)
    yield goal("fraction of good files with a right result", share, 1.0, ">=", note=lost)
    crashed = [name for name, _, kind in found if kind == "crashed"]
    yield goal("crashes", len(crashed), 0, note=", ".join(crashed))
    note = f"{total['hidden']} with defects that the file cannot reveal"
    yield goal("files", len(found), 10 if quick else 100, ">=", note=note)


# ---- processor time and memory by the number of samples ----

STEP, MASS, LEVEL, PEAK, VISCOSITY, FORCE_NOISE = 1e-3, 2.0, 5.0, 2.0, 3.0, 0.05
"""Step [s], mass [kg], Coulomb level, Stribeck peak at 0.02 m/s and noise of the force [N], viscous
coefficient [N s/m]."""
SIZES = (10_000, 100_000, 1_000_000)
LENGTHS = "Processor time and memory by samples"
GOALS = {"check": 0.2, "linear": 1.0, "nonlinear": 10.0}
"""Processor time for 1e6 samples [s]."""


def stage(n: int, peak: float = 0.0) -> Dataset:
    """Return a record of n samples of a drive with position, velocity and noisy force."""
    t = STEP * np.arange(n)
    x, v, a = np.zeros((3, n))
    for w, size in ((np.pi, 0.05), (3.1 * np.pi, 0.02)):
        x += size * np.sin(w * t)
        v += size * w * np.cos(w * t)
        a -= size * w**2 * np.sin(w * t)
    force = MASS * a + (LEVEL + peak * np.exp(-((v / 0.02) ** 2))) * np.sign(v) + VISCOSITY * v
    force += FORCE_NOISE * np.random.default_rng(0).standard_normal(n)
    return Dataset.of(t=t, x=x, v=v, force=force)


def length(quick: bool) -> Iterator[Found]:
    """Measure reading, checks, and fits of laws that are linear in their parameters and not.

    Fits are by inverse dynamics with default settings. A small fit before loads all libraries.
    """
    for n in SIZES[: 1 if quick else 3]:
        found = measured(n)
        yield LENGTHS, {"samples": float(n), **found}
        for name, limit in GOALS.items() if n == SIZES[-1] else ():
            yield goal(f"{name}, {n} samples, s", found[f"{name} [s]"], limit)


def measured(n: int) -> dict[str, float]:
    """Return processor times [s], and the largest memory of the process until the first fit."""
    import resource  # noqa: PLC0415  (absent on Windows)

    kind, found = InverseDynamics(), dict[str, float]()
    with tempfile.TemporaryDirectory() as folder:
        (path,) = stage(n).to_csv(Path(folder) / "run.csv")
        found["read [s]"], data = timed(partial(Dataset.read, path))
    for law, some, name in (
        ("coulomb+viscous", data, "linear"), ("stribeck", stage(n, PEAK), "nonlinear")
    ):  # fmt: skip
        Fit(kind, law, some.between(0.0, 5.0)).solve(throw=False)
        found[f"{name} [s]"], _ = timed(partial(Fit(kind, law, some).solve, throw=False))
        if name == "linear":
            found["check [s]"], _ = timed(data.check)
            found["memory [MB]"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found


# ---- a simulated arm with seven joints, compared with least squares by hand ----

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


# ---- all cases ----

CASES: Mapping[str, Callable[[bool], Iterator[Found]]] = {
    "lugre": lugre,
    "verdicts": verdicts,
    "velocity": velocity,
    "emps": emps,
    "franka": franka,
    "starts": starts,
    "gms": gms,
    "files": files,
    "length": length,
    "robot": robot,
    "online": online,
}


def bench(quick: bool = False, progress: Progress = None) -> Report:
    """Measure all `CASES`; with `quick`, use fewer seeds."""
    tasks = {case: partial(_named, case, quick) for case in CASES}
    return Report((TITLE, draw)).collect(tasks, progress)


def _named(case: str, quick: bool) -> Iterator[Found]:
    """Yield the rows of a case, with its name in the first column."""
    for item in CASES[case](quick):
        yield item if isinstance(item, str) else (item[0], {"case": case, **item[1]})
