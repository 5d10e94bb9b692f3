"""Identification from simulated data: friction with memory, a noisy velocity, distant starts."""

from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from typing import Any

import casadi as ca
import numpy as np

from identification import Dataset, Fit, Fitted, Measured, Points, Shooting, fit_elements
from identification.select import FitRanking, select
from symfric import Hold, Linear, Model, QuarterCarGeneral, QuarterCarSimple, Variable, simulate
from symfric.bench.identification_verdicts import BLOCK, COULOMB_LAW, T, U, block, simulated
from symfric.bench.report import Found, goal, timed
from symfric.foundation.numeric import Array
from symfric.foundation.status import Status
from symfric.laws import GMS, Element, Law, LuGre, MaxwellSlip, Slider
from symfric.scenes import Drive, QuarterCar

SEEDS = 100
"""Number of noise seeds."""
CLOSE = 0.05
"""Largest relative error of a parameter that was found."""

TRUTH = {
    "mu_s": 1.5, "mu_d": 1.0, "v_s": 1e-3,
    "sigma_0": 1e5, "sigma_1": float(np.sqrt(1e5)), "sigma_2": 0.4,
}  # fmt: skip
MACHINE = Drive(LuGre(**TRUTH), m=1.0, N=1.0)
NOISE, SWEEP_NOISE = 0.5e-6, 0.05
"""Standard deviations of the positions [m] and of the forces of the sweep [N]."""
STEP = 1e-3
OFF = 3.0
"""Largest factor between the guesses of stiffness and damping and their start values."""
GUESS = 3.8e4
"""Mean of the start values of the stiffness [N/m]."""


def was_found(fit: Fitted, truth: Mapping[str, float], errors: float) -> bool:
    """Return True if all parameters are within 5 % and `errors` standard errors of the truth."""
    for name, value in truth.items():
        found = fit.parameters[name]
        error = abs(found.value - value)
        if error > min(CLOSE * value, errors * (found.standard_error or 0.0)):
            return False
    return True


def driven() -> list[tuple[Array, Array]]:
    """Return times [s] and forces [N] of the three records."""
    t1, t = np.arange(0, 0.6, STEP), np.arange(0, 1.0, STEP)
    rising = 0.4 + 0.6 * t1 / t1[-1]
    first = 1.05 * np.sin(10 * np.pi * t1) * rising + 0.2 * np.sin(74 * np.pi * t1)
    second = np.interp(t, [0, 0.3, 0.5, 0.7, 1.0], [0, 1.7, 1.2, -1.9, 0.0])
    third = 2.5 * np.sin(4 * np.pi * t) + 0.5 * np.sin(22 * np.pi * t)
    return [(t1, first), (t, second), (t, third)]


@lru_cache(maxsize=1)
def positions() -> tuple[Array, ...]:
    """Return the true positions [m] of the three records."""
    model, rest = MACHINE.model(), {"x": 0.0, "v": 0.0, "z": 0.0}
    return tuple(
        simulate(model, float(t[-1]), x0=rest, u={"force": Hold(t, u)}, t_eval=t, rtol=1e-10)["x"]
        for t, u in driven()
    )


def case(seed: int) -> Fit:
    """Return the fit of the six parameters to the data of a seed, with known mass and offset."""
    rng = np.random.default_rng(500 + seed)
    records = [
        Dataset.of(t=t, x=x + NOISE * rng.standard_normal(x.size), force=u, name=f"record {k}")
        for k, ((t, u), x) in enumerate(zip(driven(), positions(), strict=True))
    ]
    speeds = np.logspace(-4.5, -0.5, 25)
    v = np.concatenate([speeds, -speeds])
    level = 1 + 0.5 * np.exp(-((v / TRUTH["v_s"]) ** 2))
    F = np.sign(v) * level + 0.4 * v + SWEEP_NOISE * rng.standard_normal(v.size)
    curve = Fit(Points(), "lugre", Dataset.of(v=v, F=F, points=True)).solve(throw=False)
    stiffness = GUESS * OFF ** rng.uniform(-1, 1)
    damping = np.sqrt(stiffness) * OFF ** rng.uniform(-1, 1)
    start = {n: curve.parameters[n].value for n in ("mu_s", "mu_d", "v_s", "sigma_2")}
    start |= {"sigma_0": float(stiffness), "sigma_1": float(damping)}
    data = sum(records[1:], start=records[0])
    kind = Shooting(x0="given", interpolation="hold")
    return Fit(kind, MACHINE, data, free=list(TRUTH), fixed="others", start=start)


