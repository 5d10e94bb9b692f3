"""Windows of records, and start values of a motion from measured signals.

The start of a measured state, or of the rate of one, is that of a cubic through nearby samples. No
signal shows whether a contact slides steadily at the start. A single bristle of a law is therefore
an unknown; several bristles have the start of the model if the contact is fast, and are unstrained
if it sticks. All other states have the start of the model.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise
from math import comb
from typing import NamedTuple

import casadi as ca
import numpy as np

from identification.residuals.evaluation import Array
from symfric.model import Model

FEWEST = 8
"""Smallest number of samples of a window that determines its start values."""
MARGIN = 0.25
"""Largest shift of a cut, relative to the length of a window."""


def cut(t: Array, length: float | None, speed: Array | None = None) -> tuple[slice, ...]:
    """Return the samples of consecutive windows of about `length` [s]; None: one window.

    Windows have equal length, an integer fraction of the record. With `speed` (n,), each cut moves
    to the fastest sample within a quarter of a window, where bristles slide steadily and their
    start follows from the velocity.

    Raises:
        ValueError: a window has fewer than eight samples.
    """
    n, span = t.size, float(t[-1] - t[0])
    if length is None or length >= span:
        return (slice(0, n),)
    count = max(1, round(span / length))
    ends = t[0] + span * np.arange(1, count) / count
    cuts = np.searchsorted(t, ends).tolist()
    if speed is not None:
        reach = MARGIN * span / count
        near = [np.searchsorted(t, [end - reach, end + reach]) for end in ends]
        cuts = [int(a + np.argmax(np.abs(speed[a : max(b, a + 1)]))) for a, b in near]
    edges = [0, *cuts, n]
    shortest = min(np.diff(edges))
    if shortest < FEWEST:
        such = f"windows of at least {FEWEST} samples"
        got = f"one of {shortest} with windows={length:g} s"
        raise ValueError(f"Shooting: windows: expected {such}, got {got}")
    return tuple(slice(a, b) for a, b in pairwise(edges))


def turnaround(t: Array, y: Array) -> float:
    """Return the time scale [s] of a signal; for a sine, its period.

    The time scale is six times the delay at which the rms difference of the signal reaches its
    standard deviation.
    """
    size, lag = float(np.std(y)), 1
    while lag < y.size // 2 and np.sqrt(np.mean((y[lag:] - y[:-lag]) ** 2)) < size:
        lag = max(lag + 1, int(1.2 * lag))
    return 6 * lag * float(t[-1] - t[0]) / (t.size - 1)


ORDERS = 6
"""Highest order of the differences that estimate the noise of a signal."""
LEAST, MOST = 4, 512
"""Smallest and largest number of samples on either side of a start for its cubic."""
MISFIT = 3.0
"""Standard deviations by which the misfit of a cubic may exceed that of the noise."""
REST = 0.02
"""Sliding velocity, relative to its usual value in the record, below which a contact sticks."""


def noise_of(y: Array) -> float:
    """Return an upper bound of the standard deviation of white noise from high-order differences.

    The k-th difference of white noise of variance s^2 has the variance binomial(2k, k) s^2.
    """
    found, d = [float(np.std(y))], y
    for k in range(1, min(ORDERS, y.size - 2) + 1):
        d = np.diff(d)
        found.append(float(np.sqrt(np.mean(d * d) / comb(2 * k, k))))
    return min(found)


class LocalEstimate(NamedTuple):
    """Value and rate of a signal at one time, with standard errors due to white noise."""

    value: float
    rate: float
    value_error: float
    rate_error: float


def local(t: Array, y: Array, k: int, noise: float) -> LocalEstimate:
    """Fit a cubic around sample k to as many samples as agree with it up to noise."""
    found, reach = np.zeros(4), LEAST
    while True:
        rows = slice(max(0, k - reach), min(t.size, k + reach + 1))
        s = t[rows] - t[k]
        scale = max(float(np.abs(s).max()), 1e-300)
        A = np.vander(s / scale, min(4, s.size), increasing=True)
        q, r = np.linalg.qr(A)
        c = np.linalg.solve(r, q.T @ y[rows])
        free, left = s.size - c.size, y[rows] - A @ c
        misfit = float(left @ left) / max(free, 1)
        if reach > LEAST and free > 0 and misfit > noise**2 * (1 + MISFIT * np.sqrt(2 / free)):
            break
        errors = np.linalg.norm(np.linalg.inv(r), axis=1)
        found = np.array([c[0], c[1] / scale, noise * errors[0], noise * (errors[1] / scale)])
        if reach >= min(MOST, y.size):
            break
        reach *= 2
    return LocalEstimate(*found.tolist())


def rates(model: Model) -> dict[str, str]:
    """Return rate -> position by name, for all equations of exactly the form x' = v."""
    if model.ode is None:
        return {}
    states = {v.symbol.element_hash(): v.name for v in model.x}
    found = dict[str, str]()
    for v, row in zip(model.x, ca.vertsplit(model.ode), strict=True):
        if row.nnz() and row.is_symbolic() and row.element_hash() in states:
            found[states[row.element_hash()]] = v.name
    return found


