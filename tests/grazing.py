"""Machines whose contacts just stick, or just do not: next to where a parameter changes that."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np

from symfric import ExactCoulomb, Model, drive, rabinowicz, simulate
from symfric.scenes import CoupledBlocks, Pendulum

LAW = ExactCoulomb(mu_s=0.3, mu_d=0.2, sigma_2=0.1)
FREE = ("mu_s", "mu_d", "sigma_2")
Rng = np.random.Generator


@dataclass(frozen=True)
class Grazing:
    """A machine, and the range of the parameter that is changed."""

    model: Model
    p: dict[str, float]
    changed: str
    low: float
    high: float
    t_end: float
    max_step: float
    u: dict[str, Any]

    def happened(self, value: float, exact: bool = False) -> list[tuple[float, str]]:
        """Events with `changed` at a value."""
        more: dict[str, Any] = {"rtol": 1e-11, "max_step": self.max_step} if exact else {}
        p = self.p | {self.changed: value}
        return [*simulate(self.model, self.t_end, p=p, u=self.u, samples=2, **more).happened]

    def limit(self, low: float, high: float) -> float | None:
        """Value between two others where the events of exact runs change; None if they do not."""

        def names(value: float) -> list[str]:
            return [name for _, name in self.happened(value, exact=True)]

        below = names(low)
        if below == names(high):
            return None
        while high - low > 1e-9 * high:
            middle = (low + high) / 2
            low, high = (middle, high) if names(middle) == below else (low, middle)
        return high


def levels(rng: Rng) -> dict[str, float]:
    """Friction and mass at random."""
    mu_s = rng.uniform(0.1, 0.6)
    friction = {"mu_s": mu_s, "mu_d": mu_s * rng.uniform(0.3, 0.95)}
    return friction | {"sigma_2": rng.uniform(0.0, 1.0), "m": rng.uniform(0.2, 3.0)}


@cache
def machines() -> tuple[Callable[[Rng], Grazing], ...]:
    """Scenes with random parameters."""
    belt = rabinowicz(LAW, free=[*FREE, "m", "k", "v_belt"])
    blocks = CoupledBlocks(LAW).model(["v_belt", "k_1", "k_2", "k_c", "start_2"])
    rod = Pendulum(ExactCoulomb(mu_s=0.3, mu_d=0.2), R=0.1).model(["mu_s", "mu_d"])
    axis = drive(LAW, free=[*FREE, "m", "N", "offset"])

    def on_belt(rng: Rng) -> Grazing:
        p = levels(rng) | {"k": rng.uniform(1.0, 30.0)}
        period = 2 * np.pi * np.sqrt(p["m"] / p["k"])
        return Grazing(belt, p, "v_belt", 0.02, 3.0, 8 * period, period / 100, {})

    def on_two(rng: Rng) -> Grazing:
        p = {name: rng.uniform(1, 9) for name in ("k_1", "k_2", "k_c")}
        p |= {"start_2": rng.uniform(0.0, 0.5)}
        return Grazing(blocks, p, "v_belt", 0.05, 2.0, 6.0, 0.02, {})

    def on_rod(rng: Rng) -> Grazing:
        mu_s = rng.uniform(0.2, 0.9)
        low = mu_s * rng.uniform(0.2, 0.5)
        return Grazing(rod, {"mu_s": mu_s}, "mu_d", low, mu_s * 0.95, 8.0, 0.02, {})

    def on_axis(rng: Rng) -> Grazing:
        p, rate, size = levels(rng) | {"N": 8.0}, rng.uniform(1.0, 12.0), rng.uniform(0.5, 4.0)
        load = {"force": lambda t: size * ca.sin(rate * t)}
        return Grazing(axis, p, "offset", 0.0, 6.0, 30 / rate, 0.05 / rate, load)

    return on_belt, on_two, on_rod, on_axis


def wrong(seed: int, count: int) -> list[str]:
    """Runs a share of 1e-5 to 1e-2 next to a limit whose events are not those of exact runs."""
    rng, found = np.random.default_rng(seed), list[str]()
    for number in range(count):
        limit = None
        while limit is None:
            case = machines()[number % 4](rng)
            limit = case.limit(*np.sort(rng.uniform(case.low, case.high, 2)).tolist())
        value = limit * (1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-5, -2))
        exact, run = case.happened(value, exact=True), case.happened(value)
        late = abs(exact[-1][0] - run[-1][0]) if exact and run else 0.0
        if len(exact) != len(run) or late > 1e-3 * case.t_end:
            found.append(
                f"{case.model.name} {case.p}, {case.changed} = {value}: {run}, not {exact}"
            )
    return found
