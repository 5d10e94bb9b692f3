"""Moves of the identified drive: the fastest, and that of least effort in 1.5 times its duration.

`symfric demo` copies this file to the folder of the moves. The largest speed in the record bounds
the speed, since friction is unknown beyond it.
"""

import json
from dataclasses import replace
from pathlib import Path

from identification import Fitted
from ocp import Free, Problem, rest_to_rest

HERE = Path(__file__).parent
DISTANCE, LIMIT = 0.05, 200.0
"""Distance of the moves [m], and largest force [N]."""


def fastest() -> Problem:
    """Return the move in minimum time."""
    return move(Free(0.05, 10.0, guess=0.5))


def least_effort() -> Problem:
    """Return the move with the least integral of force^2, slower than the fastest one."""
    return move(1.5 * json.loads((HERE / "fastest.json").read_text(encoding="utf-8"))["T"])


def move(T: float | Free) -> Problem:
    """Return the move of duration T [s]."""
    fit = Fitted.from_json(HERE.parent / "identification" / "fit.json")
    problem = rest_to_rest(fit.model, DISTANCE, T, limit=LIMIT)
    speed = 0.1 if fit.curve is None else float(abs(fit.curve.law.t).max())
    return replace(problem, bounds={**problem.bounds, "v": (-speed, speed)})