def hidden(model: Model) -> set[str]:
    """Return the states whose values within a motion are determined only by the data.

    States of contact laws and states reset by events are excluded.
    """
    own = {v.name for contact in model.contacts for v in contact.states}
    reset = {name for event in model.events for name in event.reset}
    return {v.name for v in model.x} - own - reset


class Begin(NamedTuple):
    """Start value of a state.

    Attributes:
        value: number from which the estimate starts; None: as in the model.
        scale: typical magnitude; 0: the nominal value.
        estimated: True if the start value is an unknown.
    """

    value: float | None
    scale: float = 0.0
    estimated: bool = True


class Sensed(NamedTuple):
    """Information on the states of a model from the measurements of one record.

    Attributes:
        t: times [s], shape (n,).
        measured: measured state -> samples, shape (n,).
        noise: measured state -> standard deviation of its noise.
        observed_from: observed state -> (measured state, True if it is the rate of that state).
        slips: contact with bristles -> its sliding velocity as a Function of the observed states,
            and the names of the bristles.
    """

    t: Array
    measured: Mapping[str, Array]
    noise: Mapping[str, float]
    observed_from: Mapping[str, tuple[str, bool]]
    slips: Mapping[str, tuple[ca.Function, tuple[str, ...]]]

    @classmethod
    def of(cls, model: Model, t: Array, measured: Mapping[str, Array]) -> "Sensed":
        """Return the information on the states of `model` and its contacts."""
        observed_from = {r: (s, True) for r, s in rates(model).items() if s in measured}
        observed_from |= {name: (name, False) for name in measured}
        slips = dict(_slips(model, list(observed_from)))
        noise = {name: noise_of(y) for name, y in measured.items()}
        return cls(t, measured, noise, observed_from, slips)

    def at(self, k: int) -> dict[str, Begin]:
        """Return start values at sample k, including those of bristles that need one."""
        found = dict[str, Begin]()
        rows = list[tuple[float, float, float]]()
        for name, (source, is_rate) in self.observed_from.items():
            y = self.measured[source]
            one = local(self.t, y, k, self.noise[source])
            both = (one.rate, one.rate_error) if is_rate else (one.value, one.value_error)
            rows.append((*both, self._pace(y) if is_rate else float(np.std(y))))
            found[name] = Begin(rows[-1][0], rows[-1][2])
        values, errors, scales = np.array(rows).reshape(-1, 3).T
        for slip, names in self.slips.values():
            value, slope = (np.ravel(np.array(a)) for a in slip(values))
            usual = float(np.linalg.norm(slope * scales))
            error = float(np.linalg.norm(slope * errors))
            sticks = abs(value[0]) <= max(REST * usual, MISFIT * error)
            if len(names) == 1:  # before a record, the direction of motion is unknown
                found[names[0]] = Begin(0.0 if sticks or k == 0 else None)
            elif sticks:
                found |= dict.fromkeys(names, Begin(0.0, estimated=False))
        return found

    @property
    def speed(self) -> Array:
        """Sum of the rates of the measured states, each relative to its usual rate, shape (n,)."""
        t, reach = self.t, max(1, self.t.size // 100)
        rows = np.arange(t.size)
        a, b = np.maximum(rows - reach, 0), np.minimum(rows + reach, t.size - 1)
        found = np.zeros(t.size)
        for y in self.measured.values():
            pace = self._pace(y)
            if pace > 0:
                found += np.abs((y[b] - y[a]) / (t[b] - t[a])) / pace
        return found

    def _pace(self, y: Array) -> float:
        """Return the usual rate of a signal, the root mean square over fiftieths of the record."""
        every = max(1, y.size // 50)
        return float(np.sqrt(np.mean((np.diff(y[::every]) / np.diff(self.t[::every])) ** 2)))


def _slips(
    model: Model, observed_from: list[str]
) -> Iterator[tuple[str, tuple[ca.Function, tuple[str, ...]]]]:
    """Yield sliding velocities in the observed states for contacts whose laws have bristles.

    Bristles are the states that change sign with the velocity. Other states, such as the age of a
    contact, have the start of the model.
    """
    symbols = {v.name: v.symbol for v in model.x}
    x = ca.vertcat(*(symbols.pop(name) for name in observed_from))
    rest = ca.vertcat(*symbols.values(), model.vector("z"), model.vector("u"))
    for contact in model.contacts:
        pairs = zip(contact.law.states, contact.states, strict=True)
        names = tuple(v.name for state, v in pairs if not state.even)
        if not names or ca.depends_on(contact.slip, rest):
            continue
        slip = ca.substitute(contact.slip, model.vector("p"), ca.DM(model.values("p")))
        slope = ca.densify(ca.jacobian(slip, x))
        yield contact.name, (ca.Function("slip", [x], [slip, slope]), names)
