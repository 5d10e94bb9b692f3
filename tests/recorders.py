"""What recorders write: a file, a frame, and two recorders whose clocks differ."""

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.data.dataset import Dataset

Array = np.ndarray
Signal = Callable[[Array], Array]

GERMAN = """Messung;;;
Zeit;Winkel;Moment;Bemerkung
s;°;Nm;
0,00;0,0;1,0;
0,01;90,0;;Stoss
0,02;180,0;3,0;
0,03;;4,0;
0,04;360,0;5,0;
"""


class Frame:
    """What pandas and polars have in common."""

    def __init__(self, columns: dict[str, Any]) -> None:
        self.columns = list(columns)
        self._held = columns

    def __getitem__(self, key: str) -> Any:
        return self._held[key]


def lively(seed: int) -> Signal:
    """Twelve sines of up to 2.5 Hz."""
    rng = np.random.default_rng(seed)
    size, w, phase = rng.normal(size=12), 2 * np.pi * rng.uniform(0.1, 2.5, 12), rng.random(12) * 6
    return lambda t: (size[:, None] * np.sin(w[:, None] * t + phase[:, None])).sum(0)


def pair(
    f: Signal, shift: float, rates: tuple[float, float] = (500.0, 500.0), drift: float = 0.0,
    noise: float = 0.0, gain: float = 1.0, end: float = 20.0,
    gap: tuple[float, float] = (0.0, 0.0),
) -> tuple[Dataset, Dataset]:  # fmt: skip
    """Return y of both recorders, and z = cos 3 t (true time) of the second."""
    rng = np.random.default_rng(1)
    t, true = np.arange(0, end, 1 / rates[0]), np.arange(0.3, end - 0.2, 1 / rates[1])
    true = true[(true <= gap[0]) | (true >= gap[1])]
    clock = true - shift - drift * (true - t.mean())
    second = gain * f(true) + 3 + noise * rng.standard_normal(true.size)
    return (
        Dataset.of(t=t, x=f(t) + noise * rng.standard_normal(t.size), name="a"),
        Dataset.of({"t": clock, "y": second, "z": np.cos(3 * true)}, name="b"),
    )
