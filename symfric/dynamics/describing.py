"""Describing functions of friction laws: the first harmonic of the force in a sinusoidal motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, final

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from symfric.dynamics.linear import positive
from symfric.dynamics.orbit import periodic_orbit
from symfric.dynamics.shooting import METHOD
from symfric.foundation import checks
from symfric.foundation.numeric import Array
from symfric.foundation.parameters import Variable
from symfric.foundation.shown import Showing, Shown, TextTable
from symfric.foundation.status import SolveError
from symfric.integrator.simulate import simulate
from symfric.laws.base import smooth
from symfric.laws.base.law import FORCE, Law, require_law
from symfric.model import Contact, Model
from symfric.results.signals import integral_between

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OCTAVES = 60
"""Number of octaves over which the quadrature of a memoryless law is graded towards v = 0."""
RUN = 2
"""Number of periods of the run that guesses the periodic motion of states."""
ROWS = 12
"""Largest number of printed rows."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class DescribingFunction(Showing):
    """Describing function of a friction law over amplitude and frequency.

    Attributes:
        law: the law.
        N: normal force [N].
        amplitudes: amplitudes V of the sliding velocity [m/s], shape (k,).
        frequencies: w [rad/s], shape (m,).
        values: complex values [N s/m], shape (k, m).
    """

    law: Law
    N: float
    amplitudes: Array
    frequencies: Array
    values: NDArray[np.complex128]

    def plot(self, path: str | Path | None = None) -> Figure:
        """Plot magnitude and phase over the frequency, one curve for each amplitude.

        With a single frequency, they are plotted over the amplitude.

        Args:
            path: image file.
        """
        from symfric.dynamics.pictures import bode  # noqa: PLC0415  (slow to import)

        up = "magnitude [N s/m]"
        if self.frequencies.size == 1:
            names = [[f"{self.frequencies[0]:.3g} rad/s"]]
            labels = "amplitude of the velocity [m/s]", up
            return bode(self.amplitudes, self.values[:, :, None], names, path, labels)
        names = [[f"{V:.3g} m/s"] for V in self.amplitudes]
        labels = "frequency [rad/s]", up
        return bode(self.frequencies, self.values.T[:, :, None], names, path, labels)

    def shown(self) -> Shown:
        """Return magnitudes and phases."""
        rows = [
            (f"{V:.4g}", f"{w:.4g}", f"{abs(n):.6g}", f"{np.degrees(np.angle(n)):.2f}")
            for V, row in zip(self.amplitudes, self.values, strict=True)
            for w, n in zip(self.frequencies, row, strict=True)
        ]
        header = ("amplitude [m/s]", "frequency [rad/s]", "magnitude [N s/m]", "phase [deg]")
        title = f"describing function of {type(self.law).__name__} at {self.N:g} N"
        lines = (f"{len(rows)} values, the first {ROWS}:",) if len(rows) > ROWS else ()
        return Shown(title, lines, TextTable(header, tuple(rows[:ROWS]), numbers=(0, 1, 2, 3)))


def describing_function(
    law: Law,
    amplitudes: ArrayLike,
    frequencies: ArrayLike,
    *,
    N: float = 1.0,
    rtol: float = 1e-9,
) -> DescribingFunction:
    """Return the describing function of a law over amplitude and frequency.

        v = V cos(w t),   n(V, w) = w / (pi V) int F exp(-i w t) dt   over one period 2 pi / w

    F is the force in the periodic motion of the states of the law, which shooting finds without a
    transient. The real part is that of a damper [N s/m], and -w times the imaginary part that of a
    spring [N/m]. A memoryless law has a real value without influence of the frequency, such as
    4 F_c / (pi V) for Coulomb friction. At small V, LuGre is sigma_0 / (i w) + sigma_1 + sigma_2.
    For a rotary law read rad/s, N m and N m s/rad.

    Limits: an applied force F_e is unknown in a given motion. A law with this input has the force
    of `law.sliding`, since the velocity passes zero without a stop; its static level has no effect.
    The force of a law that is not odd may have a mean, which is left out. Shooting may fail for
    laws with many modes at amplitudes far below their break-away, such as GMS below 1e-5 m/s.
    Source: Gelb and Vander Velde, Multiple-Input Describing Functions, 1968, ch. 2.

    Args:
        law: friction law of a scalar sliding velocity, without further inputs except F_e.
        amplitudes: V > 0 [m/s], shape (k,).
        frequencies: w > 0 [rad/s], shape (m,).
        N: normal force [N].
        rtol: relative tolerance of the motions of the states.

    Raises:
        ValueError: bad input, or no periodic motion of the states was found.
    """
    where = "describing_function"
    require_law(f"{where}: law", law)
    V = positive(f"{where}: amplitudes", amplitudes, "amplitudes > 0 of the velocity [m/s]")
    w = positive(f"{where}: frequencies", frequencies, "frequencies > 0 [rad/s]")
    load = checks.number(f"{where}: N", N, unit="N", lower=0.0)
    if further := [i.name for i in law.inputs if i.name != FORCE]:
        raise checks.refused(
            f"{where}: law", f"a law without the inputs {checks.listed(further)}", law,
            "give them constant values, as in the contact of a model",
        )  # fmt: skip
    checks.number(f"{where}: rtol", rtol, above=0.0, upper=1e-5)
    return DescribingFunction(law, load, V, w, Harmonic(law, load, rtol).table(V, w))


