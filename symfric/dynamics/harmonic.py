"""Harmonic balance: predicted oscillations of a linear loop with one contact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import log
from typing import final

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import root

from symfric.dynamics.describing import Harmonic
from symfric.dynamics.equilibrium import equilibrium
from symfric.dynamics.linear import LinearModel, linearize
from symfric.dynamics.orbit import PeriodicOrbit, guessed, periodic_orbit
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.shown import Showing, Shown
from symfric.laws.base.law import Law
from symfric.model import Model, check_model
from symfric.model.contact import APPLIED

COARSE, FINE = 12, 240
"""Numbers of amplitudes and frequencies at which the law and the loop are evaluated."""
BALANCED, SAME = 1e-7, 1e-4
"""Largest residual of a solution, and relative distance below which two solutions are the same."""
RTOL, STEP = 1e-9, 1e-5
"""Relative tolerance of the describing function, and step of its difference quotients."""


@final
@dataclass(frozen=True, eq=False)
class LinearLoop:
    """Linear loop with the sliding velocity v = C x of its contact.

    Attributes:
        linear: response of all states to the friction force.
        C: shape (n,).
        law: describing function n(V, w) of the contact.
    """

    linear: LinearModel
    C: Array
    law: Harmonic

    def states(self, w: Array) -> NDArray[np.complex128]:
        """Return the response of the states to the friction force, shape (m, n)."""
        return self.linear.response(w)[:, :, 0]


@final
@dataclass(frozen=True, eq=False, repr=False)
class HarmonicBalance(Showing):
    """Predicted oscillation of a linear loop with one contact.

    Attributes:
        model: the model.
        speed: amplitude V of the sliding velocity [m/s].
        frequency: w [rad/s].
        value: describing function n(V, w) of the contact [N s/m].
        x: states of the machine at the largest sliding velocity, by name.
        amplitudes: amplitude of each state of the machine, by name.
        u, p: inputs, and values of free parameters.
    """

    model: Model
    speed: float
    frequency: float
    value: complex
    x: Mapping[str, float]
    amplitudes: Mapping[str, float]
    u: Mapping[str, float]
    p: Mapping[str, float]

    @property
    def period(self) -> float:
        """Period 2 pi / w [s]."""
        return 2 * np.pi / self.frequency

    def orbit(self, *, symmetric: bool = False, rtol: float = 1e-9) -> PeriodicOrbit:
        """Return the periodic orbit near the prediction, stable or unstable.

        Args:
            symmetric, rtol: as in `periodic_orbit`.

        Raises:
            ValueError: bad input, or no orbit was found near the prediction.
        """
        guess = guessed(self.model, self.x, self.period, self.u, self.p, rtol)
        return periodic_orbit(self.model, guess, symmetric=symmetric, rtol=rtol)

    def shown(self) -> Shown:
        """Return amplitudes and period."""
        units = {v.name: v.unit for v in self.model.x}
        amplitudes = ", ".join(f"{k} {a:.6g} {units[k]}" for k, a in self.amplitudes.items())
        title = f"predicted oscillation of '{self.model.name}'"
        return Shown(title, (f"period {self.period:.6g} s, amplitudes: {amplitudes}",))


def harmonic_balance(
    model: Model,
    amplitudes: Sequence[float],
    frequencies: Sequence[float],
    *,
    u: Mapping[str, float] | None = None,
    p: Mapping[str, float] | None = None,
) -> tuple[HarmonicBalance, ...]:
    """Return the predicted oscillations of a linear loop with one contact, the slowest first.

        v = V cos(w t),   1 = G(i w) n(V, w)

    G is the response of the sliding velocity to the friction force, linear near the equilibrium
    without this force, and n the describing function of the law. The prediction is that of the
    first harmonic: it is good if the loop suppresses the others. Motions with long stick are not
    sinusoidal: hunting that needs a static level above the dynamic one is not predicted (see
    `describing_function`). `orbit` of a prediction returns the exact orbit next to it, and
    `periodic_orbit` finds orbits from runs.
    Source: Olsson and Astrom, Friction Generated Limit Cycles, IEEE TCST 9(4), 2001, 629-636.

    Args:
        model: model with one contact; it should be linear, and its normal force constant.
        amplitudes: (low, high), searched range of V [m/s].
        frequencies: (low, high), searched range of w [rad/s].
        u, p: inputs, and values of free parameters, by name.

    Returns:
        All solutions that a grid over the range shows; empty without one.

    Raises:
        ValueError: bad input, or no rest without friction force, as under a constant load.
    """
    where = "harmonic_balance"
    check_model(where, model)
    u, p = model.named("u", u), model.named("p", p)
    V, w = _range(f"{where}: amplitudes", amplitudes), _range(f"{where}: frequencies", frequencies)
    loop = _loop(where, model, u, p)
    every = list[Array]()
    for guess in _guesses(loop, V, w):
        solution = root(_residual, guess, args=(loop,), options={"eps": STEP**2})
        new = np.asarray(solution.x, float)
        inside = np.log([V[0], w[0]]) - SAME <= new, new <= np.log([V[1], w[1]]) + SAME
        if not np.all(inside) or np.abs(_residual(new, loop)).max() > BALANCED:
            continue
        if all(np.abs(new - old).max() > SAME for old in every):
            every.append(new)
    every.sort(key=lambda one: float(one[1]))
    return tuple(_predicted(model, loop, np.exp(one), u, p) for one in every)


def _range(where: str, value: object) -> tuple[float, float]:
    """Return a range of positive numbers."""
    ends = checks.array(where, value, what="(low, high)")
    if ends.size != 2 or not 0 < ends[0] < ends[1]:
        raise checks.refused(where, "(low, high) with 0 < low < high", value)
    return float(ends[0]), float(ends[1])


def _loop(where: str, model: Model, u: Mapping[str, float], p: Mapping[str, float]) -> LinearLoop:
    """Return the loop, linear near its equilibrium without friction force."""
    if len(model.contacts) != 1 or any(name != APPLIED for name in model.contacts[0].given):
        raise checks.refused(
            f"{where}: model", "a model with one contact, whose law has no further inputs", model
        )
    (contact,), bare = model.contacts, model.open
    law = checks.kind(f"{where}: model", contact.law, Law, "a law, such as LuGre()")
    force = contact.variable.name
    at = equilibrium(bare, u={**u, force: 0.0}, p=p)
    names = [v.name for v in bare.x]
    linear = linearize(bare, at, inputs=[force], outputs=names)
    slip = ca.SX(contact.slip)
    slopes = at.equations.expressed(
        ca.horzcat(slip, ca.SX(contact.N), ca.jacobian(slip, bare.vector("x")))
    )
    v, N, *C = slopes(at.y, at.data).full()[0].tolist()
    if max(map(abs, (v, *at.drift.values()))) > BALANCED:
        raise checks.refused(
            f"{where}: model", "a loop that rests without friction force", model,
            "a constant speed or load is a bias, which this balance leaves out",
        )  # fmt: skip
    return LinearLoop(linear, np.array(C), Harmonic(law, N, RTOL))


def _residual(at: Array, loop: LinearLoop) -> Array:
    """Return real and imaginary part of 1 / (G(i w) n(V, w)) - 1 at (log V, log w)."""
    V, w = np.exp(at).tolist()
    off = 1 / (complex(loop.states(np.array([w]))[0] @ loop.C) * loop.law(V, w)) - 1
    return np.array([off.real, off.imag])


def _guesses(loop: LinearLoop, V: tuple[float, float], w: tuple[float, float]) -> Array:
    """Return (log V, log w) of the cells in which both parts of the balance change their signs.

    The describing function is interpolated; the response of the loop is not.
    """
    coarse, fine = (
        [np.linspace(log(low), log(high), n) for low, high in (V, w)] for n in (COARSE, FINE)
    )
    known = loop.law.table(np.exp(coarse[0]), np.exp(coarse[1]))
    scale = np.exp(coarse[0])[:, None]
    parts = (known.real * scale, known.imag * scale)
    real, imag = (
        RectBivariateSpline(coarse[0], coarse[1], part)(fine[0], fine[1]) for part in parts
    )
    n = (real + 1j * imag) / np.exp(fine[0])[:, None]
    with np.errstate(all="ignore"):  # no force in a dead band
        off = 1 / ((loop.states(np.exp(fine[1])) @ loop.C) * n) - 1
    changes = np.ones((FINE - 1, FINE - 1), bool)
    for part in (off.real, off.imag):
        corners = np.array([part[:-1, :-1], part[1:, :-1], part[:-1, 1:], part[1:, 1:]])
        changes &= (corners.min(axis=0) <= 0) & (corners.max(axis=0) >= 0)
    i, k = np.nonzero(changes)
    return np.array([fine[0][i], fine[1][k]]).T


def _predicted(
    model: Model, loop: LinearLoop, at: Array, u: Mapping[str, float], p: Mapping[str, float]
) -> HarmonicBalance:
    """Return the prediction at (V, w)."""
    V, w = float(at[0]), float(at[1])
    value = loop.law(V, w)
    states = loop.states(at[1:])[0] * value * V
    names, rest = loop.linear.outputs, np.array([*loop.linear.at.x.values()])
    x = dict(zip(names, (rest + states.real).tolist(), strict=True))
    sizes = dict(zip(names, np.abs(states).tolist(), strict=True))
    return HarmonicBalance(model, V, w, value, x, sizes, u, p)
