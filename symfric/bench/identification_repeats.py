"""Repeated fits: with a noisy velocity, and from distant starts."""

from collections.abc import Iterator, Mapping
from functools import partial

import casadi as ca
import numpy as np

from identification import Dataset, Fit, Fitted, Shooting
from symfric import Linear, Model, QuarterCarGeneral, QuarterCarSimple, Variable, simulate
from symfric.bench.identification_verdicts import BLOCK, COULOMB_LAW, T, U, block, simulated
from symfric.bench.report import Found, goal, timed
from symfric.foundation.numeric import Array
from symfric.scenes import QuarterCar

SEEDS, QUICK = 100, 1
POSITION, VELOCITY = 1e-4, 0.2
"""Standard deviations of the noise [m, m/s]."""


def velocity(quick: bool) -> Iterator[Found]:
    """Compare estimates from positions and a hundred times noisier velocities with those from
    positions alone.
    """
    seconds, worst = timed(partial(_added, count := QUICK if quick else SEEDS))
    what = "a noisy velocity added: largest rms error over that without"
    yield goal(what, worst, 1.1, "<=", seconds, f"{count} seeds")


def _added(seeds: int) -> float:
    """Return the rms error with a noisy velocity in addition, relative to that without it."""
    off: dict[str, list[Array]] = {"x": [], "x and v": []}
    true = np.array(list(BLOCK.values()))
    for seed in range(seeds):
        noise = np.random.default_rng(seed)
        run = simulated(COULOMB_LAW)
        x = run["x"] + POSITION * noise.standard_normal(T.size)
        v = run["v"] + VELOCITY * noise.standard_normal(T.size)
        for name, fit in (("x", _fit_block(x=x)), ("x and v", _fit_block(x=x, v=v))):
            off[name].append(np.array([fit.values[p] for p in BLOCK]) - true)
    alone, both = (np.sqrt(np.mean(np.square(some), axis=0)) for some in off.values())
    return float(np.max(both / alone))


def _fit_block(**signals: Array) -> Fitted:
    units = {"x": "m", "v": "m/s", "force": "N"}
    given = {"force": U, **signals}
    data = Dataset.of({"t": T, **given}, units={n: units[n] for n in given})
    start = {"m": 1.7, "mu_d": 0.8, "sigma_2": 1.0}
    return Fit(Shooting(), block(COULOMB_LAW), data, start=start).solve(throw=False)


# ---- distant starts ----

FAR_SEEDS, FAR_QUICK = 20, 1
NEAR, ERRORS = 0.05, 5.0
"""Largest relative error, and largest error in standard errors, of a parameter that was found."""
HYSTERESIS = {"m": 2.0, "c": 10.0, "k": 5e4, "alpha": 5e4, "beta": 800.0, "gamma": 1100.0}
"""Parameters of the oscillator, in SI units."""
SAMPLES, RATE, BAND = 2048, 750.0, (5.0, 150.0)
"""Number of samples, sampling rate [1/s] and frequencies [Hz] of the multisine."""
ROUND_V, ROUND_Z = 1e-5, 1e-3
"""Smoothing of |v| [m/s] and |z| [N]."""
CARS = {
    "general law": (QuarterCarGeneral(), ("C_e", "e_1", "mu", "sigma_v")),
    "simple law": (QuarterCarSimple(), ("C_e", "e_1", "sigma_v")),
}


