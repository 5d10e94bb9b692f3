"""Fits again and again: with other noise, for the coverage of intervals; from starts far off."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from time import process_time
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from symfric import law_from_text
from symfric.bench.table import Goal
from symfric.foundation.parameters import Variable, with_values
from symfric.foundation.status import Status
from symfric.integrator import Linear, Trajectory, simulate
from symfric.laws import QuarterCarGeneral, QuarterCarSimple, Stribeck
from symfric.model import Model
from symfric.scenes import Drive, QuarterCar

Array = NDArray[np.float64]

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


def coverage(quick: bool) -> Iterator[Goal]:
    """The rows; `quick` takes a tenth of the seeds.

    A known drive is measured again and again with other noise, white or AR(1) with 0.9 from sample
    to sample, and fitted by inverse dynamics (force noise) and by simulation (position noise, start
    values unknown). Counted are the 95 % intervals that hold the truth, right models that are
    called doubtful, and wrong ones that are not. The estimate of a mass from positions and a
    hundred times noisier velocities is compared with that from positions alone.
    """
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


def _covered(kind: str, rho: float, truth: dict[str, float], found: list[_Seed]) -> Iterator[Goal]:
    """Coverage over the parameters, bias of the mass, false alarms."""
    noise = "AR(1) 0.9" if rho else "white"
    where, n = f"{kind}, {noise} noise", len(found)
    seconds = sum(one.seconds for one in found)
    each = np.mean([one.inside for one in found], axis=0)
    shown = ", ".join(f"{name} {c:.3f}" for name, c in zip(truth, each, strict=True))
    all_of = f"{where}: 95 % intervals that hold the truth"
    mean = float(each.mean())
    yield Goal(all_of, mean, 0.90, ">=", seconds, f"{shown}; {n} seeds")
    yield Goal(all_of, mean, 0.99)
    bias = abs(np.mean([one.off[0] for one in found])) / np.mean([one.error[0] for one in found])
    yield Goal(f"{where}: bias of the mass [standard errors]", float(bias), 1.0)
    doubted = float(np.mean([one.doubtful for one in found]))
    yield Goal(f"{where}: right model not called solved", doubted, 0.05)


def _added(seeds: int) -> Goal:
    """Scatter of the estimates with a noisy velocity besides the position, over that without."""
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
    return Goal(what, worst, 1.1, "<=", process_time() - begun, f"{len(off['x'])} seeds")


def _wrong(seeds: int) -> Goal:
    """Data with a Stribeck peak, fitted without one."""
    begun = process_time()
    peak = Stribeck(mu_s=28.0, mu_d=20.0, v_s=0.01, v_eps=1e-4, sigma_2=200.0)
    missed = 0
    for seed in range(seeds):
        data = synthetic_drive_data(peak, seed=seed)
        fit = Fit(INVERSE, "coulomb+viscous", data, starts=1).solve(throw=False)
        missed += fit.status is Status.SOLVED
    what = "a Stribeck peak fitted without one: called solved"
    return Goal(what, missed / seeds, 0.0, "<=", process_time() - begun, f"{seeds} seeds")


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


FAR_SEEDS, FAR_QUICK = 20, 4
NEAR, ERRORS = 0.05, 5.0
"""Relative error, and error over its standard error, of a parameter that was found."""
HYSTERESIS = {"m": 2.0, "c": 10.0, "k": 5e4, "alpha": 5e4, "beta": 800.0, "gamma": 1100.0}
"""Of the oscillator, in SI units."""
SAMPLES, RATE, BAND = 2048, 750.0, (5.0, 150.0)
"""Of the multisine that drives it: number, per second, and frequencies [Hz]."""
ROUND_V, ROUND_Z = 1e-5, 1e-3
"""What rounds |v| [m/s] and |z| [N]."""
CARS = {
    "general law": (QuarterCarGeneral(), ("C_e", "e_1", "mu", "sigma_v")),
    "simple law": (QuarterCarSimple(), ("C_e", "e_1", "sigma_v")),
}


def hysteretic() -> Model:
    """An oscillator with the hysteresis of Bouc and Wen, as a user writes it.

        m v' = u - k y - c v - z,   z' = alpha v - beta |v| z + gamma v |z|

    Source: J.-P. Noel, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, 2016.
    """
    y = Variable("y", "m", nominal=1e-3)
    v = Variable("v", "m/s", nominal=0.1)
    z = Variable("z", "N", nominal=10.0)
    u = Variable("u", "N", nominal=10.0)
    units = dict(zip(HYSTERESIS, ("kg", "N s/m", "N/m", "N/m", "1/m", "1/m"), strict=True))
    p = {n: Variable(n, units[n], start=x, lower=0.0) for n, x in HYSTERESIS.items()}
    m, c, k, alpha, beta, gamma = (p[n].symbol for n in HYSTERESIS)
    speed = ca.sqrt(v.symbol**2 + ROUND_V**2)
    size = ca.sqrt(z.symbol**2 + ROUND_Z**2)
    return Model(
        "hysteretic oscillator",
        x=(y, v, z),
        u=(u,),
        p=tuple(p.values()),
        ode=ca.vertcat(
            v.symbol,
            (u.symbol - k * y.symbol - c * v.symbol - z.symbol) / m,
            alpha * v.symbol - beta * speed * z.symbol + gamma * v.symbol * size,
        ),
    )


def multisine(seed: int) -> tuple[Array, Array]:
    """Times [s] and a force of all frequencies of the band with random phases, 50 N in the mean."""
    t, f = np.arange(SAMPLES) / RATE, np.arange(1, SAMPLES // 2) * RATE / SAMPLES
    f = f[(f >= BAND[0]) & (f <= BAND[1])]
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, f.size)
    u = np.cos(2 * np.pi * np.outer(t, f) + phases).sum(axis=1)
    return t, u * 50.0 / np.std(u)


def hysteretic_data(model: Model, seed: int) -> Dataset:
    """The simulated oscillator under a multisine, its position with noise of 8 um."""
    t, u = multisine(seed)
    y = simulate(model, float(t[-1]), u={"u": Linear(t, u)}, t_eval=t, rtol=1e-9)["y"]
    y = y + 8e-6 * np.random.default_rng([seed, 1]).standard_normal(t.size)
    return Dataset.of(t=t, y=y, u=u, units={"y": "m", "u": "N"}, name="multisine")


def car_data(car: QuarterCar, seed: int) -> Dataset:
    """Displacements of body and wheel over the three ramps of the road, with noise of 50 um."""
    t = np.linspace(0.0, car.t_end, 2001)
    run = simulate(car.model(), car.t_end, rtol=1e-9, t_eval=t)
    body, wheel = 5e-5 * np.random.default_rng(seed).standard_normal((2, t.size))
    return Dataset.of(
        t=t, X_b=run["X_b"] + body, X_w=run["X_w"] + wheel,
        units={"X_b": "m", "X_w": "m"}, name="three ramps",
    )  # fmt: skip


def far(truth: Mapping[str, float], factor: float, seed: int) -> dict[str, float]:
    """A start off by up to `factor` in every parameter."""
    rng = np.random.default_rng([seed, 2])
    return {n: float(x * factor ** rng.uniform(-1, 1)) for n, x in truth.items()}


def was_found(fit: Fitted, truth: Mapping[str, float]) -> bool:
    """True if a fit claims to be good and is."""
    for name, value in truth.items():
        estimate = fit.parameters[name]
        error = abs(estimate.value - value)
        if error > NEAR * value or error > ERRORS * (estimate.standard_error or np.inf):
            return False
    return fit.status.ok


def starts(quick: bool = False) -> Iterator[Goal]:
    """The number of 20 fits that find the truth, and the time of the slowest.

    Each seed has other noise and another start, all parameters multiplied by factors drawn
    uniformly in their logarithm. A fit has found the truth where it says so (its status is
    good) and is within 5 % and five of its standard errors of every parameter.
    """
    seeds = range(FAR_QUICK if quick else FAR_SEEDS)
    model = hysteretic()
    fits = (
        Fit(Shooting(), model, hysteretic_data(model, s), start=far(HYSTERESIS, 4.0, s), starts=12)
        for s in seeds
    )
    yield from _counted("hysteresis, starts off by 4", fits, HYSTERESIS)
    for name, (law, free) in CARS.items():
        car, truth = QuarterCar(law), {n: getattr(law, n) for n in free}
        fits = (
            Fit(
                Shooting(x0="given"), car, car_data(car, s),
                free=free, fixed="others", start=far(truth, 2.0, s), starts=12,
            )
            for s in seeds
        )  # fmt: skip
        yield from _counted(f"quarter car, {name}, starts off by 2", fits, truth)


def _counted(what: str, fits: Iterator[Fit], truth: Mapping[str, float]) -> Iterator[Goal]:
    good, times = list[bool](), list[float]()
    for fit in fits:
        begin = process_time()
        good.append(was_found(fit.solve(throw=False), truth))
        times.append(process_time() - begin)
    share = 100.0 * sum(good) / len(good)
    note = f"{sum(good)} of {len(good)}; processor time per fit: median {np.median(times):.1f} s, "
    note += f"largest {max(times):.1f} s"
    yield Goal(f"{what}: found [%]", share, 100.0, ">=", sum(times), note)
