"""Sampled motion of one mass under friction, with exact sensitivities.

One step of length H solves an implicit equation for the velocity. Its length is stretched according
to the result, because friction of slope -a_v is a decay that one implicit step underestimates:

    vb = v + H a(vb),   v1 = v + S a(v1),   S = H phi(-H a_v(vb)),   x1 = x + H (v + v1)/2

phi(z) = (e^z - 1)/z for z within +-1. The step is of second order in sliding, and exact under
constant force for Coulomb with viscous friction. A dissipative friction law does not reverse the
velocity by itself. Therefore v1 lies between 0 and v + S a(0), and a guarded Newton iteration finds
it for any slope at rest. Friction that holds the mass at rest is detected directly, at the speed
`CREEP`: a jump at v = 0 is the exact impulse clamp, and sticking needs no events or small steps.

The derivatives follow from the implicit function theorem, not from the iteration:

    (1 - S a_v) dv1 = dv + S (a_x dx + a_u du + a_p dp) + a dS,

and dv1 = 0 if the mass is held. The step is one CasADi Function of a sample. The chain of samples
runs as compiled C if there is a compiler, otherwise in CasADi's virtual machine, with identical
bits.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple, cast, final

import casadi as ca
import numpy as np

from identification.residuals.evaluation import Array
from symfric.foundation.programs import find_compiler
from symfric.integrator.compiled.columns import Columns
from symfric.model import Model

SEARCH, POLISH = 9, 5
"""Law evaluations to find vb, and to find v1 from it; two or three are usually sufficient."""
CREEP = 1e-12
"""Speed relative to the typical velocity below which a mass held by friction is at rest."""
LOOSE = 2e-2
"""Largest residual of the implicit equation, relative to its velocities, that is acceptable."""


class Mass:
    """Equations of one mass, x' = v and v' = a(x, v, u, p), and their derivatives.

    Attributes:
        a: acceleration (x, v, u, p) -> a.
        slopes: (x, v, u, p) -> a, a_x, a_v, a_u, a_p.
        bends: (x, v, u, p) -> derivatives of a_v by x, v, u, p.
        newton: (x, v, u, p) -> a, a_v.
        inputs: names of the inputs u.
        parameters: number of parameters p.
        creep: speed [velocity unit] below which a held mass is at rest.

    Raises:
        ValueError: the model has states other than a position and its velocity (such as those of a
            law), algebraic variables, events, or equations that depend on time.
    """

    def __init__(self, model: Model) -> None:
        wrong = why_not_sampled(model)
        if wrong:
            raise ValueError(f"sampled motion of '{model.name}': {wrong}")
        at = [*(variable.symbol for variable in model.x), model.vector("u"), model.vector("p")]
        a = cast(ca.SX, model.ode)[1]
        a_v = ca.jacobian(a, at[1])
        self.a = ca.Function("a", at, [a])
        self.slopes = ca.Function("slopes", at, [a, *(ca.jacobian(a, q) for q in at)])
        self.bends = ca.Function("bends", at, [ca.jacobian(a_v, q) for q in at])
        self.newton = ca.Function("newton", at, [a, a_v])
        self.inputs = [variable.name for variable in model.u]
        self.parameters = len(model.p)
        self.creep = CREEP * model.x[1].nominal


def why_not_sampled(model: Model) -> str:
    """Return why a model cannot be stepped as one mass; "" if it can."""
    states, algebraic = ([v.name for v in group] for group in (model.x, model.z))
    if len(states) != 2 or model.z or model.ode is None:
        more = f" and algebraic {', '.join(algebraic)}" if algebraic else ""
        return (
            "expected two states, a position and its velocity, and a friction law without states, "
            f"got states {', '.join(states) or 'none'}{more}; use engine='simulate'"
        )
    rate = model.ode[0]
    if model.events or not ca.is_equal(ca.simplify(rate), model.x[1].symbol, 2):
        what = "events" if model.events else f"{states[0]}' = {rate}"
        return f"expected {states[0]}' = {states[1]} without events, got {what}"
    for contact in model.contacts:
        slip = ca.simplify(ca.SX(contact.slip))
        if not ca.is_equal(slip, model.x[1].symbol, 2):
            return f"expected friction at the velocity {model.x[1].name} alone, got it at {slip}"
    if ca.depends_on(model.ode, model.t):
        return "expected equations without time, got some with it; make it an input"
    return ""


class Dual(NamedTuple):
    """Value with its derivatives by the parameters and the start, a row (1, n) of SX."""

    value: ca.SX
    slope: ca.SX


def advance(mass: Mass, at: Sequence[Dual], p: Dual, H: ca.SX) -> tuple[Dual, Dual, ca.SX]:
    """Return position and velocity after a step from (x, v, u), and the equation's residual."""
    x, v, u = at
    middle = Dual(x.value + H / 2 * v.value, x.slope + H / 2 * v.slope)
    here = (middle.value, u.value, p.value)
    held, vb, _ = _velocity(mass, here, v.value, H, v.value, SEARCH)
    sides = (middle.slope, u.slope, p.slope)
    _, _, slope_b, *_ = found = mass.slopes(middle.value, vb, u.value, p.value)
    moved_b = ca.if_else(held, 0, 1) * (v.slope + H * _along(found[1:], sides))
    moved_b = moved_b / ca.if_else(held, 1, 1 - H * slope_b)
    bend = mass.bends(middle.value, vb, u.value, p.value)
    z = -H * slope_b
    z_slope = -H * (_along(bend, sides) + bend[1] * moved_b)
    inside = ca.logic_and(z > -1, z < 1)
    stretch, growth = _phi(ca.fmin(ca.fmax(z, -1), 1))
    S, S_slope = H * stretch, H * ca.if_else(inside, growth, 0) * z_slope
    held, v1, free = _velocity(mass, here, v.value, S, vb, POLISH)
    found = mass.slopes(middle.value, v1, u.value, p.value)
    a, a_v = found[0], found[2]
    steep = ca.if_else(held, 1, 1 - S * a_v)
    moved = (v.slope + S * _along(found[1:], sides) + a * S_slope) / steep
    moved = ca.if_else(held, 0, 1) * moved
    scale = ca.fabs(v.value) + ca.fabs(free) + mass.creep
    gap = ca.if_else(held, 0, ca.fabs(v1 - v.value - S * a) / scale)
    new = Dual(x.value + H / 2 * (v.value + v1), x.slope + H / 2 * (v.slope + moved))
    return new, Dual(v1, moved), gap


