"""Branches of equilibria and periodic orbits over a parameter, and their special points."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import NDArray

from symfric.dynamics.linear import NEUTRAL, SLOWEST
from symfric.dynamics.orbit import NEUTRAL as UNDECIDED
from symfric.dynamics.orbit import PeriodicOrbit, guessed, periodic_orbit
from symfric.foundation import checks
from symfric.foundation.files import write_text
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable, among, data_uri
from symfric.integrator import Ensemble, Input
from symfric.model import Model
from symfric.results.stored import Format

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPECIAL = (
    "fold", "Hopf", "branch point", "period doubling", "Neimark-Sacker", "grazing",
    "change of stick and slip",
)  # fmt: skip
"""Kinds of special points."""


@final
@dataclass(frozen=True, eq=False)
class Special:
    """Point at which a branch changes.

    Attributes:
        kind: "fold", "Hopf", "branch point", "period doubling", "Neimark-Sacker", "grazing" or
            "change of stick and slip".
        value: value of the parameter.
        index: the point lies between the points index - 1 and index of the branch.
        x: states; of an orbit those at its start.
        period: period of an orbit [s], or of the oscillation at a Hopf point; 0 without one.
        direction: states of the critical deviation at a Hopf point; empty otherwise.
    """

    kind: str
    value: float
    index: int
    x: Array
    period: float
    direction: Array


@final
@dataclass(frozen=True, eq=False, repr=False)
class Branch(Showing):
    """Equilibria or periodic orbits of a model over one parameter, in the order of the curve.

    Attributes:
        model: the model.
        parameter: name of the parameter.
        u, p: values of the inputs, and of all free parameters at the start.
        values: values of the parameter, shape (n,).
        x: states, of orbits those at their start, shape (n, nx).
        periods: periods [s], shape (n,); 0 for equilibria.
        parts: real and imaginary parts of the `exponents`, shape (n, k, 2).
        low, high: smallest and largest values of the states, shape (n, nx).
        sequences: events of one period in their order, as text.
        special: special points.
        message: reason why the branch ends.
        driven: True for orbits with a given period.
    """

    model: Model
    parameter: str
    u: dict[str, Input]
    p: dict[str, float]
    values: Array
    x: Array
    periods: Array
    parts: Array
    low: Array
    high: Array
    sequences: tuple[str, ...]
    special: tuple[Special, ...]
    message: str
    driven: bool = False

    @property
    def exponents(self) -> NDArray[np.complex128]:
        """Eigenvalues [1/s] of equilibria, or Floquet multipliers of orbits, shape (n, k).

        The zero eigenvalues of cyclic states, on which no equation depends, are left out.
        """
        return self.parts[:, :, 0] + 1j * self.parts[:, :, 1]

    @property
    def of_orbits(self) -> bool:
        """True for periodic orbits, False for equilibria."""
        return bool(self.periods.size and self.periods[0] > 0)

    @property
    def content(self) -> str:
        """Name of what the points are: "periodic orbits" or "equilibria"."""
        return "periodic orbits" if self.of_orbits else "equilibria"

    @property
    def stability(self) -> NDArray[np.int8]:
        """1 where all deviations decay, -1 where one grows, 0 where neither is certain, shape (n,).

        The limits are those of `LinearModel.stable` and `PeriodicOrbit.stable`.
        """
        size = np.abs(self.exponents)
        if self.of_orbits:
            growth, neutral = size - 1, UNDECIDED
        else:
            largest = np.fmax.reduce(size, axis=1, initial=SLOWEST, keepdims=True)
            growth, neutral = self.exponents.real / largest, NEUTRAL
        greatest = np.fmax.reduce(growth, axis=1, initial=-1.0)
        return np.where(np.abs(greatest) <= neutral, 0, -np.sign(greatest)).astype(np.int8)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """True for each point at which all deviations decay, shape (n,)."""
        return self.stability > 0

    def located(self, kind: str) -> tuple[Special, ...]:
        """Return the special points of a kind, such as "Hopf"; see `Special.kind`."""
        checks.choice(f"branch of '{self.model.name}': located", kind, SPECIAL)
        return tuple(s for s in self.special if s.kind == kind)

    def orbit(self, index: int, rtol: float = 1e-9) -> PeriodicOrbit:
        """Return the periodic orbit of a point, computed again at the tolerance.

        Raises:
            ValueError: a branch of equilibria, or an index outside the branch.
        """
        where = f"branch of '{self.model.name}': orbit"
        if not self.of_orbits:
            raise ValueError(f"{where}: expected a branch of orbits, got one of equilibria")
        k = checks.count(where, index, least=-self.values.size, most=self.values.size - 1)
        p = self.p | {self.parameter: float(self.values[k])}
        x0 = dict(zip((v.name for v in self.model.x), self.x[k].tolist(), strict=True))
        guess = guessed(self.model, x0, float(self.periods[k]), self.u, p, rtol)
        period = guess.period if self.driven else None
        return periodic_orbit(self.model, guess, period=period, rtol=rtol)

    def plot(
        self, state: str, *others: "Branch", runs: Sequence[Ensemble] = (),
        path: str | Path | None = None,
    ) -> "Figure":  # fmt: skip
        """Plot a state over the parameter: stable parts solid, unstable ones dashed, others dotted.

        Orbits are shown by their smallest and largest value.

        Args:
            state: name of the state.
            others: further branches in the same figure.
            runs: results of `simulate_many` that vary the parameter, with times `t_eval` after the
                transient; the extremes over these times are shown as points. Several ensembles with
                other start values show hysteresis.
            path: image file.

        Raises:
            ValueError: an unknown state, or an ensemble that does not vary the parameter.
        """
        from symfric.dynamics.pictures import Plotted, bifurcation  # noqa: PLC0415  (slow to import)

        names = [v.name for v in self.model.x]
        check_names(f"branch of '{self.model.name}': plot", [state], names)
        i = names.index(state)
        curves = list[Plotted]()
        for b in (self, *others):
            order = np.argsort(b.values, kind="stable") if not b.of_orbits else slice(None)
            at = [min(s.index, b.high.shape[0] - 1) for s in b.special]
            special = [
                (s.kind, s.value, float(b.high[k, i])) for s, k in zip(b.special, at, strict=True)
            ]
            rows = b.values[order], b.low[order, i], b.high[order, i], b.stability[order]
            curves.append(Plotted(b.content, *rows, special))
        (free,) = (v for v in self.model.p if v.name == self.parameter)
        labels = f"{self.parameter} [{free.unit}]", f"{state} [{self.model.x[i].unit}]"
        points = [self._points(state, study) for study in runs]
        return bifurcation(curves, points, labels, path)

    def _points(self, state: str, study: Ensemble) -> tuple[Array, Array, Array]:
        """Return parameter, smallest and largest values of the members of an ensemble."""
        where = f"branch of '{self.model.name}': plot: runs"
        if self.parameter not in study.varied or study.t.ndim != 1 or state not in study.signals:
            raise checks.refused(
                where, f"ensembles that vary {self.parameter}, with {state} at times t_eval", study
            )
        values = study.signals[state]
        low, high = np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)
        return study.varied[self.parameter], low, high

    def shown(self) -> Shown:
        """Return the range of the parameter and the special points."""
        low, high = self.values.min(initial=np.inf), self.values.max(initial=-np.inf)
        words = {1: "stable", -1: "unstable", 0: "on the limit of stability"}
        counts = {word: int((self.stability == key).sum()) for key, word in words.items()}
        lines = [
            f"{self.values.size} {self.content}, {self.parameter} from {low:.6g} to {high:.6g}",
            among(f"{count} {word}" for word, count in counts.items() if count),
            self.message,
        ]
        rows = [
            (s.kind, f"{s.value:.10g}", f"{s.period:.8g}" * bool(s.period)) for s in self.special
        ]
        header = ("special point", self.parameter, "period [s]")
        table = TextTable(header, tuple(rows), numbers=(1, 2)) if rows else TextTable((), ())
        return Shown(f"branch of '{self.model.name}'", tuple(lines), table)

    def to_dict(self) -> dict[str, Any]:
        """Return values, periods, stability and special points as built-in types."""
        return {
            "parameter": self.parameter,
            "kind": "orbits" if self.of_orbits else "equilibria",
            "values": self.values.tolist(),
            "periods": self.periods.tolist(),
            "stable": [{1: True, -1: False}.get(k) for k in self.stability.tolist()],
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "states": [v.name for v in self.model.x],
            "special": [
                {"kind": s.kind, "value": s.value, "period": s.period} for s in self.special
            ],
            "message": self.message,
        }

    def to_html(
        self, path: str | Path, *others: "Branch", state: str | None = None, command: str = ""
    ) -> None:
        """Write a self-contained HTML page with the diagram and the special points.

        Args:
            path: HTML file.
            others: further branches on the page.
            state: name of the state on the ordinate; default: the first one.
            command: command line that repeats the analysis.

        Raises:
            ValueError: an unknown state.
        """
        from symfric.page import html  # noqa: PLC0415  (slow to import)

        drawn = self.plot(self.model.x[0].name if state is None else state, *others)
        image = f'<img src="{data_uri(drawn, dpi=150)}" alt="bifurcation diagram">'
        title = f"'{self.model.name}' over {self.parameter}"
        parts = [html.title(title), html.figure(image)]
        for k, branch in enumerate((self, *others)):
            shown = branch.shown()
            table = html.table("", shown.table.header, shown.table.rows, (1, 2))
            parts += [html.section(f"branch{k}", shown.title, html.bullets(shown.lines), table)]
        write_text(path, html.page(title, "en", "\n".join([*parts, html.code(command)])))

    def save(self, path: str | PathLike[str]) -> None:
        """Write the branch to one file, from which `load_branch` restores it exactly."""
        BRANCH.save(path, self)


BRANCH = Format("symfric branch", 1, "load_branch", "a saved branch", Branch)


def load_branch(path: str | PathLike[str], own: Iterable[type | Callable[..., Any]] = ()) -> Branch:
    """Return the branch that `Branch.save` wrote; no code of the file is executed.

    Args:
        path: the file.
        own: the user's own classes in the file, such as laws.

    Raises:
        ValueError: a file that does not exist, is damaged, or has another origin or format.
    """
    return BRANCH.load(path, own)