def lugre(quick: bool) -> Iterator[Found]:
    """Measure the percentage of seeds whose fits find the truth, and the time of a fit.

    A mass of 1 kg is driven by a force that is constant for each millisecond. Three records with
    2600 samples show pre-sliding, break-away with reversals, and gross sliding. The noise differs
    between seeds. A noisy velocity sweep gives the start values of levels, Stribeck velocity and
    viscous part (force noise 0.05 N). Those of stiffness and damping of the bristles differ by
    factors of up to 3 from a value that is too low.
    """
    seeds = 4 if quick else SEEDS
    right, doubted, seconds = 0, 0, list[float]()
    for seed in range(seeds):
        spent, fit = timed(partial(case(seed).solve, throw=False))
        seconds.append(spent)
        right += was_found(fit, TRUTH, 3.0)
        doubted += fit.status not in (Status.SOLVED, Status.ACCEPTABLE)
    total = sum(seconds)
    spread = f"{min(seconds):.2f} to {max(seconds):.2f} s"
    yield goal("found, % of seeds", 100 * right / seeds, 95, ">=", total)
    yield goal("median of a fit, s", float(np.median(seconds)), 4, "<=", total, spread)
    yield goal("right model doubted, % of seeds", 100 * doubted / seeds, 5, "<=", total)


# ---- Maxwell-slip elements and GMS ----

FORCE_NOISE = 0.01
"""Standard deviation of the measured force [N], which is about 1 N."""
MICRO = 1e-6
TURNS = {
    "hysteresis": ((5.0, 0.05), (2.0, 0.13), (1.0, 0.31)),
    "other": ((4.0, 0.07), (3.0, 0.11), (0.7, 0.43)),
}
"""Amplitudes [um] and frequencies [Hz] of slow paths."""
Path = tuple[Array, Array]
"""Times [s] and positions [m]."""


def gms(quick: bool) -> Iterator[Found]:
    """Fit laws to a slow and a fast path, and predict another path; unless `quick`, rank laws."""
    count, thin = (2, 2) if quick else (10, 1)
    law, rng = _true(count), np.random.default_rng(1)
    slow, fast = _slow("hysteresis", 0.02 * thin), _fast(2e-3 * thin)
    seconds, error = timed(partial(_elements, law, slow, rng))
    what = f"Maxwell-slip, {count} elements: error of the true force over the noise"
    note = "convex, then radii; no start values"
    yield goal(what, error, 0.3, "<=", seconds, note)
    seconds, fit = timed(partial(_fitted, law, count, slow, fast, rng))
    left = max(e.rms for e in fit.errors.values()) / FORCE_NOISE
    yield goal(f"GMS, {count} elements: residual over the noise", left, 1.1, "<=", seconds)
    if fit.law is not None:
        t, x = _slow("other", 0.02)
        wrong = forces(fit.law, t, x) - forces(law, t, x)
        value = float(np.sqrt(np.mean(wrong**2))) / FORCE_NOISE
        yield goal("the same on another path: error over the noise", value, 1.0)
    for name, true in (("mu_s", 1.05), ("v_s", 98 * MICRO), ("C", 24.0)):
        off = 100 * abs(fit.parameters[name].value / true - 1)
        yield goal(f"error of {name} [%]", off, 10.0)
    if quick:
        return
    seconds, ranking = timed(ranked)
    ratio = ranking["lugre"].validation / ranking["gms"].validation
    what = "GMS data: error of LuGre on another path over that of GMS"
    note = f"status of LuGre: {ranking['lugre'].status}"
    yield goal(what, ratio, 1.0, ">=", seconds, note)


def ranked() -> FitRanking:
    """Return the ranking of GMS and LuGre on data of four unequal elements and another path."""
    law, rng = _true(4), np.random.default_rng(0)
    slow = _record(law, _slow("hysteresis", 0.04), "hysteresis", rng)
    fast = _record(law, _fast(4e-3), "sliding", rng)
    other = _record(law, _slow("other", 0.04), "other path", rng)
    laws = {"lugre": "lugre", "gms": GMS(form="event")}
    return select(laws, slow + fast, Points(), validate=other, starts=2, evaluations=60)


def _true(count: int) -> GMS:
    """Return GMS with levels, lag and Stribeck curve of Lampaert et al. 2003, random elements."""
    rng = np.random.default_rng(3)
    radii = np.sort(np.geomspace(8e-8, 9e-6, count) * np.exp(0.25 * rng.standard_normal(count)))
    shares = rng.uniform(0.5, 1.5, count)
    shares /= shares.sum()
    return _gms(1.05 * shares / radii, shares)


def _gms(k: Array, shares: Array) -> GMS:
    elements = tuple(Element(float(a), float(b)) for a, b in zip(k, shares, strict=True))
    known = {"mu_s": 1.05, "mu_d": 0.2, "v_s": 98 * MICRO, "delta": 0.78, "C": 24.0}
    return GMS(elements=elements, form="event", **known)


