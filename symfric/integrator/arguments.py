"""Argument checks shared by the entry points of the integrator."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.integrator.equations.inputs import InputData
from symfric.integrator.methods.method import Method
from symfric.integrator.methods.radau import Radau
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS
from symfric.integrator.running.run import MANY_STEPS, Tolerances
from symfric.model import Model
from symfric.model import check_model as check_model

LOOSE = 1e-5
"""Relative tolerance above which whole stick phases may be missed without notice."""
BACKENDS = ("auto", "vm", "compiled")
"""Engines: the faster one, CasADi's virtual machine, and machine code of the step."""
MOST_SAMPLES = 10**7
"""Largest number of samples; beyond it, the array of times alone takes gigabytes."""


def check_span(
    where: str, model: Model, t_start: float, t_end: float, rtol: float, stacklevel: int = 4
) -> tuple[float, float, float]:
    """Return start and end [s] and the relative tolerance, limited to that of the model's events.

    A loose tolerance issues a warning for the line `stacklevel` calls above this function.

    Raises:
        ValueError: a value that is not a number, an empty span, or a tolerance out of range.
    """
    t_start = checks.number(f"{where}: t_start", t_start, unit="s")
    t_end = checks.number(f"{where}: t_end", t_end, unit="s")
    if t_end <= t_start:
        raise ValueError(f"{where}: expected t_end > t_start = {t_start:g} s, got {t_end:g} s")
    rtol = checks.number(f"{where}: rtol", rtol, lower=1e-13, upper=0.1)
    rtol = min((event.rtol for event in model.events if event.rtol < rtol), default=rtol)
    warn_of_loose(where, rtol, stacklevel)
    return t_start, t_end, rtol


def warn_of_loose(where: str, rtol: float, stacklevel: int) -> None:
    """Warn of a loose relative tolerance."""
    if rtol > LOOSE:
        warnings.warn(
            f"{where}: rtol = {rtol:g} is above {LOOSE:g}; whole stick phases may be lost "
            "without notice, compare with a tighter run",
            UserWarning,
            stacklevel=stacklevel,
        )


def check_times(where: str, t_start: float, t_end: float, t_eval: ArrayLike) -> Array:
    """Return `t_eval` as a new array of increasing times inside the span."""
    given: Any = t_eval
    if type(given) is np.ndarray and given.dtype == float and given.ndim == 1 and given.size:
        # the usual case, five times faster than below
        inside = t_start <= given[0] and given[-1] <= t_end
        if inside and np.count_nonzero(given[1:] > given[:-1]) == given.size - 1:
            return given.copy()
    return checks.times(f"{where}: t_eval", t_eval, t_start, t_end)


def result_times(
    where: str, t_start: float, t_end: float, t_eval: ArrayLike | None, samples: int
) -> Array:
    """Return the times of the result [s]: `t_eval`, or `samples` equally spaced ones."""
    samples = checks.count(f"{where}: samples", samples, least=2, most=MOST_SAMPLES)
    if t_eval is None:
        return np.linspace(t_start, t_end, samples)
    return check_times(where, t_start, t_end, t_eval)


def check_flags(where: str, progress: object = None, **flags: object) -> None:
    """Check that the flags are bool and that `progress`, if given, is callable."""
    for name, value in flags.items():
        if value is not True and value is not False:
            checks.flag(f"{where}: {name}", value)
    if progress is not None:
        checks.function(f"{where}: progress", progress, "a function of the fraction done")


def tolerances(
    where: str,
    rtol: float,
    atol: float | None,
    nominal: Array,
    event_tolerance: float,
    max_steps: int | None,
    max_step: float | None = None,
) -> Tolerances:
    """Return the checked tolerances and limits of a run.

    Args:
        where: name of the caller in messages.
        rtol: relative tolerance.
        atol: absolute tolerance in multiples of `nominal`; 0.1 rtol by default.
        nominal: typical magnitude of each state.
        event_tolerance: tolerance of event times [s].
        max_steps: largest number of attempts; with None it follows from the progress of the run.
        max_step: longest step [s]; unlimited by default.
    """
    relative = 0.1 * rtol if atol is None else checks.number(f"{where}: atol", atol, above=0.0)
    event = checks.number(f"{where}: event_tolerance", event_tolerance, unit="s", above=0.0)
    extends = max_steps is None
    attempts = MANY_STEPS if extends else checks.count(f"{where}: max_steps", max_steps)
    longest = np.inf
    if max_step is not None:
        longest = checks.number(f"{where}: max_step", max_step, unit="s", above=0.0)
    return Tolerances(rtol, relative * nominal, event, attempts, longest, atol is None, extends)


def stopping(
    where: str, inputs: InputData, times: ArrayLike, t_start: float, t_end: float
) -> InputData:
    """Return `inputs` with additional times [s] at which a step has to end."""
    if (isinstance(times, tuple) and not times) or np.size(times) == 0:
        return inputs
    return inputs.stopping_at(checks.times(f"{where}: times", times, t_start, t_end))


def another(method: Method) -> str:
    """Return the name of an iterative formula if `method` is not iterative, and vice versa."""
    return "rodas5p" if isinstance(method, Radau) else "radau5"


def chosen(where: str, name: str, rtol: float) -> Method:
    """Return the adaptive method of this name; "auto" is Rodas5P, and Radau5 at loose tolerances.

    Raises:
        ValueError: an unknown name, or a method with fixed steps.
    """
    name = checks.choice(f"{where}: method", name, ["auto", *METHODS])
    if name in METHODS and name not in ADAPTIVE:
        raise ValueError(
            f"{where}: method: expected one with error control, one of {', '.join(ADAPTIVE)}, got "
            f"{name}, which has fixed steps; use it with flow or in the C of plants"
        )
    automatic = "radau5" if rtol > LOOSE else "rodas5p"
    return ADAPTIVE[automatic if name == "auto" else name]
