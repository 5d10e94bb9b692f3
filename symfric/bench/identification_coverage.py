"""Whether intervals cover, biases are small, more data do not hurt, and verdicts are right.

A known drive is measured again and again with other noise, white or AR(1) with 0.9 from sample to
sample, and fitted by inverse dynamics (force noise) and by simulation (position noise, start values
unknown). Counted are the 95 % intervals that hold the truth, right models that are called doubtful,
and wrong ones that are not. The estimate of a mass from positions and a hundred times noisier
velocities is compared with that from positions alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from time import process_time
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from symfric import law_from_text
from symfric.bench.identification import Row
from symfric.foundation.parameters import with_values
from symfric.foundation.status import Status
from symfric.integrator import Linear, Trajectory, simulate
from symfric.laws import Stribeck
from symfric.scenes import Drive

Array = NDArray[np.float64]

CASE = "coverage"
SEEDS, QUICK = 200, 20
STAGE = {"m": 95.0, "offset": -3.0, "mu_d": 20.0, "sigma_2": 200.0}
"""Truth of the inverse dynamics, with levels like those of EMPS."""
BLOCK = {"m": 2.0, "mu_d": 1.0, "sigma_2": 0.8}
"""Truth of the simulated motion."""
FORCE, POSITION, VELOCITY = 0.5, 1e-4, 0.2
"""Standard deviations of the noise [N, m, m/s]; of coloured noise, of its innovations."""
INVERSE: Any = InverseDynamics()
T = np.linspace(0.0, 4.0, 201)
U = 3 * np.sin(2 * np.pi * 0.7 * T) + 2 * np.sin(2 * np.pi * 1.9 * T + 1)


def measure(quick: bool) -> Iterator[Row]:
    """The rows; `quick` takes a tenth of the seeds."""
    seeds = QUICK if quick else SEEDS
    for rho in (0.0, 0.9):
        yield from _covered("inverse dynamics", rho, STAGE, [*_inverse(rho, seeds)])
    for rho in (0.0, 0.9):
        yield from _covered("shooting", rho, BLOCK, [*_shooting(rho, seeds)])
    yield _added(seeds)
    yield _wrong(max(3, seeds // 20))


@final
@dataclass(frozen=True, eq=False)
class _Seed:
    """One fit: estimates, standard errors, whether the intervals hold the truth, verdict."""

    off: Array
    error: Array
    inside: NDArray[np.bool_]
    doubtful: bool
    seconds: float


def _inverse(rho: float, seeds: int) -> Iterator[_Seed]:
    law = with_values(
        law_from_text("coulomb+viscous"), {"mu_d": 20.0, "sigma_2": 200.0, "v_eps": 1e-4}
    )
    clean = synthetic_drive_data(law, force_noise=0.0, position_noise=0.0)
    for seed in range(seeds):
        begun = process_time()
        noise = np.random.default_rng(seed)
        record = clean[0]
        force = record["force"] + FORCE * coloured(noise, record.size, rho)
        x = record["x"] + 1e-7 * noise.standard_normal(record.size)
        noisy = replace(record, signals={**record.signals, "x": x, "force": force}, loop=None)
        fit = Fit(INVERSE, "coulomb+viscous", Dataset((noisy,)), starts=1)
        yield _seed(fit.solve(throw=False), STAGE, begun)


def _shooting(rho: float, seeds: int) -> Iterator[_Seed]:
    for seed in range(seeds):
        begun = process_time()
        noise = np.random.default_rng(seed)
        x = _motion()["x"] + POSITION * coloured(noise, T.size, rho)
        yield _seed(_fit_block(_block(x=x)), BLOCK, begun)


def _seed(fit: Fitted, truth: dict[str, float], begun: float) -> _Seed:
    some = [fit.parameters[name] for name in truth]
    true = np.array(list(truth.values()))
    low, high, error = (
        np.array([np.nan if e is None else e for e in ends])
        for ends in zip(*((e.low, e.high, e.standard_error) for e in some), strict=True)
    )
    return _Seed(
        np.array([e.value for e in some]) - true, error, (low <= true) & (true <= high),
        fit.status is not Status.SOLVED, process_time() - begun,
    )  # fmt: skip


def _covered(kind: str, rho: float, truth: dict[str, float], found: list[_Seed]) -> Iterator[Row]:
    """Coverage over the parameters, bias of the mass, false alarms."""
    noise = "AR(1) 0.9" if rho else "white"
    where, n = f"{kind}, {noise} noise", len(found)
    seconds = sum(one.seconds for one in found)
    each = np.mean([one.inside for one in found], axis=0)
    shown = ", ".join(f"{name} {c:.3f}" for name, c in zip(truth, each, strict=True))
    all_of = f"{where}: 95 % intervals that hold the truth"
    mean = float(each.mean())
    yield Row(CASE, all_of, mean, 0.90, ">=", seconds, f"{shown}; {n} seeds")
    yield Row(CASE, all_of, mean, 0.99, "<=", 0.0)
    bias = abs(np.mean([one.off[0] for one in found])) / np.mean([one.error[0] for one in found])
    yield Row(CASE, f"{where}: bias of the mass [standard errors]", float(bias), 1.0, "<=", 0.0)
    doubted = float(np.mean([one.doubtful for one in found]))
    yield Row(CASE, f"{where}: right model not called solved", doubted, 0.05, "<=", 0.0)


def _added(seeds: int) -> Row:
    """Scatter of the estimates with a noisy velocity beside the position, over that without."""
    begun = process_time()
    off: dict[str, list[Array]] = {"x": [], "x and v": []}
    true = np.array(list(BLOCK.values()))
    for seed in range(max(seeds // 2, QUICK)):
        noise = np.random.default_rng(seed)
        x = _motion()["x"] + POSITION * noise.standard_normal(T.size)
        v = _motion()["v"] + VELOCITY * noise.standard_normal(T.size)
        for name, data in (("x", _block(x=x)), ("x and v", _block(x=x, v=v))):
            fit = _fit_block(data)
            off[name].append(np.array([fit.values[p] for p in BLOCK]) - true)
    alone, both = (np.sqrt(np.mean(np.square(some), axis=0)) for some in off.values())
    worst = float(np.max(both / alone))
    what = "a noisy velocity added: largest rms error over that without"
    return Row(CASE, what, worst, 1.1, "<=", process_time() - begun, f"{len(off['x'])} seeds")


def _wrong(seeds: int) -> Row:
    """Data with a Stribeck peak, fitted without one."""
    begun = process_time()
    peak = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, v_eps=1e-4, sigma_2=200.0)
    missed = 0
    for seed in range(seeds):
        data = synthetic_drive_data(peak, seed=seed)
        fit = Fit(INVERSE, "coulomb+viscous", data, starts=1).solve(throw=False)
        missed += fit.status is Status.SOLVED
    what = "a Stribeck peak fitted without one: called solved"
    return Row(CASE, what, missed / seeds, 0.0, "<=", process_time() - begun, f"{seeds} seeds")


def _drive() -> Drive:
    return Drive(law_from_text("coulomb+viscous"), m=BLOCK["m"], N=1.0)


@cache
def _motion() -> Trajectory:
    """The motion of the block, without noise."""
    model, start = _drive().model(free=list(BLOCK)), {"x": 0.0, "v": 0.0}
    u = {"force": Linear(T, U)}
    return simulate(model, 4.0, p=BLOCK, t_eval=T, u=u, x0=start, rtol=1e-9)


def _block(**signals: Array) -> Dataset:
    units = {"x": "m", "v": "m/s", "force": "N"}
    given = {"t": T, "force": U, **signals}
    return Dataset.of(given, units={n: units[n] for n in given if n != "t"})


def _fit_block(data: Dataset) -> Fitted:
    start = {"m": 1.7, "mu_d": 0.8, "sigma_2": 1.0}
    return Fit(Shooting(), _drive().model(free=list(BLOCK)), data, start=start).solve(throw=False)


def coloured(noise: np.random.Generator, n: int, rho: float) -> Array:
    """Stationary AR(1) noise with unit innovations, shape (n,)."""
    e = noise.standard_normal(n)
    if rho:
        e[0] /= np.sqrt(1 - rho**2)
        for k in range(1, n):
            e[k] += rho * e[k - 1]
    return e
