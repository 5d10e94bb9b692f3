"""Linear models of a machine near an equilibrium, with names and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.dynamics.equilibrium import Equilibrium
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable, among
from symfric.model import Model, check_model
from symfric.results.stored import module

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEUTRAL, SLOWEST = 1e-9, 1e-3
"""Real part that counts as zero, relative to the largest eigenvalue or to this rate [1/s]."""


class Eigenvalue(NamedTuple):
    """Eigenvalue s of a linear model.

    Attributes:
        value: s [1/s]; of a conjugate pair the one with positive imaginary part.
        frequency: |s| [rad/s].
        damping: -Re(s) / |s|; NaN for s = 0.
    """

    value: complex
    frequency: float
    damping: float


@final
@dataclass(frozen=True, eq=False, repr=False)
class LinearModel(Showing):
    """Linear model of small deviations from an equilibrium.

        e' = A e + B w,   y = C e + D w

    Attributes:
        A, B, C, D: shapes (n, n), (n, inputs), (outputs, n), (outputs, inputs).
        states, inputs, outputs: names.
        units: unit of each state, input and output by name.
        at: the equilibrium.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    at: Equilibrium

    @cached_property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], those with the largest real part first."""
        found: NDArray[np.complex128] = np.linalg.eigvals(self.A).astype(complex)
        return found[np.lexsort((-found.imag, -found.real))]

    @property
    def modes(self) -> tuple[Eigenvalue, ...]:
        """Eigenvalues with frequency and damping, one for each conjugate pair."""
        upper = [complex(s) for s in self.eigenvalues if s.imag >= 0]
        sizes = [abs(s) for s in upper]
        return tuple(
            Eigenvalue(s, size, 0.0 - s.real / size if size else float("nan"))
            for s, size in zip(upper, sizes, strict=True)
        )

    @property
    def stable(self) -> bool | None:
        """True if all deviations decay, False if some grow; None if some do neither.

        Positions that sticking contacts hold, and cyclic states, do neither: they are left out. If
        there are more eigenvalues of zero real part than these, first derivatives do not decide.
        """
        size = max(SLOWEST, float(np.abs(self.eigenvalues).max(initial=0.0)))
        real = self.eigenvalues.real
        if (real > NEUTRAL * size).any():
            return False
        zero = int((real >= -NEUTRAL * size).sum())
        return True if zero <= self.at.free + len(self.at.drift) else None

    def to_scipy(self) -> Any:
        """Return the model as `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace  # noqa: PLC0415  (slow to import)

        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """Return the model as `control.StateSpace` with the names of its signals.

        Raises:
            ImportError: the package `control` is not installed.
        """
        control = module("to_control", "control")
        return control.ss(
            self.A, self.B, self.C, self.D,
            states=[*self.states], inputs=[*self.inputs], outputs=[*self.outputs],
        )  # fmt: skip

    def response(self, frequencies: ArrayLike) -> NDArray[np.complex128]:
        """Return the frequency response G(i w) = C (i w - A)^-1 B + D.

        Args:
            frequencies: w [rad/s], shape (m,).

        Returns:
            G with the shape (m, outputs, inputs), in units of the output per unit of the input.

        Raises:
            ValueError: a frequency at which an undamped deviation resonates.
        """
        w = checks.array("response: frequencies", frequencies, what="frequencies [rad/s]")
        matrix = 1j * w[:, None, None] * np.eye(len(self.states)) - self.A
        if (bad := ~(np.linalg.cond(matrix) < 1e14)).any():
            raise ValueError(
                "response: frequencies: expected frequencies without resonance of undamped "
                f"deviations, got {w[int(bad.argmax())]:g} rad/s"
            )
        return self.C @ np.linalg.solve(matrix, np.tile(self.B, (w.size, 1, 1))) + self.D

    def plot(self, frequencies: ArrayLike | None = None, path: str | Path | None = None) -> Figure:
        """Plot magnitude and phase of the frequency response of all outputs to all inputs.

        Args:
            frequencies: w [rad/s]; by default two decades around the eigenvalues.
            path: image file.

        Raises:
            ValueError: a frequency that is not positive, or no input.
        """
        from symfric.dynamics.pictures import bode  # noqa: PLC0415  (slow to import)

        if not self.inputs:
            raise ValueError("plot: expected a model with inputs, got none; see linearize(inputs=)")
        sizes = np.abs(self.eigenvalues)
        sizes = sizes[sizes > 0] if (sizes > 0).any() else np.ones(1)
        w = np.geomspace(sizes.min() / 10, sizes.max() * 10, 600)
        if frequencies is not None:
            w = positive("plot: frequencies", frequencies, "frequencies > 0 [rad/s]")
        names = [
            [f"{out} / {one} [{self.units[out]} / ({self.units[one]})]" for one in self.inputs]
            for out in self.outputs
        ]
        return bode(w, self.response(w), names, path)

    def shown(self) -> Shown:
        """Return names and eigenvalues."""
        lines = [
            f"{what}: {among(f'{n} [{self.units[n]}]' for n in names)}"
            for what, names in
            (("states", self.states), ("inputs", self.inputs), ("outputs", self.outputs))
            if names
        ]  # fmt: skip
        words = {True: "stable", False: "unstable", None: "on the limit of stability"}
        rows = [
            (f"{m.value:.6g}" if m.value.imag else f"{m.value.real:.6g}",
             f"{m.frequency:.6g}", f"{m.damping:.4g}")
            for m in self.modes
        ]  # fmt: skip
        header = ("eigenvalue [1/s]", "frequency [rad/s]", "damping")
        title = f"linear model of '{self.at.model.name}', {words[self.stable]}"
        return Shown(title, tuple(lines), TextTable(header, tuple(rows), numbers=(0, 1, 2)))


def positive(where: str, value: object, what: str) -> Array:
    """Return a non-empty array of positive numbers."""
    found = checks.array(where, value, what=what)
    if not found.size or not (found > 0).all():
        raise checks.refused(where, what, found.min() if found.size else "none")
    return found


def linearize(
    model: Model,
    at: Equilibrium,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> LinearModel:
    """Return the linear model of small deviations from an equilibrium.

        e' = A e + B w,   y = C e + D w

    Algebraic variables and constraints are eliminated: e are as many states as are independent, in
    the tangent space of a mechanism and of its sticking contacts, which keep sticking. The states
    of bristle laws are states. The derivatives are exact.

    Args:
        model: the model.
        at: equilibrium of the model, by `equilibrium`.
        inputs: names of inputs and free parameters; default all inputs.
        outputs: names of signals or details; default the states e.

    Raises:
        ValueError: bad input, or an equilibrium of another model.
    """
    where = "linearize"
    check_model(where, model)
    if not isinstance(at, Equilibrium) or at.model is not model:  # pyright: ignore[reportUnnecessaryIsInstance]
        raise checks.refused(
            f"{where}: at",
            f"an equilibrium of '{model.name}'",
            at,
            "pass equilibrium(model) of the same model object",
        )
    data, eq, found = [*at.u, *at.p], at.equations, at.tangent
    inputs = [*at.u] if inputs is None else checks.names(f"{where}: inputs", inputs)
    check_names(f"{where}: inputs", inputs, data)
    states = tuple(model.x[i].name for i in found.states)
    outputs = states if outputs is None else checks.names(f"{where}: outputs", outputs)
    columns = [data.index(name) for name in inputs]
    values = ca.vertcat(ca.SX(0, 1), *(model.expression(name) for name in outputs))
    slopes = [ca.densify(ca.jacobian(values, s)) for s in (eq.y, eq.d)]
    of_y, of_d = (a.full() for a in ca.Function("slopes", [eq.y, eq.d], slopes)(at.y, at.data))
    units = {v.name: v.unit for v in (*model.x, *model.u, *model.p)} | {
        name: model.signals[name] if name in model.signals else model.further[name].unit
        for name in outputs
    }
    return LinearModel(
        found.A, found.B[:, columns], of_y @ found.T, (of_d + of_y @ found.Y)[:, columns],
        states, tuple(inputs), tuple(outputs), units, at,
    )  # fmt: skip
