"""How `simulate` is to run: numbers that are checked once, and remembered with their model.

Loops over parameters call with the same settings again and again, and a short run takes less time
than the checks of its arguments.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.memory import remember
from symfric.integrator.arguments import (
    check_span,
    chosen,
    result_times,
    tolerances,
    warn_of_loose,
)
from symfric.integrator.methods.method import Method
from symfric.integrator.running.run import Tolerances
from symfric.model import Model

Array = NDArray[np.float64]
PLAIN: frozenset[type] = frozenset((float, int, bool, str, type(None)))
REMEMBERED, MOST_TIMES = 16, 10_000
"""Settings kept per model, the oldest goes first; and how many times of results one may have."""


@final
@dataclass(frozen=True, eq=False)
class Settings:
    """Checked settings of a model.

    Attributes:
        t_start, t_end: span [s].
        formula: the method.
        allowed: tolerances; its `atol` is that of the model's states.
        times: of the result [s]; not to be handed out, others share them.
    """

    t_start: float
    t_end: float
    formula: Method
    allowed: Tolerances
    times: Array


def settings(
    model: Model,
    t_start: float,
    t_end: float,
    rtol: float,
    atol: float | None,
    samples: int,
    method: str,
    event_tolerance: float,
    max_steps: int | None,
    max_step: float | None,
) -> Settings:
    """Check how `simulate` is to run; arguments as there.

    Raises:
        ValueError: bad input.

    Warns:
        UserWarning: a loose tolerance.
    """
    asked = (
        t_start, t_end, rtol, atol, samples, method, event_tolerance, max_steps, max_step
    )  # fmt: skip
    known: dict[Hashable, Settings] = model.memory.setdefault("settings", {})
    # 1.0 and True are equal, and only one of them is a time
    key = (*asked, *map(type, asked))
    if not PLAIN.issuperset(key[len(asked) :]):
        return _checked(model, *asked)  # arrays and expressions of a number are numbers, no keys
    found = known.get(key)
    if found is not None:
        warn_of_loose("simulate", found.allowed.rtol, stacklevel=4)
        return found
    found = _checked(model, *asked)
    if found.times.size <= MOST_TIMES:
        remember(known, key, found, REMEMBERED)
    return found


def _checked(
    model: Model,
    t_start: float,
    t_end: float,
    rtol: float,
    atol: float | None,
    samples: int,
    method: str,
    event_tolerance: float,
    max_steps: int | None,
    max_step: float | None,
) -> Settings:
    t_start, t_end, rtol = check_span("simulate", model, t_start, t_end, rtol, stacklevel=6)
    formula = chosen("simulate", method, rtol)
    times = result_times("simulate", t_start, t_end, None, samples)
    nominal = model.nominal("x")
    allowed = tolerances("simulate", rtol, atol, nominal, event_tolerance, max_steps, max_step)
    return Settings(t_start, t_end, formula, allowed, times)
