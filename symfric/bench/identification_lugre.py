"""LuGre, six parameters, from positions with 0.5 um of noise, beside single shooting with cvodes.

A mass of 1 kg is driven by a force that is held for each millisecond: pre-sliding, break-away with
reversals, gross sliding; three records, 2600 samples. Each seed has other noise. Its start comes
from a noisy velocity sweep (levels, Stribeck velocity, viscous part; force noise 0.05 N); stiffness
and damping of the bristles are off by factors of up to 3 about a value that is itself too low.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from time import process_time
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from symfric.bench.identification import Row
from symfric.foundation.status import Status
from symfric.integrator import Hold, simulate
from symfric.laws import LuGre
from symfric.scenes import Drive

Array = NDArray[np.float64]

TRUTH = {
    "mu_s": 1.5, "mu_d": 1.0, "v_s": 1e-3,
    "sigma_0": 1e5, "sigma_1": float(np.sqrt(1e5)), "sigma_2": 0.4,
}  # fmt: skip
NOISE, SWEEP_NOISE = 0.5e-6, 0.05
"""Standard deviations of the positions [m] and of the forces of the sweep [N]."""
STEP = 1e-3
OFF = 3.0
"""Largest factor by which stiffness and damping of the start are off their guess."""
GUESS = 3.8e4
"""Stiffness about which starts scatter [N/m]."""
SCALES = np.array([1e-4, 1e-2, 1e-5])
"""Of position, velocity and bristle, for the error control of cvodes."""
REST = {"x": 0.0, "v": 0.0, "z": 0.0}
SEEDS, AGAINST = 100, 4
"""Noise seeds, and those on which cvodes runs as well."""


def forces() -> list[tuple[Array, Array]]:
    """Times [s] and forces [N] of the three records."""
    t1, t = np.arange(0, 0.6, STEP), np.arange(0, 1.0, STEP)
    rising = 0.4 + 0.6 * t1 / t1[-1]
    first = 1.05 * np.sin(10 * np.pi * t1) * rising + 0.2 * np.sin(74 * np.pi * t1)
    second = np.interp(t, [0, 0.3, 0.5, 0.7, 1.0], [0, 1.7, 1.2, -1.9, 0.0])
    third = 2.5 * np.sin(4 * np.pi * t) + 0.5 * np.sin(22 * np.pi * t)
    return [(t1, first), (t, second), (t, third)]


@lru_cache(maxsize=1)
def positions() -> tuple[Array, ...]:
    """The true positions [m] of the three records."""
    model = Drive(LuGre(**TRUTH), m=1.0, N=1.0).model()
    return tuple(
        simulate(model, float(t[-1]), x0=REST, u={"force": Hold(t, u)}, t_eval=t, rtol=1e-10)["x"]
        for t, u in forces()
    )


@final
@dataclass(frozen=True, eq=False)
class Case:
    """Data of one noise seed and where the fit starts."""

    data: Dataset
    start: dict[str, float]

    def fit(self) -> Fit:
        """The question of the six parameters; mass and offset are known."""
        machine = Drive(LuGre(**TRUTH), m=1.0, N=1.0)
        kind = Shooting(x0="given", interpolation="hold")
        return Fit(kind, machine, self.data, free=list(TRUTH), fixed="others", start=self.start)


def case(seed: int) -> Case:
    """The data and the start of a seed."""
    rng = np.random.default_rng(500 + seed)
    records = [
        Dataset.of(t=t, x=x + NOISE * rng.standard_normal(x.size), force=u, name=f"record {k}")
        for k, ((t, u), x) in enumerate(zip(forces(), positions(), strict=True))
    ]
    speeds = np.logspace(-4.5, -0.5, 25)
    v = np.concatenate([speeds, -speeds])
    level = 1 + 0.5 * np.exp(-((v / TRUTH["v_s"]) ** 2))
    F = np.sign(v) * level + 0.4 * v + SWEEP_NOISE * rng.standard_normal(v.size)
    curve = Fit(Points(), "lugre", Dataset.of(v=v, F=F, points=True)).solve(throw=False)
    steady = ("mu_s", "mu_d", "v_s", "sigma_2")
    stiffness = GUESS * OFF ** rng.uniform(-1, 1)
    damping = np.sqrt(stiffness) * OFF ** rng.uniform(-1, 1)
    start = {name: curve.parameters[name].value for name in steady}
    start |= {"sigma_0": float(stiffness), "sigma_1": float(damping)}
    return Case(sum(records[1:], start=records[0]), start)


def within(fit: Fitted) -> bool:
    """Whether all six are within 5 % and three standard errors of the truth."""
    for name, value in TRUTH.items():
        found = fit.parameters[name]
        error = found.standard_error or 0.0
        if abs(found.value - value) > min(0.05 * value, 3 * error):
            return False
    return True


def by_cvodes(given: Case) -> dict[str, float]:
    """The same six by single shooting: cvodes from sample to sample with forward sensitivities.

    SciPy's trust region on the logarithms, from the same start.
    """
    optimize: Any = import_module("scipy.optimize")
    names = list(TRUTH)
    runs = [_shoot(names, u) for _, u in forces()]
    measured = [record["x"] for record in given.data]

    def residuals(q: Array) -> Array:
        pairs = zip(runs, measured, strict=True)
        return np.concatenate([(run[0](q).full().ravel() - y) / NOISE for run, y in pairs])

    def slopes(q: Array) -> Array:
        return np.vstack([run[1](q).full() for run in runs]) / NOISE

    # the trust region needs no bounds here: a limit of three decades keeps cvodes from stiffness
    # beyond all measure
    q0 = np.log([given.start[n] for n in names])
    box = (q0 - np.log(1e3), q0 + np.log(1e3))
    end = optimize.least_squares(residuals, q0, slopes, x_scale="jac", bounds=box, max_nfev=60)
    return dict(zip(names, np.exp(end.x).tolist(), strict=True))


def _shoot(names: list[str], u: Array) -> tuple[ca.Function, ca.Function]:
    """Positions of one record as a function of the logarithms, and their derivatives."""
    q, x, force = ca.SX.sym("q", len(names)), ca.SX.sym("x", 3), ca.SX.sym("force")
    law = LuGre(**{n: ca.exp(q[i]) for i, n in enumerate(names)})
    v, z = x[1] * SCALES[1], x[2] * SCALES[2]
    rate = ca.vertcat(v, force - law.force(v, 1.0, z), law.rate(v, 1.0, z)) / SCALES
    equations = {"x": x, "p": ca.vertcat(force, q), "ode": STEP * rate}
    options = {"abstol": 1e-7, "reltol": 1e-7, "max_num_steps": 20000}
    one = ca.integrator("one", "cvodes", equations, 0, 1, options)
    X, U, Q = ca.MX.sym("X", 3), ca.MX.sym("U"), ca.MX.sym("Q", len(names))
    step = ca.Function("step", [X, U, Q], [one(x0=X, p=ca.vertcat(U, Q))["xf"]])
    count = u.size - 1
    held = ca.DM(u[:-1]).T
    path = step.mapaccum("path", count)(ca.DM.zeros(3), held, ca.repmat(Q, 1, count))
    y = SCALES[0] * ca.horzcat(0, path[0, :]).T
    return ca.Function("y", [Q], [y]), ca.Function("J", [Q], [ca.jacobian(y, Q)])


def measure(quick: bool) -> Iterator[Row]:
    """Seeds that find the truth, time of a fit, and time against cvodes on the same seeds."""
    seeds, against = (4, 1) if quick else (SEEDS, AGAINST)
    found, doubted, seconds = 0, 0, list[float]()
    begun = process_time()
    for seed in range(seeds):
        given = case(seed)
        before = process_time()
        fit = given.fit().solve(throw=False)
        seconds.append(process_time() - before)
        found += within(fit)
        doubted += fit.status not in (Status.SOLVED, Status.ACCEPTABLE)
    total = process_time() - begun
    spread = f"{min(seconds):.2f} to {max(seconds):.2f} s"
    yield Row("lugre", "found, % of seeds", 100 * found / seeds, 95, ">=", total)
    yield Row("lugre", "median of a fit, s", float(np.median(seconds)), 4, "<=", total, spread)
    yield Row("lugre", "right model doubted, % of seeds", 100 * doubted / seeds, 5, "<=", total)
    times, note = list[float](), list[str]()
    for seed in range(against):
        given = case(seed)
        before = process_time()
        values = by_cvodes(given)
        times.append(process_time() - before)
        error = max(abs(values[n] / x - 1) for n, x in TRUTH.items())
        note.append(f"{times[-1]:.1f} s, error {100 * error:.2g} %")
    ratio = float(np.median(times) / np.median(seconds[:against]))
    yield Row("lugre", "cvodes, times as long", ratio, 5, ">=", sum(times), "; ".join(note))
