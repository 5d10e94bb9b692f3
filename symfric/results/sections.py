"""Crossings of an expression in a run, and the cycle that the run settles to."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import check_names
from symfric.foundation.shown import Showing, Shown, TextTable
from symfric.model import Contact
from symfric.model.kinds import MODE
from symfric.results.signals import Signals, extremes, integral_between

PARTS = 32
"""Number of parts into which an interval with a crossing is divided at a time."""
ZERO = 1e-12
"""Value that counts as zero, relative to the largest one."""
LONGEST = 16
"""Largest number of crossings in a cycle."""
RETURNS = 2
"""Number of returns at the end of a run that have to repeat."""
FLAT = 1e-9
"""Range of a state, relative to its nominal value, below which it counts as constant."""
SETTLED = 1e-3
"""Range in the last quarter of a run, relative to that of the whole run, of a steady motion."""
POINTS = 4096
"""Number of points of a spectrum."""


def crossings(of: Callable[[Array], Array], looks: Array, direction: int) -> Array:
    """Return the times at which a function of time passes through zero.

    Args:
        of: function of times.
        looks: increasing times; one crossing at most is found between two of them.
        direction: 1 for rising, -1 for falling crossings, 0 for both.
    """
    values = of(looks)
    size = float(np.abs(values).max(initial=0.0))
    sign = np.where(np.abs(values) <= ZERO * size, 0.0, np.sign(values))
    known = np.flatnonzero(sign)
    turns = np.flatnonzero(np.diff(sign[known]))
    after = known[turns + 1]
    rising = sign[after] > 0
    after = after[rising if direction > 0 else ~rising if direction < 0 else slice(None)]
    low, high, side = looks[after - 1], looks[after], sign[after]
    while after.size and (high - low > 2 * np.spacing(np.abs(high))).any():
        at = np.linspace(low, high, PARTS + 1)
        beyond = of(at.ravel()).reshape(at.shape) * side > 0
        beyond[-1] = True
        first = np.maximum(beyond.argmax(axis=0), 1)
        column = np.arange(after.size)
        narrower = at[first, column] - at[first - 1, column] < high - low
        if not narrower.any():
            break
        low, high = at[first - 1, column], at[first, column]
    return high


def sticks(c: Contact) -> ca.SX:
    """Return an expression that is negative while a contact sticks.

    A contact with modes sticks in the mode 0. Any other contact counts as sticking while its
    sliding velocity is below the velocity scale of its law.
    """
    for s, v in zip(c.law.states, c.states, strict=True):
        if s.whole and not s.even:
            return ca.fabs(v.symbol) - 0.5
    return ca.fabs(ca.SX(c.slip)) - c.law.velocity_scale


@final
@dataclass(frozen=True, eq=False, repr=False)
class Cycle(Showing):
    """Last period of a run that has settled to a periodic motion.

    Attributes:
        run: the run.
        period: duration of the cycle [s].
        start: first time of the cycle [s]; it ends at `start + period`.
        settled: time [s] after which every return stays within the tolerance.
        crossings: times of the crossings that define the section [s].
        error: largest difference of a state between start and end of the cycle, relative to the
            range of the state.
    """

    run: Signals
    period: float
    start: float
    settled: float
    crossings: Array
    error: float

    @property
    def end(self) -> float:
        """Last time of the cycle [s]."""
        return self.start + self.period

    @cached_property
    def looks(self) -> Array:
        """Times of the cycle that resolve every step [s]."""
        inside = self.run.looks[(self.run.looks > self.start) & (self.run.looks < self.end)]
        return np.concatenate([[self.start], inside, [self.end]])

    def extremes(self, name: str) -> tuple[float, float]:
        """Return the smallest and largest value of a signal or detail over the cycle."""
        of = self._of(name)
        low, high = extremes(self.looks, {"": of(self.looks)}, lambda at: {"": of(at)})[""]
        return float(low), float(high)

    def amplitude(self, name: str) -> float:
        """Return half of the difference between the largest and the smallest value."""
        low, high = self.extremes(name)
        return (high - low) / 2

    def mean(self, name: str) -> float:
        """Return the mean of a signal or detail over the cycle, by quadrature over all steps."""
        self.run.check([name])
        run, expression = self.run, self.run.model.expression(name)
        return integral_between(
            run.step_times, run.of, expression, self.start, self.end
        ) / self.period  # fmt: skip

    def sticking(self, contact: str) -> float:
        """Return the fraction of the cycle in which a contact sticks.

        A contact with modes sticks in the mode 0. Any other contact counts as sticking while its
        sliding velocity is below the velocity scale of its law.
        """
        contacts = {c.name: c for c in self.run.model.contacts}
        check_names(f"cycle of '{self.run.scene}': sticking", [contact], contacts)
        excess = sticks(contacts[contact])

        def of(at: Array) -> Array:
            return self.run.of(excess, at)

        cuts = np.concatenate([[self.start], crossings(of, self.looks, 0), [self.end]])
        middles, lengths = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts)
        return float(lengths[of(middles) <= 0].sum() / self.period)

    def spectrum(self, name: str, harmonics: int = 10) -> NDArray[np.complex128]:
        """Return the Fourier coefficients c_0, ..., c_harmonics of a signal.

            s(t) = c_0 + 2 Re sum_k c_k exp(2 pi i k (t - start) / period)

        They are those of 4096 points in the cycle; the k-th harmonic has the amplitude 2 |c_k|.
        """
        checks.count("spectrum: harmonics", harmonics, least=1, most=POINTS // 4)
        at = self.start + self.period * np.arange(POINTS) / POINTS
        return np.fft.rfft(self._of(name)(at))[: harmonics + 1] / POINTS

    def _of(self, name: str) -> Callable[[Array], Array]:
        self.run.check([name])
        expression = self.run.model.expression(name)
        return lambda at: self.run.of(expression, at)

    def shown(self) -> Shown:
        """Return period, end of the transient, and the contacts."""
        rows = [
            ("period", f"{self.period:.9g}", "s"),
            ("transient until", f"{self.settled:.6g}", "s"),
        ]
        rows.append(("difference of start and end", f"{self.error:.1g}", "of the range"))
        return Shown(f"cycle of '{self.run.scene}'", (), TextTable(("", "", ""), tuple(rows), (1,)))


def cycle(run: Signals, section: ca.SX | None, tolerance: float) -> Cycle:
    """Return the cycle that a run settles to; see `Trajectory.period`."""
    where, model = f"trajectory of '{run.scene}': period", run.model
    states = [v for v in model.x if v.kind != MODE and v.name not in model.cyclic]
    looks = run.looks
    late = looks[looks >= (looks[0] + looks[-1]) / 2]
    turning = [n for n in model.angles if np.ptp(run.of(model.expression(n), late)) > 2 * np.pi]
    columns, sizes = list[ca.SX](), list[float]()
    of_laws, inner = {v.name for c in model.contacts for v in c.states}, list[bool]()
    for v in states:  # an angle that turns returns in its sine and cosine
        turns = v.name in turning
        columns += [ca.sin(v.symbol), ca.cos(v.symbol)] if turns else [v.symbol]
        sizes += [1.0, 1.0] if turns else [v.nominal]
        inner += [v.name in of_laws] * (1 + turns)
    column, nominal = ca.vertcat(*columns), np.array(sizes)
    values = np.atleast_2d(run.of(column, late)) if states else np.zeros((0, 1))
    ranges = np.ptp(values, axis=1)
    moving = ranges > FLAT * nominal
    if not moving.any():
        raise ValueError(f"{where}: expected a run that moves, got one at rest in its second half")
    if section is None:
        # a bristle may vibrate many times within a period of the machine
        outer = np.where(moving & ~np.array(inner), ranges / nominal, 0.0)
        i = int(np.argmax(outer if outer.any() else ranges / nominal))
        section = columns[i] - (values[i].max() + values[i].min()) / 2
    times = crossings(partial(run.of, section), looks, 1)
    if times.size < RETURNS + 1:
        hint = _steady(run, column, nominal) or (
            "simulate longer, or give an expression that the motion crosses"
        )
        raise ValueError(
            f"{where}: expected {RETURNS + 1} rising crossings of the section or more, got "
            f"{times.size}; {hint}"
        )
    at = np.atleast_2d(run.of(column, times))[moving] / ranges[moving, None]
    for n in range(1, min(LONGEST, times.size - RETURNS) + 1):
        off = np.abs(at[:, n:] - at[:, :-n]).max(axis=0)
        if (off[-max(RETURNS, n) :] <= tolerance).all() and off.size >= max(RETURNS, n):
            good = int(np.flatnonzero(off > tolerance).max(initial=-1)) + 1
            start, period = float(times[-1 - n]), float(times[-1] - times[-1 - n])
            return Cycle(run, period, start, float(times[good]), times, float(off[-1]))
    off = np.abs(at[:, 1:] - at[:, :-1]).max(axis=0)[-RETURNS:].max()
    raise ValueError(
        f"{where}: expected a motion that repeats to {tolerance:g} of its range, got one that "
        f"differs by {off:.2g} between crossings; "
        + (_steady(run, column, nominal) or "simulate longer, or raise the tolerance")
    )


def _steady(run: Signals, column: ca.SX, nominal: Array) -> str:
    """Return a hint for a run that has settled to a steady motion; empty for any other run."""
    looks = run.looks
    last = looks[looks >= (looks[0] + 3 * looks[-1]) / 4]
    whole, left = (np.ptp(np.atleast_2d(run.of(column, at)), axis=1) for at in (looks, last))
    share = float((left / np.maximum(whole, FLAT * nominal)).max())
    if not share < SETTLED:
        return ""
    return (
        f"in the last quarter the states vary by only {share:.1g} of their range, so the run "
        "seems to have settled to a steady motion: use equilibrium(), or --from equilibrium"
    )
