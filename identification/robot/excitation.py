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
ITERATIONS = 60
"""Largest number of iterations."""
UNITS = ("", "/s", "/s^2")
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
        condition: condition number of the scaled regressor.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    period: float
    coefficients: Array
    condition: float

    __repr__ = brief

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at times t (N,), shape (N, n) each."""
        q, v, a = _waves(t, self.period, self.coefficients.shape[1] // 2)
        return q @ self.coefficients.T, v @ self.coefficients.T, a @ self.coefficients.T

    def to_csv(self, path: str | Path, rate: float = 1000.0, periods: int = 1) -> Path:
        """Write time, positions and velocities in SI units at `rate` [Hz].

        The names of the columns are those that `identify_robot` reads.
        """
        rate = checks.number(f"{WHERE}: rate", rate, unit="Hz", above=0.0)
        count = checks.count(f"{WHERE}: periods", periods)
        t = np.arange(round(count * self.period * rate) + 1) / rate
        q, v, _ = self.at(t)
        pairs = [*zip(self.joints, self.units, strict=True)]
        header = ["t [s]", *(f"{joint} [{unit}]" for joint, unit in pairs)]
        header += [f"{joint}_velocity [{unit}/s]" for joint, unit in pairs]
        write_table(path, header, np.column_stack([t, q, v]).tolist())
        return Path(path)

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Plot positions, velocities and accelerations over one period."""
        from symfric.foundation.panels import panels, save  # noqa: PLC0415 (slow to import)
        from symfric.foundation.style import line  # noqa: PLC0415 (slow to import)

        t = np.linspace(0.0, self.period, 400)
        figure, axes = panels(3, width=8.0)
        unit = " or ".join(dict.fromkeys(self.units))
        labels = ("position", "velocity", "acceleration")
        for axis, part, label, per in zip(axes, self.at(t), labels, UNITS, strict=True):
            for k, joint in enumerate(self.joints):
                axis.plot(t, part[:, k], label=joint, **line(k))
            axis.set_ylabel(f"{label} [{unit}{per}]")
        axes[-1].set_xlabel("t [s]")
        axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize="small", ncols=7)
        return save(figure, path)


def excitation(
    urdf: str | Path,
    period: float = 20.0,
    *,
    harmonics: int = 5,
    acceleration: float | None = None,
    share: float = 1.0,
    seed: int = 0,
) -> Excitation:
    """Return an informative motion within the limits of the URDF for position, speed and effort.

    Args:
        urdf: path of the file, or its content; its inertias determine the torques.
        period: T [s]; the fundamental frequency is 1 / T.
        harmonics: number H of harmonics.
        acceleration: largest acceleration [rad/s^2, m/s^2]; None: only effort limits it.
        share: part of the limits that the motion may use, 0 < share <= 1.
        seed: seed of the random start motions.

    Raises:
        ValueError: arguments out of range, mistakes of the file, a posture that needs more torque
            than the limits.

    Limits: the optimum is local. Collisions are not considered: check the motion before use, and
    reduce limits in the URDF. Missing limits are half a turn or 0.5 m, and no limit of the effort.
    """
    period = checks.number(f"{WHERE}: period", period, unit="s", above=0.0)
    H = checks.count(f"{WHERE}: harmonics", harmonics, least=2)
    share = checks.number(f"{WHERE}: share", share, above=0.0, upper=1.0)
    where = f"{WHERE}: acceleration"
    most = inf if acceleration is None else checks.number(where, acceleration, above=0.0)
    model = RobotModel.read(urdf)
    low, high = model.span
    limits = [(high - low) / 2, model.limits("velocity"), np.full(low.size, most)]
    limits = [MARGIN * share * limit for limit in (*limits, model.limits("effort"))]
    task = _Task(model, (low + high) / 2, limits, _rows(model, limits), period, H)
    guess = task.guess(seed, np.linspace(0.0, period, SAMPLES * H, endpoint=False))
    chosen = task.inside(task.improved(guess), np.linspace(0.0, period, 4 * SAMPLES * H))
    columns = task.columns(chosen)
    condition = float(np.linalg.cond(columns / _sizes(columns)))
    return Excitation(model.names, model.units, period, chosen, condition)


