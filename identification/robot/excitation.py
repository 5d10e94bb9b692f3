"""Periodic motions of a robot that show its inertias and friction within its limits.

    q_j(t) = c_j + sum_l a_jl / (w l) sin(w l t) - b_jl / (w l) cos(w l t),   w = 2 pi / T

The motion starts and ends at rest, sum_l a_jl = sum_l l b_jl = 0, so it can be repeated. The
coefficients maximise log det of the information about base parameters, offsets, Coulomb and viscous
friction; rows are weighted by the largest torques.
Source: Swevers, Ganseman, Tukel, De Schutter and Van Brussel, IEEE Trans. Robotics 13(5), 1997.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, final

import casadi as ca
import numpy as np

from identification.data.record import Array
from identification.robot.base import base_of
from identification.robot.dynamics import RobotModel
from symfric.foundation import checks
from symfric.foundation.files import write_table
from symfric.foundation.shown import brief

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WHERE = "excitation"
SAMPLES = 12
"""Samples per harmonic at which limits hold and information is summed."""
MARGIN = 0.97
"""Part of each limit that the optimisation uses, because it is checked at samples only."""
CREEP = 0.05
"""Smoothing width of the sign of the velocity, relative to the largest velocity."""
RIDGE = 1e-9
"""Least information, relative to that of one column."""
HALVINGS = 60
"""Largest number of reductions by 10 %."""
GUESSES = 30
"""Number of random motions of which the best one is improved."""


@final
@dataclass(frozen=True, eq=False)
class Excitation:
    """Motion of n joints over one period, and its information.

    Attributes:
        joints, units: names and units of the coordinates.
        period: T [s].
        coefficients: c, a_1 ... a_H, b_1 ... b_H of each joint, shape (n, 1 + 2 H).
        torques: torques of the file's inertias at `times(100 / T)`, without friction.
        condition: condition number of the scaled regressor.
        gain: information relative to the best random motion, as the factor by which standard
            errors decrease on average (geometric mean).
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    period: float
    coefficients: Array
    condition: float
    gain: float

    __repr__ = brief

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at times t (N,), shape (N, n) each."""
        harmonics = (self.coefficients.shape[1] - 1) // 2
        return tuple(
            part @ self.coefficients.T for part in _waves(np.asarray(t), self.period, harmonics)
        )  # type: ignore[return-value]

    def to_csv(self, path: str | Path, rate: float = 1000.0, periods: int = 1) -> Path:
        """Write time, positions and velocities in SI units at `rate` [Hz].

        The names of the columns are those that `identify_robot` reads.
        """
        rate = checks.number(f"{WHERE}: rate", rate, unit="Hz", above=0.0)
        count = checks.count(f"{WHERE}: periods", periods)
        t = np.arange(round(count * self.period * rate) + 1) / rate
        q, v, _ = self.at(t)
        pairs = [*zip(self.joints, self.units, strict=True)]
        header = [
            "t [s]",
            *(f"{j} [{u}]" for j, u in pairs),
            *(f"{j}_velocity [{u}/s]" for j, u in pairs),
        ]
        write_table(path, header, np.column_stack([t, q, v]).tolist())
        return Path(path)

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot positions, velocities and accelerations over one period."""
        from symfric.foundation.panels import panels, save  # noqa: PLC0415 (slow to import)
        from symfric.foundation.style import line  # noqa: PLC0415 (slow to import)

        t = np.linspace(0.0, self.period, 400)
        figure, axes = panels(3, width=8.0)
        unit = " or ".join(dict.fromkeys(self.units))
        labels = (f"position [{unit}]", f"velocity [{unit}/s]", f"acceleration [{unit}/s^2]")
        for axis, part, label in zip(axes, self.at(t), labels, strict=True):
            for k, joint in enumerate(self.joints):
                axis.plot(t, part[:, k], label=joint, **line(k))
            axis.set_ylabel(label.replace(" or rad/s", "/s or rad/s"))
        axes[-1].set_xlabel("t [s]")
        axes[0].legend(loc="upper right", fontsize="small", ncols=4)
        return save(figure, path)


