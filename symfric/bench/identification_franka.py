"""Joint friction of an arm at low speed: fitted on the first half of a record, judged on the rest.

Measured at joints 2 and 7 with reversals (some 400 Hz); the paper that published them reports .280
and .260 N m for its LuGre and .077 and .035 for its neural network, trained on other motions.
"""

from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from symfric import GMS, Element, LuGre
from symfric.bench.identification import Row
from symfric.laws import Law

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "franka_low_speed"
CASES = {3: ("q2", 0.148), 4: ("q7", 0.046)}
"""Case -> joint, goal [N m]."""
ELEMENTS = 3
THIN = 2
"""Every so many samples: the elements slip over more than one of them."""
GEARED = (
    "met only by parameters that the law refuses: mu_s below mu_d and sigma_2 below 0 leave .045"
)


def measure(quick: bool) -> Iterator[Row]:
    """LuGre and GMS under the measured velocity, from the data's own starts; some 15 s in all."""
    del quick
    for case, (joint, goal) in CASES.items():
        path = FOLDER / f"case{case}_slow.csv"
        for name, law, free in _laws():
            what = f"case {case}, {name}: RMSE of the second half [N m]"
            if not path.is_file():
                yield Row("franka", what, np.nan, goal, "<=", 0.0, f"{path} is not here")
                continue
            begun = process_time()
            value = _error(path, joint, law, free)
            note = GEARED if (case, name) == (4, "LuGre") else ""
            yield Row("franka", what, value, goal, "<=", process_time() - begun, note)


def _laws() -> Iterator[tuple[str, Law, list[str]]]:
    """Laws and what is free beside levels, viscous coefficient and Stribeck velocity."""
    yield "LuGre", LuGre(), ["delta"]
    elements = tuple(Element(1e3, 1 / ELEMENTS) for _ in range(ELEMENTS))
    stiffnesses = [f"k_{i + 1}" for i in range(ELEMENTS)]
    shares = [f"alpha_{i + 1}" for i in range(1, ELEMENTS)]
    free = ["delta", "C", *stiffnesses, *shares]
    yield f"GMS of {ELEMENTS}", GMS(elements=elements, form="event"), free


def halves(path: Path, joint: str) -> tuple[Dataset, Dataset]:
    """Friction and velocity; the velocity by differences of the encoder, which knows the path."""
    columns = {"t": "time", "x": joint, "F": f"{joint}_tau_J_compensate"}
    units = {"t": "s", "x": "rad", "F": "N m"}
    record = Dataset.read(path, columns=columns, units=units).thinned(THIN)[0]
    v = np.gradient(record["x"], record.time)
    si = {"v": "rad/s", "F": "N m"}
    return Dataset.of(t=record.time, v=v, F=record["F"], units=si, name=path.stem).split(0.5)


def _error(path: Path, joint: str, law: Law, free: list[str]) -> float:
    first, rest = halves(path, joint)
    fit = Fit(Points(offset=True), law, first, free=free, starts=3, evaluations=120)
    found = fit.solve(throw=False).validate(rest)
    return max(error.rms for error in found.values())
