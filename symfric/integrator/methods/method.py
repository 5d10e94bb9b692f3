"""What a method of integration is, whatever its family: what it makes of one step."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from symfric.foundation.checks import listed
from symfric.integrator.equations.pivots import Factors
from symfric.integrator.equations.system import System

Array = NDArray[np.float64]


@final
@dataclass(frozen=True, eq=False)
class Trial:
    """One step from y over h, as SX or MX columns (n, 1).

    Attributes:
        end: the solution after the step.
        error: estimate of its error; None from a method of fixed steps.
        dense: coefficients d_1, d_2, ... of the dense output (see `Dense`).
        corrections: the last two Newton corrections of `end`; empty where nothing is iterated.
        shift: what `end` was moved by to lie on the constraints of a mechanism; None without any.
    """

    end: Any
    error: Any = None
    dense: tuple[Any, ...] = ()
    corrections: tuple[Any, ...] = ()
    shift: Any = None


Trials = Callable[[Any, Any, Any], Trial]
"""(y, h, d) -> what a method makes of it, for one system; with SX its blocks are inlined, with MX
they stay calls."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Method(ABC):
    """A method of integration: coefficients, what is known of them, and its steps.

    Attributes:
        name: as papers write it.
        order: of the solution, for ODEs and (`dae`) index-1 DAEs.
        embedded: order of the solution behind the error estimate; 0 for methods of fixed steps.
        dense: order of the dense output for ODEs; 0 where there is none.
        dense_dae: order of the dense output for index-1 DAEs.
        H: dense output from the stages, shape (r, s).
        finer: how many times shorter than usual the ways are that a sliding velocity may go near
            rest in one step (`step.watch`).
        source: where the coefficients are from.
    """

    name: str
    order: int
    embedded: int = 0
    dense: int = 0
    dense_dae: int = 0
    H: Array = field(default_factory=lambda: np.zeros((0, 0)))
    finer: float = 1.0
    source: str

    @property
    @abstractmethod
    def diagonal(self) -> float | None:
        """The coefficient gamma of its iteration matrix W = M / (gamma h) - J.

        None of a method without one, and of methods of fixed steps.
        """

    dae: ClassVar[bool] = True
    """Whether algebraic unknowns and mass matrices are allowed."""

    @property
    def adaptive(self) -> bool:
        """Whether it estimates its error, as `simulate` needs it."""
        return self.embedded > 0

    @abstractmethod
    def work(self, system: System) -> tuple[int, int, int]:
        """Right-hand sides, Jacobians and factorisations of a step."""

    def factors(self, system: System) -> tuple[Factors, ...]:
        """Of all matrices that its steps on a system solve with; none of an explicit method."""
        return ()

    @abstractmethod
    def trials(self, system: System) -> Trials:
        """Its steps on a system.

        Raises:
            ValueError: the system has algebraic unknowns or a mass matrix, and not `dae`.
        """


def combination(weights: Iterable[float], columns: Iterable[Any], kind: Any) -> Any:
    """Weighted sum of columns of the given kind, without the terms of weight zero."""
    terms = (float(w) * c for w, c in zip(weights, columns, strict=True) if w != 0.0)
    return sum(terms, start=kind(0))


def need_ode(system: System, method: str) -> None:
    """Refuse what a method without iteration matrix cannot integrate.

    Raises:
        ValueError: algebraic unknowns, or a mass matrix other than the identity.
    """
    if system.is_ode:
        return
    unknown = listed(system.names[i] for i in system.algebraic[1])
    found = f"the algebraic unknowns {unknown}" if unknown else "a mass matrix"
    raise ValueError(
        f"method {method}: expected an ODE x' = f(x), got {found}; use an implicit method such as "
        "rodas5p, also for mechanisms with friction from reactions"
    )
