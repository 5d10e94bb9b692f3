"""Machines whose contacts just stick, or just do not: next to where a parameter changes that."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric import ExactCoulomb, Model, Trajectory, drive, rabinowicz, simulate
from symfric.scenes import CoupledBlocks, Pendulum

Array = NDArray[np.float64]
LAW = ExactCoulomb(mu_s=0.3, mu_d=0.2, sigma_2=0.1)
FREE = ("mu_s", "mu_d", "sigma_2")


@dataclass(frozen=True)
class Grazing:
    """A machine and what is changed of it."""

    scene: str
    model: Model
    p: dict[str, float]
    changed: str
    t_end: float
    u: dict[str, Any]
    max_step: float

    def run(self, value: float, exact: bool = False) -> Trajectory:
        """With `changed` at a value."""
        more: dict[str, Any] = {"rtol": 1e-11, "max_step": self.max_step} if exact else {}
        p = self.p | {self.changed: value}
        return simulate(self.model, self.t_end, p=p, u=self.u, samples=2, **more)

    def names(self, value: float, exact: bool = False) -> list[str]:
        """Of all events."""
        return [name for _, name in self.run(value, exact).happened]

    def limit(self, low: float, high: float) -> float | None:
        """Where between two values the events of exact runs change; None if they do not."""
        below, above = self.names(low, True), self.names(high, True)
        if below == above:
            return None
        while high - low > 1e-9 * high:
            middle = (low + high) / 2
            low, high = (middle, high) if self.names(middle, True) == below else (low, middle)
        return high


Draw = Callable[[np.random.Generator], tuple[Grazing, float, float]]


def levels(rng: np.random.Generator) -> dict[str, float]:
    """Friction at random."""
    mu_s = rng.uniform(0.1, 0.6)
    return {"mu_s": mu_s, "mu_d": mu_s * rng.uniform(0.3, 0.95), "sigma_2": rng.uniform(0.0, 1.0)}


@cache
def machines() -> dict[str, Draw]:
    """Each scene with its parameters at random, and the range of the one that is changed."""
    belt = rabinowicz(LAW, free=[*FREE, "m", "k", "v_belt"])
    blocks = CoupledBlocks(LAW).model(["v_belt", "k_1", "k_2", "k_c", "start_2"])
    rod = Pendulum(ExactCoulomb(mu_s=0.3, mu_d=0.2), R=0.1).model(["mu_s", "mu_d"])
    axis = drive(LAW, free=[*FREE, "m", "N", "offset"])

    def on_belt(rng: np.random.Generator) -> tuple[Grazing, float, float]:
        p = levels(rng) | {"m": rng.uniform(0.2, 3.0), "k": rng.uniform(1.0, 30.0)}
        period = 2 * np.pi * np.sqrt(p["m"] / p["k"])
        return Grazing("belt", belt, p, "v_belt", 8 * period, {}, period / 100), 0.02, 3.0

    def on_two(rng: np.random.Generator) -> tuple[Grazing, float, float]:
        p = {"k_1": rng.uniform(1, 9), "k_2": rng.uniform(1, 9), "k_c": rng.uniform(0.5, 9)}
        p |= {"start_2": rng.uniform(0.0, 0.5)}
        return Grazing("two blocks", blocks, p, "v_belt", 6.0, {}, 0.02), 0.05, 2.0

    def on_rod(rng: np.random.Generator) -> tuple[Grazing, float, float]:
        mu_s = rng.uniform(0.2, 0.9)
        low = mu_s * rng.uniform(0.2, 0.5)
        case = Grazing("pendulum", rod, {"mu_s": mu_s}, "mu_d", 8.0, {}, 0.02)
        return case, low, mu_s * 0.95

    def on_axis(rng: np.random.Generator) -> tuple[Grazing, float, float]:
        p = levels(rng) | {"m": rng.uniform(0.2, 3.0), "N": 8.0}
        rate, size = rng.uniform(1.0, 12.0), rng.uniform(0.5, 4.0)
        load = {"force": lambda t: size * ca.sin(rate * t)}
        case = Grazing("drive", axis, p, "offset", 30 / rate, load, 0.05 / rate)
        return case, 0.0, 6.0

    return {"belt": on_belt, "two blocks": on_two, "pendulum": on_rod, "drive": on_axis}


SCENES = ("belt", "two blocks", "pendulum", "drive")


def drawn(seed: int, number: int, attempt: int) -> tuple[Grazing, float, float]:
    """Machine `number`, scene by scene, and two values of what is changed."""
    rng = np.random.default_rng([seed, number, attempt])
    case, low, high = machines()[SCENES[number % len(SCENES)]](rng)
    low, high = np.sort(rng.uniform(low, high, 2)).tolist()
    return case, low, high


def near_limits(seed: int, count: int) -> Array:
    """Rows of attempt, value next to a limit, number of events of the exact run, last time.

    At shares of 1e-5 to 1e-2 aside, on both sides in turn.
    """
    rng = np.random.default_rng(seed)
    rows: list[list[float]] = []
    for number in range(count):
        limit, attempt = None, -1
        while limit is None:
            attempt += 1
            case, low, high = drawn(seed, number, attempt)
            limit = case.limit(low, high)
        side = 1 if number // len(SCENES) % 2 else -1
        value = limit * (1 + side * 10 ** rng.uniform(-5, -2))
        happened = case.run(value, exact=True).happened
        rows.append([attempt, value, len(happened), happened[-1][0] if happened else 0.0])
    return np.array(rows)


def wrong(seed: int, rows: Array) -> list[str]:
    """Runs at default settings whose events are not those of the rows."""
    found: list[str] = []
    for number, (attempt, value, count, last) in enumerate(rows.tolist()):
        case = drawn(seed, number, int(attempt))[0]
        run = case.run(value)
        here = run.happened[-1][0] if run.happened else 0.0
        if len(run.happened) != count or abs(here - last) > 1e-3 * case.t_end:
            said = f"{len(run.happened)} events up to {here} s, not {count:g} up to {last} s"
            found.append(f"{case.scene} {case.p}, {case.changed} = {value}: {said}")
    return found
