"""Estimators of friction that changes, in simulated closed loops."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np

from ocp import estimate
from symfric import ElastoPlastic, Law, LuGre, Stribeck, drive
from symfric.bench.report import Found, goal, timed
from symfric.compensation import (
    Cascade,
    Loop,
    Reference,
    close_loop,
    compensator,
    kalman_estimator,
    moves,
    recursive_estimator,
    sine,
)
from symfric.foundation.numeric import Array

SEEDS, SHORT = 50, 0.5
"""Number of loops, and length of those that run in C and in the VM [s]."""
T_END, QUICK, SETTLED, EVERY = 30.0, 12.0, 8.0, 10
"""Length of a loop, that of a quick run, and its start without a judgement [s]; samples of the
moving horizon."""
STATIC, SMOOTH, WRONG = tuple(range(2, 32, 3)), 2e-3, 90.0
"""Seeds of plants with a law without states, for the moving horizon; width of the law of the model
[m/s]; share of errors within two deviations below which deviations are wrong [%]."""
MAKE = {"recursive": recursive_estimator, "kalman": kalman_estimator}
TITLE = f"Scale of dry friction that changes, {T_END:g} s at 1 kHz"


@final
@dataclass(frozen=True)
class Axis:
    """Random axis whose friction changes; all sizes are drawn over decades.

    The plant has bristles, elasto-plastic bristles or a law without states; the estimators use
    bristles of the same curve with half the stiffness.
    """

    seed: int
    t_end: float = T_END

    @cached_property
    def drawn(self) -> Mapping[str, float]:
        """Level [N], mass [kg], count [m], noise in counts, speed of change [1/s], load [N]."""
        random = np.random.default_rng(self.seed)
        level = 10.0 ** random.uniform(-1.0, 3.0)
        return {
            "level": level,
            "mass": level / 4.0 * 10.0 ** random.uniform(-0.5, 0.5),
            "count": 10.0 ** random.uniform(-7.0, -5.5),
            "noise": random.uniform(0.0, 2.0),
            "rate": random.choice([1.0, -0.5]) / 10.0 ** random.uniform(1.8, 2.5),
            "load": level * random.uniform(-0.5, 0.5),
            "at": random.uniform(0.3, 0.7),
            "frequency": random.uniform(0.3, 1.0),
        }

    def law(self, kind: type[Law], stiffness: float = 1.0) -> Law:
        """Return a law with the curve of this axis."""
        level = self.drawn["level"]
        own: dict[str, Any] = {"mu_s": 1.5 * level, "mu_d": level, "v_s": 5e-3}
        own["sigma_2"] = 5.0 * level
        springs = {"sigma_0": 5e4 * stiffness * level, "sigma_1": 75.0 * level}
        return kind(**own, **({} if kind is Stribeck else springs))

    @property
    def scale(self) -> Array:
        """True scale of the levels at each sample."""
        return np.clip(1.0 + self.drawn["rate"] * self.reference.t, 0.3, 3.0)

    @cached_property
    def reference(self) -> Reference:
        """Sine, or moves with rests."""
        f, h = self.drawn["frequency"], self.controller.h
        if self.seed % 2:
            return sine(0.02, f, self.t_end, h)
        period = 1.0 / f
        goals = [0.04, 0.0] * max(1, round(self.t_end / (2 * period)))
        return moves(goals, 0.7 * period, 0.3 * period, h)

    @cached_property
    def controller(self) -> Cascade:
        """Controller for the mass of this axis."""
        m = self.drawn["mass"]
        limit = 30.0 * max(m, self.drawn["level"])
        return Cascade(
            kp=20.0, kv=60.0 * m, ki=10.0, inertia=m, limit=limit, count=self.drawn["count"]
        )

    @property
    def position_noise(self) -> float:
        """Standard deviation of the error of the encoder [m]."""
        return self.drawn["count"] * float(np.sqrt(1 / 12 + self.drawn["noise"] ** 2))

    def loops(self, name: str = "", scales: Mapping[str, Any] | None = None, **how: Any) -> Loop:
        """Run the loop with an estimator, or with given scales."""
        kinds = (LuGre, ElastoPlastic, Stribeck)
        d, believed = self.drawn, self.law(LuGre, 0.5)
        free = ["mu_s", "mu_d", "offset"]
        plant = drive(self.law(kinds[self.seed % 3]), m=d["mass"], N=1.0, free=free)
        block = compensator(
            believed, v_blend=0.02, error_gain=20.0, offset=0.0, without=["stribeck"]
        )
        worn: dict[str, Any] = {n: self.scale * float(getattr(believed, n)) for n in free[:2]}
        worn["offset"] = d["load"] * (self.reference.t > d["at"] * self.t_end)
        if name:
            how["estimator"] = MAKE[name](
                believed, mass=d["mass"], valid=self.controller.limit,
                noise=np.sqrt(2.0) * self.position_noise / self.controller.h,
            )  # fmt: skip
        found = close_loop(
            plant, self.reference, block, controller=self.controller, p=worn,
            noise=d["noise"] * d["count"], seed=self.seed, cases={"run": scales or {}}, **how,
        )  # fmt: skip
        return found["run"]

    def horizon(self) -> Mapping[str, Array]:
        """Return scale, deviation and truth by a moving horizon, at every tenth sample of 4 s."""
        run = replace(self, t_end=4.0).loops("recursive", {})
        law = replace(self.law(Stribeck), v_eps=SMOOTH)
        level = self.drawn["level"]
        model = drive(law, m=self.drawn["mass"], N=1.0, free=["N", "offset"])
        size = run.force.size // EVERY * EVERY
        step = EVERY * self.controller.h
        force = run.force[:size].reshape(-1, EVERY).mean(axis=1)
        random = np.random.default_rng(self.seed)
        x = run.x[:size:EVERY] + self.position_noise * random.standard_normal(force.size)
        walk = np.sqrt(2 / 60)  # of the spread within a minute, as for the other estimators
        found = estimate(
            model,
            {"force": force, "x": x},
            step=step,
            horizon=10,
            unknown=["N", "offset"],
            noise={
                "x": self.position_noise, "N": walk, "offset": walk * level,
                "v": 0.05 * level * np.sqrt(step) / self.drawn["mass"],
            },
            spread={"N": 1.0, "offset": level, "x": 1e-3, "v": 1e-2},
        )  # fmt: skip
        return {
            "value": found["N"], "sd": found.deviations["N"], "true": self.scale[:size:EVERY],
            "inconsistent": found.inconsistent,
        }  # fmt: skip


def judged(value: Array, deviation: Array, true: Array, h: float) -> dict[str, float]:
    """Return lag [s], bias, largest error, and share of errors within two deviations."""
    error, rate = value - true, np.gradient(true, h)
    moving = float(np.sum(rate**2))
    lag = -float(np.sum((error - error.mean() * (moving == 0)) * rate)) / moving if moving else 0.0
    return {
        "lag [s]": lag,
        "bias": float(error.mean()),
        "largest error": float(np.abs(error).max()),
        "within 2 deviations [%]": 100 * float(np.mean(np.abs(error) < 2 * deviation)),
    }


def online(quick: bool) -> Iterator[Found]:
    """Compare estimates with the truth in closed loops with random axes, changes and noise.

    Levels, masses and encoders differ by decades, friction doubles within 1 to 5 minutes or halves,
    half of the references rest, loads jump, and two thirds of the plants have another law. Settings
    are the defaults, with mass, noise of the velocity and limit of the force. The errors after the
    first 8 s are relative to the levels of the law. With `quick`, one loop of 12 s, and no moving
    horizon.
    """
    axes = [Axis(0, QUICK)] if quick else [Axis(seed) for seed in range(SEEDS)]
    right = [axis.loops(scales={"scale_coulomb": axis.scale}).rms for axis in axes]
    begin = round(SETTLED / axes[0].controller.h)
    for name in MAKE:
        seconds, runs = timed(lambda name=name: [axis.loops(name) for axis in axes])
        rows = [
            judged(
                run.estimates["scale_coulomb"][begin:],
                run.estimates["scale_coulomb_sd"][begin:],
                axis.scale[begin : run.force.size],
                axis.controller.h,
            )
            for axis, run in zip(axes, runs, strict=True)
        ]
        ratios = [run.rms / best for run, best in zip(runs, right, strict=True)]
        for row, own in zip(rows, ratios, strict=True):
            row["error over that of true levels"] = own
        yield from _rows(name, rows)
        ratio, worst = float(np.median(ratios)), max(ratios)
        yield goal(f"{name}: median error over that of true levels", ratio, 1.5, "<=", seconds,
                   f"{len(axes)} loops, worst {worst:.3g}")  # fmt: skip
        yield goal(f"{name}: differing numbers in C and Python", _differing(name, axes[:4]), 0)
    if not quick:
        yield from horizons([Axis(seed) for seed in STATIC])


def horizons(axes: Sequence[Axis]) -> Iterator[Found]:
    """Yield the rows of moving horizons over the first 4 s, without the first second."""
    seconds, found = timed(lambda: [axis.horizon() for axis in axes])
    h, begin = EVERY * axes[0].controller.h, 100
    rows = [judged(f["value"][begin:], f["sd"][begin:], f["true"][begin:], h) for f in found]
    yield from _rows("moving horizon, 100 Hz", rows)
    wrong = [row["within 2 deviations [%]"] < WRONG for row in rows]
    doubted = [f["inconsistent"].size > 0 for f in found]
    missed = sum(a and not b for a, b in zip(wrong, doubted, strict=True))
    yield goal("moving horizon: wrong deviations without a doubt", missed, 0)
    yield (
        f"moving horizon: deviations of {sum(wrong)} of {len(rows)} loops are wrong, those of "
        f"{sum(doubted)} are doubted"
    )
    steps = sum(f["true"].size for f in found)
    yield f"moving horizon: {1e3 * seconds / steps:.3g} ms of processor time per sample"


def _rows(name: str, rows: list[dict[str, float]]) -> Iterator[Found]:
    """Yield the medians and the worst values of several loops."""
    columns = {what: [row[what] for row in rows] for what in rows[0]}
    middle = {what: float(np.median(values)) for what, values in columns.items()}
    yield TITLE, {"estimator": name, "of": f"median of {len(rows)}", **middle}
    worst = {
        what: min(values) if what.startswith("within") else max(values, key=abs)
        for what, values in columns.items()
    }
    yield TITLE, {"estimator": name, "of": "worst", **worst}


def _differing(name: str, axes: list[Axis]) -> int:
    """Return how many numbers of short loops differ between C and CasADi's VM."""
    count = 0
    for axis in (Axis(a.seed, SHORT) for a in axes):
        one, other = (axis.loops(name, backend=b) for b in ("c", "vm"))
        pairs = [(one.x, other.x), *((v, other.estimates[n]) for n, v in one.estimates.items())]
        count += sum(int(np.sum(a != b)) for a, b in pairs)
    return count