class _Task(NamedTuple):
    """Search of coefficients c, a, b, shape (n, 1 + 2 H).

    Attributes:
        model: the robot.
        middle: middle positions, shape (n,).
        limits: limits of position about the middle, velocity, acceleration, effort, (n,) each.
        rows: CasADi function (q, qd, qdd) -> weighted columns (p, n), torques (n,).
        period, harmonics: T [s] and H.
    """

    model: RobotModel
    middle: Array
    limits: Sequence[Array]
    rows: ca.Function
    period: float
    harmonics: int

    @property
    def waves(self) -> tuple[Array, Array, Array]:
        """Unit motions at the samples of the optimisation."""
        t = np.linspace(0.0, self.period, SAMPLES * self.harmonics, endpoint=False)
        return _waves(t, self.period, self.harmonics)

    def columns(self, c: Array) -> Array:
        """Return the weighted columns over all samples and joints, shape (N n, p)."""
        q, v, a = (c @ part.T for part in self.waves)
        return self.rows.map(q.shape[1])(q, v, a)[0].full().T

    def guess(self, seed: int, t: Array) -> Array:
        """Return the random motion within the limits that has the most information."""
        rng, shape = np.random.default_rng(seed), (self.middle.size, 2 * self.harmonics - 1)
        basis, found = _at_rest(self.harmonics), list[Array]()
        for _ in range(GUESSES):
            c = rng.normal(size=shape) @ basis.T
            q = self.waves[0] @ c.T
            c[:, 0] += self.middle - (q.max(axis=0) + q.min(axis=0)) / 2
            found.append(self.inside(c, t, fill=True))
        return max(found, key=lambda c: _information(self.columns(c)))

    def improved(self, guess: Array) -> Array:
        """Return coefficients with more information, found by Ipopt."""
        start = self.columns(guess)
        scaled = start / _sizes(start)
        gram = scaled.T @ scaled + RIDGE * np.eye(scaled.shape[1])
        whiten = np.linalg.inv(np.linalg.cholesky(gram)) / _sizes(start)
        basis = _at_rest(self.harmonics)
        z = ca.MX.sym("z", guess.shape[0], basis.shape[1])
        q, v, a = (ca.mtimes(z, ca.DM((part @ basis).T)) for part in self.waves)
        columns, tau = self.rows.map(q.shape[1])(q, v, a)
        white = ca.mtimes(ca.DM(whiten), ca.reshape(columns, whiten.shape[0], -1))
        information = ca.log(ca.det(ca.mtimes(white, white.T))) / whiten.shape[0]
        held = list[ca.MX]()
        for signal, most in zip((q - ca.DM(self.middle), v, a, tau), self.limits, strict=True):
            finite = np.flatnonzero(np.isfinite(most)).tolist()
            held += [ca.vec(signal[finite, :] / ca.DM(most[finite]))] if finite else []
        options = {
            "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-3,
            "ipopt.max_iter": ITERATIONS, "ipopt.hessian_approximation": "limited-memory",
        }  # fmt: skip
        problem = {"x": ca.vec(z), "f": -information, "g": ca.vertcat(*held)}
        solver = ca.nlpsol("excitation", "ipopt", problem, options)
        found = solver(x0=(guess @ basis).ravel(order="F"), lbg=-1.0, ubg=1.0)
        return np.asarray(found["x"]).reshape(z.shape, order="F") @ basis.T

    def inside(self, c: Array, t: Array, *, fill: bool = False) -> Array:
        """Return a motion scaled about the middle until it is within the limits at times t.

        With `fill`, smaller motions are enlarged.

        Raises:
            ValueError: the torques of standstill exceed the limits of the effort.
        """
        waves = _waves(t, self.period, self.harmonics)
        centre = self.middle[:, None] * np.eye(1, c.shape[1])
        c = c - centre
        pairs = zip(waves, self.limits[:3], strict=True)
        size = np.max([np.abs(part @ c.T).max(axis=0) / limit for part, limit in pairs], axis=0)
        c, large = c / (size if fill else np.maximum(size, 1.0))[:, None], np.zeros(0)
        for _ in range(HALVINGS):
            tau = self.model.torques(*(part @ (c + centre).T for part in waves))
            large = np.abs(tau).max(axis=0) > self.limits[3] / MARGIN
            if not large.any():
                return c + centre
            c = 0.9 * c
        lacking = [name for name, on in zip(self.model.names, large, strict=True) if on]
        raise ValueError(
            f"{WHERE}: expected efforts that carry the robot in the middle of its range, got too "
            f"small ones of {', '.join(lacking)}"
        )


def _waves(t: Array, period: float, harmonics: int) -> tuple[Array, Array, Array]:
    """Return q, q' and q'' of unit coefficients at times t (N,), shape (N, 1 + 2 H) each."""
    w = 2 * np.pi / period * np.arange(1.0, harmonics + 1)
    sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    none = np.zeros((len(sine), 1))
    a: Array = np.hstack([none, -w * sine, w * cosine])
    return np.hstack([none + 1, sine / w, -cosine / w]), np.hstack([none, cosine, sine]), a


def _at_rest(harmonics: int) -> Array:
    """Return a basis of coefficients that start and end at rest, shape (1 + 2 H, 2 H - 1)."""
    none = np.zeros(harmonics)
    ends = np.array([[0, *(none + 1), *none], [0, *none, *np.arange(1, harmonics + 1)]])
    return np.linalg.svd(ends)[2][2:].T


def _rows(model: RobotModel, limits: Sequence[Array]) -> ca.Function:
    """Return the function (q, qd, qdd) -> weighted columns (p, n), torques of the file (n,)."""
    n, (half, speed, _, effort) = len(model.joints), limits
    motion = [ca.SX.sym(name, n) for name in ("q", "qd", "qdd")]
    every, v = model.regressor(*motion), motion[1]
    usual = np.std(model.torques(*model.random_motion(GUESSES)), axis=0)
    weight = 1 / np.where(np.isfinite(effort), effort, np.maximum(usual, 1e-9))
    creep = CREEP * np.where(np.isfinite(speed), speed, half)
    friction = [ca.diag(ca.tanh(v / ca.DM(creep))), ca.diag(v), ca.SX.eye(n)]
    columns = ca.horzcat(every[:, list(base_of(model, False).chosen)], *friction)
    weighted = ca.densify((ca.diag(ca.DM(weight)) @ columns).T)
    return ca.Function("rows", motion, [weighted, every @ ca.DM(model.pi)])


def _sizes(columns: Array) -> Array:
    size = np.linalg.norm(columns, axis=0)
    return np.where(size > 0, size, 1.0)


def _information(columns: Array) -> float:
    """Return log det of the information, at least `RIDGE` for each scaled column."""
    size = _sizes(columns)
    gram = columns.T @ columns / np.outer(size, size) + RIDGE * np.eye(size.size)
    return float(np.linalg.slogdet(gram)[1] + 2 * np.sum(np.log(size)))
