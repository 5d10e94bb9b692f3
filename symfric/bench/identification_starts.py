"""Fits from starts far off: hysteresis from those off by up to 4, a quarter car by up to 2.

Each seed has other noise and another start, all parameters multiplied by factors drawn uniformly in
their logarithm. A fit has found the truth where it says so (its status is good) and is within 5 %
and five of its standard errors of every parameter.
"""

from collections.abc import Iterator, Mapping
from time import process_time

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.shooting import Shooting
from identification.result.fitted import Fitted
from symfric.bench.identification import Row
from symfric.foundation.parameters import Variable
from symfric.integrator import Linear, simulate
from symfric.laws import QuarterCarGeneral, QuarterCarSimple
from symfric.model import Model
from symfric.scenes import QuarterCar

Array = NDArray[np.float64]

SEEDS, QUICK = 20, 4
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


def found(fit: Fitted, truth: Mapping[str, float]) -> bool:
    """Whether a fit claims to be good and is."""
    for name, value in truth.items():
        estimate = fit.parameters[name]
        error = abs(estimate.value - value)
        if error > NEAR * value or error > ERRORS * (estimate.standard_error or np.inf):
            return False
    return fit.status.ok


def measure(quick: bool = False) -> Iterator[Row]:
    """How many of 20 fits find the truth, and what the slowest of them takes."""
    seeds = range(QUICK if quick else SEEDS)
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


def _counted(what: str, fits: Iterator[Fit], truth: Mapping[str, float]) -> Iterator[Row]:
    good, times = list[bool](), list[float]()
    for fit in fits:
        begin = process_time()
        good.append(found(fit.solve(throw=False), truth))
        times.append(process_time() - begin)
    share = 100.0 * sum(good) / len(good)
    note = f"{sum(good)} of {len(good)}; CPU a fit: median {np.median(times):.1f} s, largest "
    yield Row(
        "starts", f"{what}: found [%]", share, 100.0, ">=", sum(times), note + f"{max(times):.1f} s"
    )
