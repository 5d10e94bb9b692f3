"""Estimates of changing friction from a record, and what the record determines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.codegen import Block
from symfric.compensation.force import TABLES
from symfric.compensation.members import Members
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.programs import find_compiler
from symfric.foundation.shown import brief, combination

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEEN = 3.0
"""Information of the data, relative to that of the spreads, above which they determine a value: the
variance is at most a quarter of that of the spreads."""
FOREVER = 1e6
"""Time constants [s] without forgetting."""


@final
@dataclass(frozen=True, eq=False)
class Followed:
    """Estimates along a record of n samples.

    Attributes:
        t: times of the samples [s], shape (n,).
        estimates, deviations: parameter -> values, shape (n,).
        units: parameter -> unit.
        residual: measured minus predicted force of the last window or sample that was used [N].
        used: True where the data changed the estimates.
        information: information of the whole record without forgetting, relative to the spreads,
            shape (parameters, parameters): (P^-1 - 1) for the covariance P relative to them.
    """

    t: Array
    estimates: Mapping[str, Array]
    deviations: Mapping[str, Array]
    units: Mapping[str, str]
    residual: Array
    used: NDArray[np.bool_]
    information: Array

    __repr__ = brief

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        values, vectors = np.linalg.eigh(self.information)
        return np.maximum(values, 0.0), vectors.T

    @property
    def rank(self) -> int:
        """Number of combinations of parameters that the record determines."""
        return int((self._modes[0] > SEEN).sum())

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest information; inf if a combination has none."""
        least, most = self._modes[0][[0, -1]]
        return float(most / least) if least > 0.0 else np.inf

    @property
    def unobservable(self) -> tuple[str, ...]:
        """Combinations, in units of the spreads, that the record does not determine."""
        names = [*self.estimates]
        pairs = zip(*self._modes, strict=True)
        return tuple(combination(vector, names) for value, vector in pairs if value <= SEEN)

    @property
    def verdict(self) -> str:
        """One sentence: what the record determines, and what to move to see the rest."""
        count, rank = len(self.estimates), self.rank
        if rank == count:
            return f"The data determine all {count} parameters (condition {self.condition:.0e})."
        vectors = [v for value, v in zip(*self._modes, strict=True) if value <= SEEN]
        names = [n for i, n in enumerate(self.estimates) if max(abs(v[i]) for v in vectors) > 0.3]
        advice = "; ".join(
            dict.fromkeys(TABLES["advice"].get(n, "move differently") for n in names)
        )
        return (
            f"The data determine {rank} of {count} parameters, not {', '.join(self.unobservable)}; "
            f"{advice}."
        )

    def plot(self, *names: str, path: str | Path | None = None) -> Figure:
        """Plot estimates with bands of two deviations, and the residuals.

        Args:
            names: parameters to show, by default all.
            path: image file.
        """
        from symfric.foundation.panels import panels, save  # noqa: PLC0415  (slow to import)

        checks.check_names("plot of estimates", names, self.estimates)
        shown = names or tuple(self.estimates)
        figure, axes = panels(len(shown) + 1)
        for axis, name in zip(axes, shown, strict=False):
            value, band = self.estimates[name], 2 * self.deviations[name]
            axis.fill_between(self.t, value - band, value + band, alpha=0.2, label="two deviations")
            axis.plot(self.t, value, linewidth=1.2, label="estimate")
            axis.set_ylabel(f"{name} [{self.units[name]}]")
        axes[0].legend(frameon=False, fontsize="small", ncols=2)
        axes[-1].plot(self.t[self.used], self.residual[self.used], ".", markersize=1.5)
        axes[-1].set_ylabel("residual [N]")
        axes[-1].set_xlabel("t [s]")
        return save(figure, path)


def follow(
    estimator: Block,
    force: ArrayLike,
    v: ArrayLike,
    *,
    h: float | None = None,
    learn: ArrayLike = 1.0,
) -> Followed:
    """Run an estimator over a record, as it would run on the target.

    Args:
        estimator: block of `recursive_estimator` or `kalman_estimator`.
        force: total force [N] over the interval before each sample, shape (n,).
        v: velocity at the samples [m/s], shape (n,).
        h: sample time of the record [s], by default that of the block.
        learn: below 0.5 where other forces act, shape (n,) or a number.

    Raises:
        ValueError: bad input; another block; a sample time other than a constant h of the block.
    """
    where = f"follow '{checks.kind('follow', estimator, Block, 'a block').name}'"
    names = [n.removesuffix("_sd") for n in estimator.outputs if n.endswith("_sd")]
    if not names or {x.name for x in estimator.inputs} != {"v", "force", "learn"}:
        raise checks.refused(where, "the block of an estimator", estimator.name)
    signals = {n: checks.array(f"{where}: {n}", x) for n, x in (("force", force), ("v", v))}
    size = signals["v"].size
    if signals["force"].size != size or size < 2:
        sizes = f"{signals['force'].size} and {size}"
        raise ValueError(f"{where}: expected force and v of one length >= 2, got {sizes}")
    given = checks.array(f"{where}: learn", learn, ndim=None)
    if given.shape not in ((), (size,)):
        raise checks.refused(f"{where}: learn", f"a number or {size} numbers", learn)
    signals["learn"] = np.broadcast_to(given, size)
    own = estimator.sample_time
    step = checks.number(f"{where}: h", own if h is None else h, unit="s", above=0.0)
    if "h" in estimator.constants and step != own:
        raise checks.refused(f"{where}: h", f"that of the block, {own:g} s", step)
    cases = [{"h": step}, {"h": step, "t_memory": FOREVER, "t_change": FOREVER}]
    members = Members(estimator, cases, compiler=find_compiler())
    found = np.empty((size, len(estimator.outputs)))
    for k in range(size):
        for name, column in signals.items():
            members.inputs[name][:] = column[k]
        members.step()
        found[k] = members.output[0]
    outputs = dict(zip(estimator.outputs, found.T, strict=True))
    states = dict(zip([x.name for x in estimator.states], members.state[1], strict=True))
    return Followed(
        t=step * np.arange(float(size)),
        estimates={n: outputs[n] for n in names},
        deviations={n: outputs[f"{n}_sd"] for n in names},
        units={n: estimator.outputs[n].unit for n in names},
        residual=outputs["residual"],
        used=outputs["used"] > 0.5,
        information=_information(states, len(names)),
    )


def _information(states: Mapping[str, float], n: int) -> Array:
    """Return P^-1 - 1 of the last n variables of the stored factor of P."""
    elements = [value for name, value in states.items() if name.startswith("W_")]
    size = round(np.sqrt(2 * len(elements) + 0.25) - 0.5)
    W = np.zeros((size, size))
    W[np.triu_indices(size)] = elements
    inverse = np.linalg.inv(W[-n:, -n:])
    return np.asarray(inverse.T @ inverse) - np.eye(n)
