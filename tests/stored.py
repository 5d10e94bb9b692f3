"""References that take long to compute lie in `tests/golden/references`, one CSV file each.

`pytest --update-golden` writes them; `pytest --recompute`, which `make stress` runs, computes them
again and compares.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from symfric.foundation.numeric import Array

FOLDER = Path(__file__).parent / "golden" / "references"
chosen = {"update": False, "recompute": False}
"""The option of the command line; set by `conftest.pytest_configure`."""


def stored(name: str, compute: Callable[[], Array]) -> Array:
    """The rows of the reference `name`, which `compute` gives."""
    path = FOLDER / f"{name}.csv"
    if chosen["update"]:
        FOLDER.mkdir(parents=True, exist_ok=True)
        np.savetxt(path, np.atleast_2d(compute()), delimiter=",", fmt="%.17g")
    rows = np.loadtxt(path, delimiter=",", ndmin=2)
    if chosen["recompute"]:
        size = np.abs(rows).max(axis=1, keepdims=True)
        np.testing.assert_allclose(np.atleast_2d(compute()) / size, rows / size, atol=1e-7, rtol=0)
    return rows