def hysteretic() -> Model:
    """Return an oscillator with the hysteresis of Bouc and Wen, in the form of a user's model.

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
    ode = ca.vertcat(
        v.symbol,
        (u.symbol - k * y.symbol - c * v.symbol - z.symbol) / m,
        alpha * v.symbol - beta * speed * z.symbol + gamma * v.symbol * size,
    )
    return Model("hysteretic oscillator", x=(y, v, z), u=(u,), p=tuple(p.values()), ode=ode)


def hysteretic_data(model: Model, seed: int) -> Dataset:
    """Return simulated data of the oscillator under a multisine of 50 N rms with random phases.

    The position has noise of 8 um.
    """
    t, f = np.arange(SAMPLES) / RATE, np.arange(1, SAMPLES // 2) * RATE / SAMPLES
    f = f[(f >= BAND[0]) & (f <= BAND[1])]
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, f.size)
    u = np.cos(2 * np.pi * np.outer(t, f) + phases).sum(axis=1)
    u *= 50.0 / np.std(u)
    y = simulate(model, float(t[-1]), u={"u": Linear(t, u)}, t_eval=t, rtol=1e-9)["y"]
    y = y + 8e-6 * np.random.default_rng([seed, 1]).standard_normal(t.size)
    return Dataset.of(t=t, y=y, u=u, units={"y": "m", "u": "N"}, name="multisine")


def car_data(car: QuarterCar, seed: int) -> Dataset:
    """Return simulated displacements of body and wheel over three ramps, with noise of 50 um."""
    t = np.linspace(0.0, car.t_end, 2001)
    run = simulate(car.model(), car.t_end, rtol=1e-9, t_eval=t)
    body, wheel = 5e-5 * np.random.default_rng(seed).standard_normal((2, t.size))
    return Dataset.of(
        t=t, X_b=run["X_b"] + body, X_w=run["X_w"] + wheel,
        units={"X_b": "m", "X_w": "m"}, name="three ramps",
    )  # fmt: skip


def far(truth: Mapping[str, float], factor: float, seed: int) -> dict[str, float]:
    """Return start values that differ from the truth by factors of up to `factor`."""
    rng = np.random.default_rng([seed, 2])
    return {n: float(x * factor ** rng.uniform(-1, 1)) for n, x in truth.items()}


def was_found(fit: Fitted, truth: Mapping[str, float]) -> bool:
    """Return True if a fit has a good status and every parameter is close to the truth."""
    for name, value in truth.items():
        estimate = fit.parameters[name]
        error = abs(estimate.value - value)
        if error > NEAR * value or error > ERRORS * (estimate.standard_error or np.inf):
            return False
    return fit.status.ok


def starts(quick: bool = False) -> Iterator[Found]:
    """Measure how many of 20 fits find the truth, and their times.

    Noise and start differ between seeds; the start values are the true parameters multiplied by
    random factors that are uniform in their logarithm. A fit has found the truth if its status is
    good and every parameter is within 5 % and five standard errors of the truth. With `quick`, one
    fit of each car.
    """
    seeds = range(FAR_QUICK if quick else FAR_SEEDS)
    if not quick:
        model = hysteretic()
        fits = (
            Fit(
                Shooting(), model, hysteretic_data(model, s),
                start=far(HYSTERESIS, 4.0, s), starts=12,
            )
            for s in seeds
        )  # fmt: skip
        yield _counted("hysteresis, starts off by 4", fits, HYSTERESIS)
    for name, (law, free) in CARS.items():
        car, truth = QuarterCar(law), {n: getattr(law, n) for n in free}
        fits = (
            Fit(
                Shooting(x0="given"), car, car_data(car, s),
                free=free, fixed="others", start=far(truth, 2.0, s), starts=12,
            )
            for s in seeds
        )  # fmt: skip
        yield _counted(f"quarter car, {name}, starts off by 2", fits, truth)


def _counted(what: str, fits: Iterator[Fit], truth: Mapping[str, float]) -> Found:
    results = [timed(partial(fit.solve, throw=False)) for fit in fits]
    good, times = sum(was_found(fit, truth) for _, fit in results), [t for t, _ in results]
    share = 100.0 * good / len(times)
    note = f"{good} of {len(times)}; processor time per fit: median {np.median(times):.1f} s, "
    note += f"largest {max(times):.1f} s"
    return goal(f"{what}: found [%]", share, 100.0, ">=", sum(times), note)
