"""Functions of the signals of a model: their expressions, comparisons and costs."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from math import inf, isfinite, isnan
from typing import Any, final

import casadi as ca

from symfric.foundation import checks
from symfric.foundation.numeric import Scalar
from symfric.model import Model

EPS = "complementarity"
"""Parameter of problems with complementary signals: the largest product of two of them, as a share
of the product of their typical magnitudes. `solve` decreases it; messages do not offer its name."""
EXPRESSION = "one expression of the signals, such as lambda s: s.x**2"
MATH = "write casadi functions for those of math: ca.sin, ca.sqrt, ca.fmax"
BRANCH = "expressions have no truth value: no if, and, max or a <= x <= b in here"
COMPARISON = "a comparison such as lambda s: s.tip_z <= 0.9"

Comparison = tuple[ca.SX, float, float]
"""(expression, lower, upper)."""


@final
class MissingError(ValueError):
    """Error for a name that a model does not have."""


def offered(known: Iterable[str], given: Iterable[str] = ()) -> list[str]:
    """Return the names that messages offer: `known` without `EPS`, unless it is `given`."""
    return [name for name in known if name != EPS or EPS in given]


@final
class Signals:
    """Signals of a model by name: `s.force` or `s["force"]`.

    These are the time `t` since the start of the problem [s], states, algebraic variables, inputs,
    parameters, outputs, and the details of a mechanism, which are written out on demand.
    """

    def __init__(self, model: Model, convert: Callable[[ca.SX], ca.SX] | None = None) -> None:
        """Create signals; `convert` expresses them in other symbols."""
        self._model, self._convert = model, convert or ca.SX
        self._details: dict[str, None] = {}

    def __getitem__(self, name: str) -> ca.SX:
        model = self._model
        known = {"t": model.t} | {v.name: v.symbol for g in "xzup" for v in getattr(model, g)}
        if name not in (*known, *model.outputs):
            if name not in model.further:
                try:
                    names = offered([*known, *model.outputs])
                    checks.check_names(f"signals of '{model.name}'", [name], names)
                except ValueError as error:
                    raise MissingError(str(error)) from None
            self._details[name] = None
        return self._convert(known[name] if name in known else model.expression(name))

    def __getattr__(self, name: str) -> ca.SX:
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __call__(self) -> tuple[str, ...]:
        """Return the names of the details that were accessed."""
        return tuple(self._details)


def arguments(model: Model) -> list[ca.SX]:
    """Return [t, x, z, u, p] of a model."""
    return [model.t, *(model.vector(letter) for letter in "xzup")]


def fresh_symbols(model: Model, mark: str) -> tuple[list[ca.SX], Signals]:
    """Return new symbols [t, x, z, u, p] and signals in them, as two phases may share a model."""
    old = arguments(model)
    new = [ca.SX.sym(f"{mark}_{letter}", s.numel()) for letter, s in zip("txzup", old, strict=True)]
    both = ca.vertcat(*old), ca.vertcat(*new)
    return new, Signals(model, lambda expression: ca.substitute(expression, *both))


def called(function: Callable[..., Any], *signals: Any, what: str) -> Any:
    """Call `function` and convert errors of CasADi and Python to a `ValueError`."""
    try:
        return function(*signals)
    except (TypeError, ArithmeticError, AttributeError, RuntimeError) as error:
        last = str(error).strip().splitlines()[-1].rstrip(".")
        short = last.split(": ", 1)[-1] if ".cpp:" in last else last
        plain = "argument" in str(error) or isinstance(error, AttributeError)
        hint = BRANCH if "truth value" in str(error) else "" if plain else MATH
        raise ValueError(
            f"expected {what}, got {type(error).__name__}: {short}" + f"; {hint}" * bool(hint)
        ) from error


def value_of(function: Callable[..., Any], *signals: Any) -> ca.SX:
    """Return the expression that `function` returns for the signals, SX (1, 1).

    Raises:
        ValueError: the result is not one expression, or contains a constant that is not finite.
    """
    result = called(function, *signals, what=EXPRESSION)
    hint = ""
    if isinstance(result, ca.MX):
        hint = "write it with casadi.SX"
    elif isinstance(result, float) and isnan(result):
        hint = MATH
    elif isinstance(result, ca.SX | ca.DM) or checks.as_number(result) is not None:
        value = ca.SX(result)
        odd = [number for number in constants(value) if not isfinite(number)]
        if value.numel() == 1 and not odd:
            return value
        if value.numel() == 1:
            hint = f"it holds {odd[0]}" + f"; {MATH}" * isnan(odd[0])
    text = f"expected {EXPRESSION}, got {checks.shown(result)}"
    raise ValueError(text + f"; {hint}" * bool(hint))


def constants(expression: ca.SX) -> Iterator[float]:
    """Yield the numbers in `expression`."""
    f = ca.Function("f", ca.symvar(expression), [expression])
    for k in range(f.n_instructions()):
        if f.instruction_id(k) == ca.OP_CONST:
            yield float(f.instruction_constant(k))


KINKS = {ca.OP_FABS: "abs", ca.OP_FMAX: "fmax", ca.OP_FMIN: "fmin"}
"""Operation -> its name, of operations whose derivatives jump."""


def kinks(expression: ca.SX) -> str:
    """Return a sentence about operations in a cost whose derivatives jump, or ""."""
    f = ca.Function("f", ca.symvar(expression), [expression])
    found = {KINKS.get(f.instruction_id(k), "") for k in range(f.n_instructions())} - {""}
    if not found:
        return ""
    return (
        f"The cost contains {' and '.join(sorted(found))}, whose derivative jumps; write "
        "absolute(...) for the integral of an absolute value, and largest(...) for a maximum."
    )


def comparisons(function: Callable[..., Any], *signals: Any) -> list[Comparison]:
    """Return the rows of the comparison `a <= b`, `a >= b` or `a == b` that `function` returns.

    Columns are compared row by row. `ca.logic_and(a, b)` of comparisons requires both of them.
    `abs(a) <= number` becomes a range of `a`, which has no kink.

    Raises:
        ValueError: the result is not a comparison, or is always true or always false.
    """
    result = called(function, *signals, what=COMPARISON)
    if isinstance(result, bool):
        raise ValueError(
            f"expected {COMPARISON}, got {result}: Python compared numbers; {MATH}; {BRANCH}"
        )
    if not isinstance(result, ca.SX) or result.is_empty():
        raise ValueError(f"expected {COMPARISON}, got {checks.shown(result)}")
    return [row for each in ca.vertsplit(ca.vec(result)) for row in _rows(each)]


def _rows(condition: ca.SX) -> Iterator[Comparison]:
    if condition.is_constant():
        always = "true" if float(ca.DM(condition)) else "false"
        raise ValueError(
            f"expected a comparison that depends on the motion, got one that is always {always}"
        )
    kind = condition.op()
    if kind == ca.OP_AND:
        yield from _rows(condition.dep(0))
        yield from _rows(condition.dep(1))
    elif kind in (ca.OP_LE, ca.OP_LT, ca.OP_EQ):
        yield _sorted(condition.dep(0), condition.dep(1), equal=kind == ca.OP_EQ)
    else:
        raise ValueError(
            f"expected {COMPARISON}, got {checks.shown(condition)}; write <=, >= or == between two "
            "expressions"
        )


def _sorted(left: ca.SX, right: ca.SX, *, equal: bool) -> Comparison:
    """Return the row of left <= right, or left == right, with numbers moved to the bounds."""
    for number in constants(ca.vertcat(left, right)):
        if not isfinite(number):
            raise ValueError(f"expected finite numbers, got {number}; {MATH}")
    if right.is_constant():
        high = float(ca.DM(right))
        if left.op() == ca.OP_FABS and not equal:
            return left.dep(0), -high, high
        return left, (high if equal else -inf), high
    if left.is_constant():
        low = float(ca.DM(left))
        return right, low, (low if equal else inf)
    return left - right, (0.0 if equal else -inf), 0.0


Expression = Callable[[Signals], Scalar]
"""A function of the signals, such as `lambda s: s.force**2`."""

Terms = tuple[tuple[float, Expression], ...]
TERMS = ("running", "end", "squares", "absolutes", "peaks")
"""Fields of a cost with terms."""


@final
@dataclass(frozen=True, eq=False)
class Cost:
    """Cost J = integral of (L + sum_i w_i r_i^2 + sum_i w_i |e_i|) dt + E + sum_i w_i max e_i.

    Costs can be added and multiplied by weights: `integral(lambda s: s.force**2) + 0.1 * TIME`. A
    negative weight maximises: `-at_end(lambda s: s.height)`. Signals are identified by name, so a
    cost can be used with every model that has them.

    Attributes:
        running: the terms of L as (weight, expression).
        end: the terms of E as (weight, expression).
        squares: (w_i, r_i) of `track` and `effort`, stored separately for Gauss-Newton methods.
        absolutes, peaks: (w_i, e_i) of `absolute` and `largest`, with positive weights.
        references: names of the references of `track`.
        largest: True for the largest cost of all scenarios instead of the mean; see `worst`.
    """

    running: Terms = ()
    end: Terms = ()
    squares: Terms = ()
    absolutes: Terms = ()
    peaks: Terms = ()
    references: tuple[str, ...] = ()
    largest: bool = False

    def __add__(self, other: object) -> "Cost":
        if not isinstance(other, Cost):
            return NotImplemented
        if self.largest or other.largest:
            raise ValueError(
                "cost: expected worst(...) around the whole cost, got it added to another; write "
                "worst(a + b)"
            )
        terms = {name: getattr(self, name) + getattr(other, name) for name in TERMS}
        return Cost(references=tuple(dict.fromkeys(self.references + other.references)), **terms)

    def __mul__(self, weight: float) -> "Cost":
        weight = checks.number("cost: weight", weight)
        kinds = {"worst": self.largest, "absolute": self.absolutes, "largest": self.peaks}
        if weight < 0 and (kind := next((name for name, found in kinds.items() if found), "")):
            raise ValueError(
                f"cost: expected a weight >= 0 of {kind}(...), got {weight:g}; it is a least upper "
                "bound, which only a minimum attains"
            )
        terms = {n: tuple((weight * w, term) for w, term in getattr(self, n)) for n in TERMS}
        return replace(self, **terms)

    __rmul__ = __mul__

    def __radd__(self, other: object) -> "Cost":
        return self if other == 0 else NotImplemented  # the first step of `sum`

    def __neg__(self) -> "Cost":
        return -1.0 * self

    def __sub__(self, other: object) -> "Cost":
        return self + (-other) if isinstance(other, Cost) else NotImplemented

    def __truediv__(self, weight: float) -> "Cost":
        weight = checks.number("cost: divisor", weight)
        if weight == 0:
            raise ValueError("cost: expected a divisor that is not zero, got 0")
        return self * (1.0 / weight)

    def expressions(self, signals: Signals) -> tuple[ca.SX, ca.SX]:
        """Return the integrand, including squares, and the end value, SX (1, 1) each.

        Raises:
            ValueError: the model lacks a name, or an expression is not scalar.
        """
        running, end = (
            sum((weight * value_of(term, signals) for weight, term in terms), ca.SX(0))
            for terms in (self.running, self.end)
        )
        for weight, residual in self.residuals(signals):
            running += weight * residual**2
        return running, end

    def residuals(self, signals: Signals) -> tuple[tuple[float, ca.SX], ...]:
        """Return (weight, residual) of each squared term."""
        return tuple((weight, value_of(term, signals)) for weight, term in self.squares)


def _checked(where: str, expression: Expression) -> Expression:
    return checks.function(where, expression, "a function of the signals such as lambda s: s.x**2")


def integral(expression: Expression) -> Cost:
    """Return the integral over the motion as a cost, such as `integral(lambda s: s.force**2)`."""
    return Cost(running=((1.0, _checked("integral", expression)),))


def at_end(expression: Expression) -> Cost:
    """Return the value at the end as a cost; `s.t` is the time since the start of the problem."""
    return Cost(end=((1.0, _checked("at_end", expression)),))


def absolute(expression: Expression, weight: float = 1.0) -> Cost:
    """Return the integral of weight |e| over the motion as a cost, such as fuel |force|.

    It is exact at the collocation points: e = a - b with a, b >= 0 and the integrand a + b.

    Args:
        expression: function of the signals; it may change its sign.
        weight: positive weight.

    Limits: collocation only. The integrand has a kink where e changes its sign within an interval,
    which the quadrature resolves to second order in the length of the interval.
    """
    checked = _checked("absolute", expression)
    return Cost(absolutes=((checks.number("absolute: weight", weight, above=0.0), checked),))


def largest(expression: Expression, weight: float = 1.0) -> Cost:
    """Return weight max e(t), the largest value over the motion, as a cost.

    `largest(lambda s: abs(s.force))` is the largest magnitude. The cost of a problem covers all
    phases, separately in each scenario, and the cost of a phase only this phase. The maximum is a
    constant state that bounds e where path conditions hold.

    Args:
        expression: function of the signals.
        weight: positive weight.
    """
    checked = _checked("largest", expression)
    return Cost(peaks=((checks.number("largest: weight", weight, above=0.0), checked),))


TIME = at_end(lambda s: s.t)
"""Cost equal to the total duration [s] of all phases."""


def track(name: str, reference: float | str | Expression, weight: float | str) -> Cost:
    """Return the integral of weight (signal - reference)^2 as a cost.

    Args:
        name: name of the signal that follows the reference.
        reference: a number; a function of the signals, such as `lambda s: 0.1 * ca.sin(s.t)`; or
            the name of a parameter or signal. A name that the model does not have becomes a
            parameter of the problem with its value in `p`, such as the goal of a controller.
        weight: positive weight, or the name of a parameter, as for `reference`.
    """
    name = checks.text("track", name, "the name of a signal")
    names, factor = tuple[str, ...](), 1.0
    if isinstance(weight, str):
        names = (checks.text("track: weight", weight, "a name or a positive number"),)
    else:
        factor = checks.number("track: weight", weight, above=0.0)
    if isinstance(reference, str):
        names += (checks.text("track: reference", reference, "a name, a number or a function"),)
    elif callable(reference):
        reference = _checked("track: reference", reference)
    else:
        reference = checks.number("track: reference", reference, hint="or a function, or a name")

    def residual(s: Signals) -> Scalar:
        goal = s[reference] if isinstance(reference, str) else reference
        goal = goal(s) if callable(goal) else goal
        scale = ca.sqrt(s[weight]) if isinstance(weight, str) else 1.0
        return scale * (s[name] - goal)

    return Cost(squares=((factor, residual),), references=names)


def effort(name: str, weight: float | str = 1.0) -> Cost:
    """Return the integral of weight signal^2 as a cost; see `track` for the weight."""
    return track(name, 0.0, weight)


def worst(cost: Cost) -> Cost:
    """Return `cost` with the largest value of all scenarios as total, instead of their mean."""
    such = "a cost made of integral(...), at_end(...) and TIME"
    return replace(checks.kind("worst", cost, Cost, such), largest=True)