def excitation(
    urdf: str | Path,
    period: float = 20.0,
    *,
    harmonics: int = 5,
    acceleration: float | None = None,
    share: float = 1.0,
    seed: int = 0,
    iterations: int = 60,
) -> Excitation:
    """Return an informative motion within the limits of the URDF for position, speed and effort.

    Args:
        urdf: path of the file, or its content; its inertias determine the torques.
        period: T [s]; the fundamental frequency is 1 / T.
        harmonics: number H of harmonics.
        acceleration: largest acceleration [rad/s^2, m/s^2]; None: only effort limits it.
        share: part of the limits that the motion may use, 0 < share <= 1.
        seed: seed of the random start motions.
        iterations: largest number of iterations.

    Raises:
        ValueError: arguments out of range, mistakes of the file, a posture that needs more torque
            than the limits.

    Limits: the optimum is local. Collisions are not considered: check the motion before use, and
    reduce limits in the URDF. Missing limits are half a turn or 0.5 m, and no limit of the effort.
    """
    period = checks.number(f"{WHERE}: period", period, unit="s", above=0.0)
    H = checks.count(f"{WHERE}: harmonics", harmonics, least=2)
    share = checks.number(f"{WHERE}: share", share, above=0.0, upper=1.0)
    checks.count(f"{WHERE}: iterations", iterations)
    model = RobotModel.read(urdf)
    limits, count = _Limits.of(model, share, acceleration), SAMPLES * H
    waves = _waves(period * np.arange(count) / count, period, H)
    rows = _rows(model, limits)
    guess = _guess(model, waves, limits, rows, seed)
    found = _at_rest(_improved(model, waves, limits, rows, guess, iterations))
    fine = _waves(np.linspace(0.0, period, 40 * H), period, H)
    chosen = _inside(model, limits, found, fine)
    before, after = (_columns(rows, waves, each) for each in (guess, chosen))
    more = np.linalg.slogdet(after.T @ after)[1] - np.linalg.slogdet(before.T @ before)[1]
    return Excitation(
        model.names, model.units, period, chosen, float(np.linalg.cond(after / _sizes(after))),
        float(np.exp(more / (2 * after.shape[1]))),
    )  # fmt: skip


