"""References of a position loop: position, velocity and acceleration at every sample."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Reference:
    """What a position loop is to follow, sample by sample, each of shape (n,).

    Attributes:
        x, v, a: position [m], velocity [m/s], acceleration [m/s^2].
        h: sample time [s].
    """

    x: Array
    v: Array
    a: Array
    h: float = 1e-3

    def __post_init__(self) -> None:
        found = [checks.array(f"Reference: {name}", getattr(self, name)) for name in "xva"]
        sizes = [one.size for one in found]
        if len(set(sizes)) > 1 or sizes[0] < 2:
            raise ValueError(f"Reference: expected x, v, a of one length >= 2, got {sizes}")
        for name, one in zip("xva", found, strict=True):
            object.__setattr__(self, name, one)
        h = checks.number("Reference: h", self.h, unit="s", above=0.0)
        object.__setattr__(self, "h", h)

    def __repr__(self) -> str:
        """One line."""
        return f"<Reference: {self.x.size} samples of {self.h:g} s>"

    @property
    def t(self) -> Array:
        """Times of the samples [s]."""
        return self.h * np.arange(float(self.x.size))

    @property
    def rest(self) -> slice | None:
        """The second half of the time after the last motion; None without a rest of ten samples."""
        last = int(np.flatnonzero(np.diff(self.x) != 0).max(initial=-1)) + 1
        begin = (last + self.x.size) // 2
        return slice(begin, None) if self.x.size - begin >= 10 else None


def sine(amplitude: float, frequency: float, t_end: float, h: float = 1e-3) -> Reference:
    """A (1 - cos(2 pi f t)) / 2 ... a sine between 0 and 2 A that begins at rest.

    Args:
        amplitude: A [m].
        frequency: f [Hz].
        t_end: [s].
        h: sample time [s].
    """
    A = checks.number("sine: amplitude", amplitude, unit="m")
    w = 2 * np.pi * checks.number("sine: frequency", frequency, unit="Hz", above=0.0)
    t = _times("sine", t_end, h)
    return Reference(A * (1 - np.cos(w * t)), A * w * np.sin(w * t), A * w**2 * np.cos(w * t), h)


def step(height: float, t_end: float, t_step: float = 0.1, h: float = 1e-3) -> Reference:
    """A jump of the position, without a velocity, and rest after it."""
    height = checks.number("step: height", height, unit="m")
    t = _times("step", t_end, h)
    return Reference(np.where(t >= t_step, height, 0.0), 0 * t, 0 * t, h)


def moves(goals: Sequence[float], duration: float, rest: float, h: float = 1e-3) -> Reference:
    """From 0 to one goal [m] after the other, each in `duration` and then at `rest` [s].

    Each move is of fifth order, at rest at both ends with no acceleration.
    """
    places = checks.array("moves: goals", goals)
    duration = checks.number("moves: duration", duration, unit="s", above=0.0)
    rest = checks.number("moves: rest", rest, unit="s", lower=0.0)
    period = duration + rest
    t = _times("moves", period * places.size, h)
    before = np.append(0.0, places[:-1])
    k = np.minimum((t / period).astype(int), places.size - 1)
    s = np.clip((t - k * period) / duration, 0.0, 1.0)
    way = (places - before)[k]
    x = before[k] + way * s**3 * (10 - 15 * s + 6 * s**2)
    v = way / duration * 30 * s**2 * (1 - s) ** 2
    a = way / duration**2 * 60 * s * (1 - s) * (1 - 2 * s)
    return Reference(np.where(s == 1.0, places[k], x), v, a, h)


def _times(where: str, t_end: float, h: float) -> Array:
    h = checks.number(f"{where}: h", h, unit="s", above=0.0)
    t_end = checks.number(f"{where}: t_end", t_end, unit="s", lower=2 * h)
    return np.arange(float(round(t_end / h))) * h