@final
class Harmonic:
    """First harmonic of the force of a law: n(V, w) [N s/m]."""

    def __init__(self, law: Law, N: float, rtol: float) -> None:
        self.law, self.N, self.rtol = law, N, rtol
        if all(s.whole for s in law.states) and (not law.states or self._applied):
            angle, top = ca.SX.sym("angle"), ca.SX.sym("V")
            force = self._memoryless(top * ca.sin(angle), angle, N)
            self.force = ca.Function("force", [angle, top], [ca.densify(force * ca.sin(angle))])
            return
        self.force = None
        V, w = Variable("V", "m/s", start=1.0), Variable("w", "rad/s", start=1.0)
        t = ca.SX.sym("t")
        contact = Contact("contact", V.symbol * ca.cos(w.symbol * t), N, law)
        self.model = Model("sinus", p=(V, w), t=t, ode=ca.SX(0, 1), contacts=(contact,))

    @property
    def _applied(self) -> bool:
        return any(i.name == FORCE for i in self.law.inputs)

    def _memoryless(self, v: ca.SX, angle: ca.SX, N: float) -> ca.SX:
        """Return the force of a law without states, or with modes only."""
        if not self._applied:
            return ca.SX(self.law.force(v, N))
        ahead, back = (ca.SX(self.law.sliding(v, N, side)) for side in (1, -1))
        return ca.SX(smooth.choose(angle > 0, ahead, back))

    def __call__(self, V: float, w: float) -> complex:
        """Return n(V, w)."""
        return self._of_motion(V, w) if self.force is None else _of_curve(self.force, V)

    def table(self, V: Array, w: Array) -> NDArray[np.complex128]:
        """Return the values at all amplitudes and frequencies, shape (k, m)."""
        needed = w if self.force is None else w[:1]
        values = np.array([[self(float(a), float(b)) for b in needed] for a in V], complex)
        return np.repeat(values, w.size // needed.size, axis=1)

    def _of_motion(self, V: float, w: float) -> complex:
        """Return the value for the periodic motion of the states."""
        model, T, p = self.model, 2 * np.pi / w, {"V": V, "w": w}
        try:
            run = simulate(model, RUN * T, p=p, rtol=1e-7, method=METHOD)
            orbit = periodic_orbit(
                model, run, p=p, period=T, symmetric=self.law.facts.odd, rtol=self.rtol
            )
        except (ValueError, SolveError) as error:
            raise ValueError(
                f"describing_function: expected a periodic motion of {type(self.law).__name__} at "
                f"N = {self.N:g} N, V = {V:g} m/s and w = {w:g} rad/s, got none: {error}"
            ) from error
        run, (contact,), angle = orbit.run, model.contacts, w * model.t
        parts = [
            integral_between(run.step_times, run.of, contact.friction * wave, 0.0, T)
            for wave in (ca.cos(angle), -ca.sin(angle))
        ]
        return complex(*parts) * 2 / (T * V)


def _of_curve(force: ca.Function, V: float) -> complex:
    """Return 2 / (pi V) int F(V sin(a)) sin(a) da from -pi/2 to pi/2."""
    half = np.pi / 2 * 2.0 ** -np.arange(OCTAVES)
    ends = np.concatenate([-half, [0.0], half[::-1]])

    def of(_: ca.SX, at: Array) -> Array:
        return force(at.reshape(1, -1), V).full()

    whole = integral_between(ends, of, ca.SX(0), -np.pi / 2, np.pi / 2)
    return complex(2 / (np.pi * V) * whole)
