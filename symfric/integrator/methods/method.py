"""Base class of integration methods, and numerically stable pivots for their matrices."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from symfric.foundation.numeric import Array
from symfric.integrator.equations.initial import consistent, first_guess
from symfric.integrator.equations.matrices import (
    SOUND,
    Factors,
    Order,
    backward_error,
    best_order,
    regular,
)
from symfric.integrator.equations.system import System
from symfric.model import Model


class Trial(NamedTuple):
    """One step of length h from y, as SX or MX columns (n, 1).

    Attributes:
        end: solution at the end of the step.
        error: estimate of the error of `end`; None for a method of fixed steps.
        dense: coefficients d_1, d_2, ... of the dense output (see `Dense`).
        corrections: last two Newton corrections of `end`; empty without iterations.
        shift: displacement of `end` onto the constraints of a mechanism; None without constraints.
    """

    end: Any
    error: Any = None
    dense: tuple[Any, ...] = ()
    corrections: tuple[Any, ...] = ()
    shift: Any = None


Trials = Callable[[Any, Any, Any], Trial]
"""(y, h, d) -> the step of a method on one system; its blocks are inlined in SX, calls in MX."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Method(ABC):
    """Integration method: its coefficients, its known properties, and its steps.

    Attributes:
        name: name in the literature.
        order: order of the solution, for ODEs and (if `dae`) for index-1 DAEs.
        embedded: order of the solution behind the error estimate; 0 for methods of fixed steps.
        dense: order of the dense output for ODEs; 0 if there is none.
        dense_dae: order of the dense output for index-1 DAEs.
        H: coefficients of the dense output in terms of the stages, shape (r, s).
        finer: factor by which the change of a sliding velocity near zero in one step is limited
            more than usual (`methods.attempt`).
        source: publication of the coefficients.
    """

    name: str
    order: int
    embedded: int = 0
    dense: int = 0
    dense_dae: int = 0
    H: Array = field(default_factory=lambda: np.zeros((0, 0)))
    finer: float = 1.0
    source: str

    dae: ClassVar[bool] = True
    """True if the method accepts algebraic unknowns and mass matrices."""

    @property
    def diagonal(self) -> float | None:
        """Coefficient gamma of W = M / (gamma h) - J; None if explicit or without error control."""
        return None

    @property
    def adaptive(self) -> bool:
        """True if the method estimates its error, as `simulate` requires."""
        return self.embedded > 0

    @abstractmethod
    def work(self, system: System) -> tuple[int, int, int]:
        """Return the numbers of right-hand sides, Jacobians and factorisations per step."""

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Return the factors of all matrices in steps on `system`; none for an explicit method."""
        return ()

    def bends(self, k: Sequence[Any]) -> tuple[Any, ...]:
        """Return the coefficients of the dense output from the stages k."""
        return tuple(combination(row, k, type(k[0])) for row in self.H)

    @abstractmethod
    def trials(self, system: System) -> Trials:
        """Return the steps of the method on `system`.

        Raises:
            ValueError: the system has algebraic unknowns or a mass matrix, and `dae` is False.
        """


def combination(weights: Iterable[float], columns: Iterable[Any], kind: Any) -> Any:
    """Return the weighted sum of columns of the given type, without terms of weight zero."""
    terms = (float(w) * c for w, c in zip(weights, columns, strict=True) if w != 0.0)
    return sum(terms, start=kind(0))


Point = tuple[Array, Array]
"""Unknowns y and run data d."""

STEPS = (1e-8, 1e-5, 1e-2)
"""Steps, relative to the span, at which matrices are evaluated: a first step and typical ones."""
ASIDE = 1e-2
"""Relative distance of samples from a point, at which some entries may vanish by chance."""


def suited(system: System, method: Method, points: Sequence[Point], span: float) -> System:
    """Return `system` with other pivots if its own are unstable at the last of `points`.

    Stable orders are kept, since they have least fill.

    Args:
        system: system to integrate.
        method: method with the matrices that its steps solve with.
        points: points that a run has to pass, the newest last.
        span: duration of the run [s].
    """
    if not system.has_pivots:
        return system
    found: dict[str, Order] = {}
    for factors in method.factors(system):
        newest = _samples(factors, points[-1:], span)
        before = backward_error(newest, factors.order)
        if before <= SOUND or not any(regular(A) for A in newest):
            continue
        beside = [(_aside(system, y, sign), d) for y, d in points for sign in (-1.0, 1.0)]
        order = best_order(factors.pattern, _samples(factors, [*points, *beside], span))
        if backward_error(newest, order) < before:
            found[factors.name] = order
    return replace(system, orders={**system.orders, **found}) if found else system


def suited_to_start(system: System, method: Method, model: Model) -> System:
    """Return `system` with stable pivots at the start values of the model, for fixed steps.

    Args:
        system: system whose run data are parameters and inputs.
        method: as in `suited`.
        model: model with the start values; if these are not consistent, nothing changes.
    """
    if not system.has_pivots:
        return system
    y = first_guess(system, model, model.initial_state())
    d = np.concatenate([model.values("p"), model.values("u")])
    with suppress(ValueError):
        return suited(system, method, [(consistent(system, "start", y, d), d)], 1.0)
    return system


def _samples(factors: Factors, points: Sequence[Point], span: float) -> Array:
    """Return the matrix at all points and steps (samples, n, n) at which it is finite."""
    every = np.stack([factors.at(y, step * span, d) for y, d in points for step in STEPS])
    return every[np.isfinite(every).all(axis=(1, 2))]


def _aside(system: System, y: Array, sign: float) -> Array:
    """Return `y` with every unknown but time perturbed, by different relative amounts."""
    share = sign * ASIDE * np.sin(1.0 + np.arange(system.n))
    size = np.abs(y)
    size[: system.nx] = np.maximum(size[: system.nx], system.nominal)
    if system.timed:
        size[-1] = 0.0
    return y + share * size
