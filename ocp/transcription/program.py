"""The nonlinear program that a solver gets."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@final
@dataclass(frozen=True)
class Place:
    """What a row or an unknown of the program is about.

    Attributes:
        name: "the equation of v", "force".
        span: number of the span.
        fraction: where in the span, between 0 and 1; nan for what belongs to all of it.
        scale: SI value divided by the value in the program.
    """

    name: str
    span: int
    fraction: float
    scale: float = 1.0


@final
class Places(Sequence[Place]):
    """Places of all rows or unknowns, made only when somebody asks."""

    def __init__(
        self, count: int, make: Callable[[], tuple[Sequence[str], Indices, Indices, Array, Array]]
    ) -> None:
        """`make` returns names, and of each place number of the name, span, fraction, scale."""
        self._count, self._make = count, make

    @cached_property
    def _columns(self) -> tuple[Sequence[str], Indices, Indices, Array, Array]:
        return self._make()

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Place:  # pyright: ignore[reportIncompatibleMethodOverride]
        names, name, span, fraction, scale = self._columns
        return Place(
            names[int(name[index])], int(span[index]), float(fraction[index]), float(scale[index])
        )

    def __iter__(self) -> Iterator[Place]:
        return (self[i] for i in range(self._count))


@final
@dataclass(frozen=True, eq=False)
class Stages:
    """Stages of the program, as structured solvers take them: x_k with u_k, rows of its gap first.

    Attributes:
        nx, nu: states and further unknowns of each stage, in the order of w; the last nu is 0.
        ng: rows of each stage besides its gap x_(k+1) = F(x_k, u_k), in the order of g.
        equality: which rows of g are equations, shape (m,).
    """

    nx: tuple[int, ...]
    nu: tuple[int, ...]
    ng: tuple[int, ...]
    equality: tuple[bool, ...]


def no_structure() -> tuple[Stages | None, str]:
    """Of a program that nobody has looked at."""
    return None, "no known structure"


@final
@dataclass(frozen=True, eq=False)
class Program:
    """A nonlinear program with exact sparse derivatives; everything scaled.

        min f(w, p)   subject to   lower_w <= w <= upper_w,   lower_g <= g(w, p) <= upper_g

    Attributes:
        w, p: MX unknowns and parameters.
        f, g: MX cost and rows.
        gradient: (x, p) -> (f, grad_f_x).
        jacobian: (x, p) -> (g, jac_g_x).
        hessian: (x, p, lam_f, lam_g) -> triu_hess_gamma_x_x.
        values: numbers of p.
        rows, unknowns: what each row and each unknown is about.
        scale: SI values of the unknowns divided by w.
        structure: looks for stages when somebody asks.
    """

    w: ca.MX
    p: ca.MX
    f: ca.MX
    g: ca.MX
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    lower_w: Array
    upper_w: Array
    lower_g: Array
    upper_g: Array
    values: Array
    rows: Sequence[Place]
    unknowns: Sequence[Place]
    scale: Array
    structure: Callable[[], tuple[Stages | None, str]] = no_structure

    @property
    def stages(self) -> Stages | None:
        """Structure for solvers that use it; None where there is none, see `unstaged`."""
        return self.structure()[0]

    @property
    def unstaged(self) -> str:
        """Why there are no stages."""
        return self.structure()[1]

    @property
    def nlp(self) -> dict[str, ca.MX]:
        """The program as `casadi.nlpsol` takes it."""
        return {"x": self.w, "p": self.p, "f": self.f, "g": self.g}

    @property
    def derivatives(self) -> dict[str, ca.Function]:
        """Options of `casadi.nlpsol` that hand the derivatives over."""
        return {"grad_f": self.gradient, "jac_g": self.jacobian, "hess_lag": self.hessian}