def _along(slopes: Any, sides: Sequence[ca.SX]) -> ca.SX:
    """Return a_x dx + a_u du + a_p dp for `slopes` by x, v, u, p."""
    by_x, _, by_u, by_p = slopes
    return sum((ca.mtimes(s, d) for s, d in zip((by_x, by_u, by_p), sides, strict=True)), ca.SX(0))


def _phi(z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return phi(z) = (e^z - 1)/z and its derivative, near 0 by their series."""
    small = ca.fabs(z) < 1e-2
    safe = ca.if_else(small, 1, z)
    series = 1 + z / 2 * (1 + z / 3 * (1 + z / 4 * (1 + z / 5)))
    phi = ca.if_else(small, series, ca.expm1(safe) / safe)
    series = 0.5 + z * (1 / 3 + z * (1 / 8 + z * (1 / 30 + z / 144)))
    return phi, ca.if_else(small, series, (ca.exp(safe) - phi) / safe)


def _velocity(
    mass: Mass, here: Sequence[ca.SX], v: ca.SX, S: ca.SX, guess: ca.SX, evaluations: int
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return whether friction holds the mass, the velocity w = v + S a(w), and v + S a(0).

    Newton's method runs inside a bracket between 0 and v + S a(0). If its first step leaves the
    bracket, a step from rest is used, where friction is steep; otherwise the bracket is halved.
    """
    x, u, p = here
    free = v + S * mass.a(x, 0, u, p)
    side = ca.if_else(free < 0, -1, 1)
    rest = mass.creep * side
    a, a_v = mass.newton(x, rest, u, p)
    gap = rest - v - S * a
    held = side * gap >= 0
    off_rest = rest - gap / (1 - S * a_v)
    low, high = rest, side * ca.fmax(side * free, mass.creep)
    w = side * ca.fmin(ca.fmax(side * guess, side * low), side * high)
    for k in range(evaluations):
        a, a_v = mass.newton(x, w, u, p)
        gap = w - v - S * a
        short = side * gap < 0
        low, high = ca.if_else(short, w, low), ca.if_else(short, high, w)
        step = w - gap / (1 - S * a_v)
        middle = (low + high) / 2
        other = middle if k else ca.if_else(_inside(off_rest, low, high, side), off_rest, middle)
        w = ca.if_else(_inside(step, low, high, side), step, other)
    return held, ca.if_else(held, 0, w), free


def _inside(w: ca.SX, low: ca.SX, high: ca.SX, side: ca.SX) -> ca.SX:
    return ca.logic_and(side * w >= side * low, side * w <= side * high)


Feedback = Callable[[Sequence[Dual], ca.SX], tuple[list[Dual], list[Dual]]]
"""Function (x, v, controller states; row of a sample) -> (inputs, controller states)."""


def given_inputs(count: int) -> Feedback:
    """Return a feedback without a controller, whose inputs are those in the rows."""

    def feedback(state: Sequence[Dual], row: ca.SX) -> tuple[list[Dual], list[Dual]]:
        still = ca.SX(1, state[0].slope.shape[1])
        return [Dual(row[i], still) for i in range(count)], []

    return feedback


class SteppedMotion(NamedTuple):
    """Motion at n + 1 instants, inputs in the n samples between them, and all derivatives.

    Attributes:
        states: x, v and the states of the controller, shape (n + 1, states).
        slopes: derivatives by the parameters and the start, shape (n + 1, states, unknowns).
        inputs: inputs of the mass, shape (n, inputs).
        input_slopes: derivatives of the inputs, shape (n, inputs, unknowns).
        gap: residual of the implicit equations relative to their velocities, in the 4-norm.
    """

    states: Array
    slopes: Array
    inputs: Array
    input_slopes: Array
    gap: float

    def every(self, k: int) -> "SteppedMotion":
        """Return the motion at every k-th instant, with the inputs that begin there."""
        return SteppedMotion(*(part[::k] for part in self[:4]), gap=self.gap)


@final
@dataclass(frozen=True, eq=False)
class Chain:
    """Mass stepped from sample to sample, with a controller that acts at each sample.

    Attributes:
        sample: (state, row, p) -> (state after the sample, inputs in it). The state contains x, v,
            the states of the controller, the accumulated gap, and the derivatives of all but the
            gap. The row contains the length of the sample [s] and the arguments of the feedback.
        inputs, states, slopes: numbers of inputs, states and derivatives.
    """

    sample: ca.Function
    inputs: int
    states: int
    slopes: int

    @classmethod
    def of(
        cls, mass: Mass, feedback: Feedback, *, row: int, memory: int = 0, substeps: int = 2
    ) -> "Chain":
        """Return the chain of `mass`, with derivatives by its parameters and the initial x and v.

        Args:
            mass: equations of the mass.
            feedback: controller of the mass, or given inputs.
            row: count of numbers per sample in addition to its length.
            memory: number of controller states.
            substeps: steps per sample.
        """
        count, n = mass.parameters, 2 + memory
        many = count + 2
        values, gap, slope = ca.SX.sym("s", n), ca.SX.sym("gap"), ca.SX.sym("S", n, many)
        length, given, p = ca.SX.sym("length"), ca.SX.sym("row", row), ca.SX.sym("p", count)
        by_p = ca.horzcat(ca.SX.eye(count), ca.SX(count, 2))
        before = [Dual(values[i], slope[i, :]) for i in range(n)]
        inputs, after = feedback(before, given)
        u = _stacked(inputs)
        x, v, most = before[0], before[1], gap
        for _ in range(substeps):
            x, v, left = advance(mass, (x, v, u), Dual(p, by_p), length / substeps)
            most = most + left**4  # unlike a maximum, this norm keeps NaN
        new = _stacked([x, v, *after])
        arguments = [ca.vertcat(values, gap, ca.vec(slope)), ca.vertcat(length, given), p]
        state, acting = [new.value, most, ca.vec(new.slope)], [u.value, ca.vec(u.slope)]
        results = [ca.densify(ca.vertcat(*part)) for part in (state, acting)]
        return cls(ca.Function("sample", arguments, results, {"cse": True}), len(inputs), n, many)

    @cached_property
    def _columns(self) -> Columns:
        return Columns(self.sample, chained=True)

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def __call__(self, rows: Array, p: Array, start: Array, start_slopes: Array) -> SteppedMotion:
        """Return the motion that begins at `start`.

        Args:
            rows: length of each sample [s] and arguments of the feedback, shape (n, 1 + row).
            p: parameters.
            start: states at the first instant, shape (states,).
            start_slopes: derivatives of `start`, shape (states, slopes).
        """
        n, k, many = self.states, self.inputs, self.slopes
        first = np.concatenate([start, [0.0], start_slopes.ravel("F")])
        same = (p.reshape(1, -1), np.zeros(len(rows), dtype=np.intp))
        backend = "vm" if find_compiler() is None else "compiled"
        after, inputs = self._columns([rows, same], first, backend)
        every = np.vstack([first, after])
        return SteppedMotion(
            states=every[:, :n],
            slopes=every[:, n + 1 :].reshape(len(every), many, n).transpose(0, 2, 1),
            inputs=inputs[:, :k],
            input_slopes=inputs[:, k:].reshape(len(rows), many, k).transpose(0, 2, 1),
            gap=float(every[-1, n]) ** 0.25,
        )


def _stacked(parts: Sequence[Dual]) -> Dual:
    """Return values and dense derivatives stacked in columns."""
    value, slope = zip(*parts, strict=True) if parts else ((), ())
    return Dual(ca.vertcat(*value), ca.densify(ca.vertcat(*slope)))


def why_no_motion(motion: SteppedMotion) -> str:
    """Return why a motion is unusable; "" if it is usable."""
    finite = np.isfinite(motion.states).all(axis=1)
    if not finite.all():
        return f"the simulated motion is not finite from sample {int(np.argmin(finite))} on"
    if not motion.gap < LOOSE:
        return (
            f"steps did not converge (gap {motion.gap:.1e} of the velocity): friction that "
            "supplies power, or that jumps or falls too steeply with speed for this sample time"
        )
    return ""