def _slow(name: str, step: float) -> Path:
    """Return a path of a few micrometres with nested reversals over a minute."""
    t = np.arange(0.0, 60.0, step)
    return t, MICRO * np.sum([a * np.sin(2 * np.pi * f * t) for a, f in TURNS[name]], axis=0)


def _fast(step: float) -> Path:
    """Return a path in both directions at up to five times the Stribeck velocity."""
    t = np.arange(0.0, 4.0, step)
    return t, 80 * MICRO * np.sin(2 * np.pi * t) * np.sin(0.25 * np.pi * t + 0.5)


def forces(law: Law, t: Array, x: Array) -> Array:
    """Return the force [N] along a path, exact for straight pieces.

    The first force is that of steady sliding in the first direction of the path.
    """
    v = np.diff(x) / np.diff(t)
    z: Any = law.steady_state(float(v[0]), 1.0)
    found = [float(np.asarray(law.force(float(v[0]), 1.0, z)))]
    for speed, h in zip(v.tolist(), np.diff(t).tolist(), strict=True):
        step = law.held_step(speed, 1.0, z, h)
        if step is None:
            raise ValueError(f"forces: expected a law that steps exactly, got {type(law).__name__}")
        z = np.asarray(step[0], float).ravel()
        found.append(float(np.asarray(law.force(speed, 1.0, z))))
    return np.array(found)


def _record(law: Law, path: Path, name: str, rng: np.random.Generator) -> Dataset:
    """Return a record of velocity and noisy force along a path."""
    t, x = path
    F = forces(law, t, x) + FORCE_NOISE * rng.standard_normal(t.size)
    return Dataset.of(t=t, v=np.gradient(x, t), F=F, units={"v": "m/s", "F": "N"}, name=name)


def _elements(law: GMS, path: Path, rng: np.random.Generator) -> float:
    """Return the error over the noise of elements fitted to a record without Stribeck effect."""
    t, x = path
    sliders = tuple(Slider(float(e.k), float(e.alpha)) for e in law.elements)
    true = forces(MaxwellSlip(elements=sliders, form="event"), t, x)
    v = np.gradient(x, t)
    noisy = Measured(v, true + FORCE_NOISE * rng.standard_normal(t.size), x, t)
    found = fit_elements(noisy, len(sliders))
    return float(np.sqrt(np.mean((found.force(noisy) - true) ** 2))) / FORCE_NOISE


def _fitted(law: GMS, count: int, slow: Path, fast: Path, rng: np.random.Generator) -> Fitted:
    """Return the fit of all parameters from default starts; the strongest share is not fitted."""
    first, second = _record(law, slow, "hysteresis", rng), _record(law, fast, "sliding", rng)
    t, x = slow
    measured = Measured(np.gradient(x, t), first[0]["F"], x, t)
    strongest = int(np.argmax(fit_elements(measured, count).levels)) + 1
    shares = [f"alpha_{i + 1}" for i in range(count) if i + 1 != strongest]
    free = ["delta", "C", *(f"k_{i + 1}" for i in range(count)), *shares]
    start = _gms(np.full(count, 1e5), np.full(count, 1 / count))
    fixed = {"sigma_2": 0.0}
    fit = Fit(Points(), start, first + second, free=free, fixed=fixed, starts=4, evaluations=150)
    return fit.solve(throw=False)


# ---- a noisy velocity in addition ----

POSITION, VELOCITY = 1e-4, 0.2
"""Standard deviations of the noise [m, m/s]."""


def velocity(quick: bool) -> Iterator[Found]:
    """Compare estimates from positions and a hundred times noisier velocities with those from
    positions alone.
    """
    seconds, worst = timed(partial(_added, count := 1 if quick else SEEDS))
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

FAR_SEEDS = 20
"""Number of seeds of distant starts."""
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


def starts(quick: bool = False) -> Iterator[Found]:
    """Measure how many of 20 fits find the truth, and their times.

    Noise and start differ between seeds; the start values are the true parameters multiplied by
    random factors that are uniform in their logarithm. A fit has found the truth if its status is
    good and every parameter is within 5 % and five standard errors of the truth. With `quick`, one
    fit of each car.
    """
    seeds = range(1 if quick else FAR_SEEDS)
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
    good = sum(fit.status.ok and was_found(fit, truth, 5.0) for _, fit in results)
    times = [seconds for seconds, _ in results]
    share = 100.0 * good / len(times)
    note = f"{good} of {len(times)}; processor time per fit: median {np.median(times):.1f} s, "
    note += f"largest {max(times):.1f} s"
    return goal(f"{what}: found [%]", share, 100.0, ">=", sum(times), note)