def _improved(
    model: RobotModel, waves: Sequence[Array], limits: "_Limits", rows: ca.Function, guess: Array,
    iterations: int,
) -> Array:  # fmt: skip
    """Return coefficients with more information, found by Ipopt from a guess."""
    A, count = _columns(rows, waves, guess), len(waves[0])
    size = _sizes(A)
    gram = (A / size).T @ (A / size) + RIDGE * np.eye(size.size)
    whiten = np.linalg.inv(np.linalg.cholesky(gram)) / size
    c = ca.MX.sym("c", *guess.shape)
    q, v, a = (ca.mtimes(c, ca.DM(part.T)) for part in waves)
    X = ca.mtimes(ca.DM(whiten), ca.reshape(rows.map(count)(q, v, a), size.size, -1))
    information = ca.log(ca.det(ca.mtimes(X, X.T))) / size.size
    tau = _torques(model).map(count)(q, v, a)
    held, pairs = list[ca.MX](), ((q - ca.DM(limits.middle), limits.half), (v, limits.speed),
                                  (a, limits.acceleration), (tau, limits.effort))  # fmt: skip
    for signal, most in pairs:
        finite = np.flatnonzero(np.isfinite(most)).tolist()
        if finite:
            held.append(ca.vec(signal[finite, :] / ca.DM(most[finite])))
    ends = ca.vec(ca.mtimes(c, ca.DM(_rest(guess.shape[1] // 2))))
    g = ca.vertcat(*held, ends)
    bound = np.append(np.ones(g.numel() - ends.numel()), np.zeros(ends.numel()))
    options = {
        "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-3,
        "ipopt.max_iter": iterations, "ipopt.hessian_approximation": "limited-memory",
    }  # fmt: skip
    problem = {"x": ca.vec(c), "f": -information, "g": g}
    solver = ca.nlpsol("excitation", "ipopt", problem, options)
    found = solver(x0=guess.ravel(order="F"), lbg=-bound, ubg=bound)
    return np.asarray(found["x"]).reshape(guess.shape, order="F")


class _Limits(NamedTuple):
    """Limits of all joints with a margin, shape (n,) each; infinite without one."""

    middle: Array
    half: Array
    speed: Array
    acceleration: Array
    effort: Array

    @classmethod
    def of(cls, model: RobotModel, share: float, acceleration: float | None) -> "_Limits":
        """Return the part `share` of the limits of the file."""
        where = f"{WHERE}: acceleration"
        most = inf if acceleration is None else checks.number(where, acceleration, above=0.0)
        (low, high), part = model.span, MARGIN * share
        speed, effort = (part * model.limits(key) for key in ("velocity", "effort"))
        fastest = np.full(low.size, share * most)
        return cls((low + high) / 2, part * (high - low) / 2, speed, fastest, effort)


def _waves(t: Array, period: float, harmonics: int) -> tuple[Array, Array, Array]:
    """Return q, q' and q'' of unit coefficients at times t (N,), shape (N, 1 + 2 H) each."""
    w = 2 * np.pi / period * np.arange(1, harmonics + 1)
    sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    one, none = np.ones((t.size, 1)), np.zeros((t.size, 1))
    acceleration: Array = np.hstack([none, -w * sine, w * cosine]).astype(np.float64)
    return np.hstack([one, sine / w, -cosine / w]), np.hstack([none, cosine, sine]), acceleration


def _rest(harmonics: int) -> Array:
    """Return two columns whose products with the coefficients vanish at rest, (1 + 2 H, 2)."""
    found = np.zeros((1 + 2 * harmonics, 2))
    found[1 : harmonics + 1, 0] = 1.0
    found[harmonics + 1 :, 1] = np.arange(1, harmonics + 1)
    return found


def _at_rest(coefficients: Array) -> Array:
    """Return the nearest coefficients that start and end at rest."""
    B = _rest((coefficients.shape[1] - 1) // 2)
    return coefficients - coefficients @ B @ np.linalg.pinv(B)


def _torques(model: RobotModel) -> ca.Function:
    """Return the function (q, qd, qdd) -> torques of the inertias of the file."""
    motion = [ca.SX.sym(name, len(model.joints)) for name in ("q", "qd", "qdd")]
    return ca.Function("tau", motion, [model.regressor(*motion) @ ca.DM(model.pi)])


def _rows(model: RobotModel, limits: _Limits) -> ca.Function:
    """Return the function (q, qd, qdd) -> weighted columns of the torques, shape (p, n)."""
    n, chosen = len(model.joints), base_of(model, False).chosen
    q, v, a = (ca.SX.sym(name, n) for name in ("q", "qd", "qdd"))
    usual = np.std(model.torques(*model.random_motion(GUESSES)), axis=0)
    weight = 1 / np.where(np.isfinite(limits.effort), limits.effort, np.maximum(usual, 1e-9))
    creep = CREEP * np.where(np.isfinite(limits.speed), limits.speed, limits.half)
    friction = [ca.diag(ca.tanh(v / ca.DM(creep))), ca.diag(v), ca.SX.eye(n)]
    Y = ca.horzcat(model.regressor(q, v, a)[:, list(chosen)], *friction)
    return ca.Function("rows", [q, v, a], [ca.densify((ca.diag(ca.DM(weight)) @ Y).T)])


def _columns(rows: ca.Function, waves: Sequence[Array], coefficients: Array) -> Array:
    """Return the weighted columns over all samples and joints, shape (N n, p)."""
    q, v, a = (coefficients @ part.T for part in waves)
    return rows.map(q.shape[1])(q, v, a).full().T


def _sizes(A: Array) -> Array:
    size = np.linalg.norm(A, axis=0)
    return np.where(size > 0, size, 1.0)


def _guess(
    model: RobotModel, waves: Sequence[Array], limits: _Limits, rows: ca.Function, seed: int
) -> Array:
    """Return the random motion within the limits that has the most information."""
    rng, n, width = np.random.default_rng(seed), len(model.joints), waves[0].shape[1]
    best, most = np.zeros((n, width)), -inf
    for _ in range(GUESSES):
        found = _at_rest(rng.normal(size=best.shape))
        q = waves[0][:, 1:] @ found[:, 1:].T
        found[:, 0] = limits.middle - (q.max(axis=0) + q.min(axis=0)) / 2
        found = _inside(model, limits, found, waves, fill=True)
        A = _columns(rows, waves, found)
        gram = A.T @ A / np.outer(_sizes(A), _sizes(A)) + RIDGE * np.eye(A.shape[1])
        information = float(np.linalg.slogdet(gram)[1] + 2 * np.sum(np.log(_sizes(A))))
        if information > most:
            best, most = found, information
    return best


def _inside(
    model: RobotModel, limits: _Limits, coefficients: Array, waves: Sequence[Array],
    *, fill: bool = False,
) -> Array:  # fmt: skip
    """Return a motion scaled about the middle of its limits, so that it satisfies them.

    Args:
        model, limits: the robot.
        coefficients: the motion, shape (n, 1 + 2 H).
        waves: unit motions at the times at which limits are checked.
        fill: enlarge smaller motions, too.

    Raises:
        ValueError: the torques of standstill exceed the limits of the effort.
    """
    centre = limits.middle[:, None] * np.eye(1, coefficients.shape[1])
    c = coefficients - centre
    signals = (np.abs(part @ c.T).max(axis=0) for part in waves)
    pairs = zip(signals, (limits.half, limits.speed, limits.acceleration), strict=True)
    size = np.max([most_of / limit for most_of, limit in pairs], axis=0)
    c = c / (size if fill else np.maximum(size, 1.0))[:, None]
    large = np.zeros(len(c), dtype=np.bool_)
    for _ in range(HALVINGS):
        tau = model.torques(*(part @ (c + centre).T for part in waves))
        large = np.abs(tau).max(axis=0) > limits.effort / MARGIN
        if not large.any():
            return c + centre
        c = 0.9 * c
    lacking = ", ".join(np.array(model.names)[large])
    raise ValueError(
        f"{WHERE}: expected efforts that carry the robot in the middle of its range, got too small "
        f"ones of {lacking}"
    )
