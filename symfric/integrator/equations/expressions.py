"""Expressions rewritten operation by operation, and discontinuities of expressions in time alone.

Tanh: the C library branches on the argument, processors mispredict the branch, and a small step
spends a third of its time there. The graph therefore contains tanh written out without branches.
Both engines then do the same operations, and so do vectors of members.

Quotients with the same divisor become products with its reciprocal, because a division costs as
much as ten other operations. Compilers do this only if they may round differently from the virtual
machine.

Numbers as data: each number becomes a symbol where it is read, so another amplitude gives the same
equations. Exponents of constant powers stay, since they are structure: x^2 is x x, and x^0.5 has no
slope at 0. Limits: numbers that CasADi simplifies away are not replaced: sin(t) for 1 sin(t), 0 for
0 sin(t).

Step limit: at equilibrium, steps grow until they are longer than a future pulse, and no stage falls
on it. A function of time is known in advance and cheap, so it is sampled on a grid, and the span is
halved until each piece is nearly linear. A step has to end where the length of the pieces changes
much from one to the next. A sine has pieces of equal length and no such times.
"""

from collections import Counter
from collections.abc import Callable
from functools import lru_cache
from math import isfinite
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.numeric import Array, applied, reciprocal, walk
from symfric.integrator.compiled.columns import Columns

Rule = Callable[[int, list[ca.SX]], ca.SX | None]
"""(index of an instruction, its operands) -> its replacement; None to keep the instruction."""


def rewritten(function: ca.Function, arguments: list[ca.SX], rule: Rule) -> list[ca.SX]:
    """Return the results of an SX `function` at columns of symbols, rewritten by `rule`."""
    symbols = [ca.vertsplit(ca.vec(argument)) for argument in arguments]

    def made(k: int, operands: list[ca.SX]) -> ca.SX:
        operation = function.instruction_id(k)
        if operation == ca.OP_INPUT:
            argument, row = function.instruction_input(k)
            return symbols[argument][row]
        if operation == ca.OP_CONST:
            return ca.SX(function.instruction_constant(k))
        value = rule(k, operands)
        return applied(operation, operands) if value is None else value

    return [
        ca.SX(function.sparsity_out(i), ca.vertcat(ca.SX(0, 1), *v))
        for i, v in enumerate(walk(function, made))
    ]


MIDDLE = 0.7
"""Largest |x| for tanh x = x + x^3 U(x^2)/V(x^2), which is accurate to 1e-17.

Beyond it, 1 - 2/(e^2|x| + 1) loses less than a bit to cancellation.
"""
U = ca.SX([-0.00019901990913769401, -0.02049522886753235, -0.3333333333333333])
V = ca.SX([0.00020636437984939814, 0.023286572463946293, 0.46148568660258626, 1.0])
"""Coefficients of the rational function for (tanh x / x - 1) / x^2, highest power first.

It interpolates at Chebyshev nodes in x^2.
"""

LARGE = 300
"""Number of instructions above which a function stays unchanged.

Tanh is a small part of such a function, and rewriting takes time.
"""


def tanh(x: ca.SX) -> ca.SX:
    """Return tanh x with a relative error of 3.5e-16, by the same operations for all x.

    The result is odd, and NaN for NaN. Its derivatives are correct but long: differentiate the
    original tanh first.
    """
    size = ca.fabs(x)
    square = x * x
    near = x + x * square * (ca.polyval(U, square) / ca.polyval(V, square))
    far = ca.copysign(1 - 2 / (ca.exp(2 * size) + 1), x)
    return ca.if_else(size < MIDDLE, near, far)


def branchless(function: ca.Function, most: int = LARGE) -> ca.Function:
    """Return the SX `function` with every tanh written out; unchanged if it has none or is large.

    Args:
        function: SX Function of columns or matrices.
        most: largest number of instructions to rewrite.
    """
    count = function.n_instructions()
    if count > most or ca.OP_TANH not in map(function.instruction_id, range(count)):
        return function

    def rule(k: int, operands: list[ca.SX]) -> ca.SX | None:
        return tanh(operands[0]) if function.instruction_id(k) == ca.OP_TANH else None

    arguments = function.sx_in()
    results = rewritten(function, arguments, rule)
    return ca.Function(function.name(), arguments, results, function.name_in(), function.name_out())


def divided_once(expression: ca.SX) -> ca.SX:
    """Return `expression` with constant or repeated divisors inverted once."""
    arguments = ca.symvar(expression)
    function = ca.Function("f", arguments, [expression])
    operations = list(map(function.instruction_id, range(function.n_instructions())))
    if ca.OP_DIV not in operations:
        return expression
    made, divisors = dict[int, int](), dict[int, int]()
    for k, operation in enumerate(operations):
        if operation == ca.OP_DIV:
            divisors[k] = made[function.instruction_input(k)[1]]
        if operation != ca.OP_OUTPUT:
            made[function.instruction_output(k)[0]] = k
    often, inverse = Counter(divisors.values()), dict[int, ca.SX]()

    def rule(k: int, operands: list[ca.SX]) -> ca.SX | None:
        divisor = divisors.get(k)
        if divisor is None:
            return None
        if often[divisor] == 1 and operations[divisor] != ca.OP_CONST:
            return None
        if divisor not in inverse:
            inverse[divisor] = reciprocal(operands[1])
        return operands[0] * inverse[divisor]

    return rewritten(function, arguments, rule)[0]


MOST_NUMBERS = 1000
"""Count of numbers above which an expression is treated as a table, and stays unchanged."""


def lifted(expression: ca.SX, known: ca.SX, name: str) -> tuple[ca.SX, ca.SX, Array]:
    """Return a scalar expression with symbols for its numbers, these symbols, and the numbers.

    Evaluated at these numbers, the result has the same bits: the operations and their order are the
    same.

    Args:
        expression: scalar expression in the symbols `known`.
        known: column of symbols.
        name: prefix of the new symbols.
    """
    function = ca.Function("lift", [known], [expression])
    numbers, symbols = list[float](), list[ca.SX]()

    def number(value: float) -> ca.SX:
        numbers.append(value)
        symbols.append(ca.SX.sym(f"{name}_c{len(symbols)}"))
        return symbols[-1]

    def read(value: ca.SX) -> ca.SX:
        return number(float(value)) if value.is_constant() and isfinite(float(value)) else value

    def rule(k: int, operands: list[ca.SX]) -> ca.SX:
        operation = function.instruction_id(k)
        if operation == ca.OP_CONSTPOW:
            return applied(operation, [read(operands[0]), operands[1]])
        if operation == ca.OP_TWICE:  # CasADi's form of 2 x
            return number(2.0) * read(operands[0])
        return applied(operation, [read(operand) for operand in operands])

    made = read(rewritten(function, [known], rule)[0])
    if len(numbers) > MOST_NUMBERS:
        return expression, ca.SX(0, 1), np.zeros(0)
    return made, ca.vertcat(ca.SX(0, 1), *symbols), np.array(numbers)


DEPTH = 13
"""Number of halvings of the span into grid intervals; shorter features may be missed."""

STRAIGHT = 1e-3
"""Allowed deviation of a piece from a line, relative to the range of the function."""

LEVELS = 3
"""Difference in halvings between neighbours that counts as a discontinuity.

Error control handles smaller differences.
"""


PULSE = 10.0
"""Smallest height of a pulse within a jump, relative to the height of the jump."""
BRIEF = 16
"""Largest length, in grid intervals, of a pulse that may lie between two stages of a step."""
MOST_JUMPS = 64
"""Number of jumps above which a function is sampled on the grid only."""
HALVINGS = 60
"""Number of halvings of a grid interval, down to rounding."""

HUGE = 1e300
"""Bound of the values of functions, which keeps their differences finite."""

QUICKEST = 1.0
"""Percentage of the span, with the shortest pieces, that is ignored: a few jumps do not count."""


class Pieces(NamedTuple):
    """Nearly linear pieces of a function of time.

    Attributes:
        onsets: increasing times [s] inside the span at which a step has to end.
        pace: length [s] of the shortest pieces; inf for a straight line. For a sine it is a
            fiftieth to a hundredth of the period.
    """

    onsets: tuple[float, ...] = ()
    pace: float = np.inf


@lru_cache(64)
def pieces(function: str, t_start: float, t_end: float) -> Pieces:
    """Return the nearly linear pieces of a function of time, given as a serialised SX.

    A jump between two grid points may hide a pulse, such as the derivative of a ramp that lasts a
    picosecond: the middle of such a pulse is one of the onsets.
    """
    expression = ca.SX.deserialize(function)
    time = ca.symvar(expression)
    if not time:
        return Pieces()
    grid = np.linspace(t_start, t_end, 2**DEPTH + 1)
    columns = Columns(ca.Function("input", time, [ca.densify(expression)]))

    def values_at(times: Array) -> Array:
        (found,) = columns([times[:, None]])
        return np.clip(np.nan_to_num(found[:, 0]), -HUGE, HUGE)

    values = values_at(grid)
    level = levels(values)
    places = [*grid[changes(level)].tolist(), *grid[_peaks(level, values)].tolist()]
    halvings = float(np.percentile(level, 100 - QUICKEST, method="lower"))
    return Pieces(
        tuple(sorted((*places, *pulses(values_at, grid, values)))),
        (t_end - t_start) / 2.0**halvings if halvings else np.inf,
    )


def pulses(values_at: Callable[[Array], Array], grid: Array, values: Array) -> tuple[float, ...]:
    """Return the times [s] in the middle of pulses that are hidden in jumps of a function.

    `values` are those of the function on `grid`. The start and the end of a jump are found by
    bisection. The jump hides a pulse if, in its middle, the function differs from the value before
    the jump by more than `PULSE` times the height of the jump.
    """
    jumps = np.flatnonzero(np.abs(np.diff(values)) > STRAIGHT * np.ptp(values))
    if not 0 < jumps.size <= MOST_JUMPS:
        return ()
    before, after = values[jumps], values[jumps + 1]
    near = STRAIGHT * np.abs(after - before)
    edges: list[Array] = []
    for known, same, other in (
        (before, grid[jumps], grid[jumps + 1]),
        (after, grid[jumps + 1], grid[jumps]),
    ):
        for _ in range(HALVINGS):
            middle = (same + other) / 2
            alike = np.abs(values_at(middle) - known) <= near
            same, other = np.where(alike, middle, same), np.where(alike, other, middle)
        edges.append(other)
    middle = (edges[0] + edges[1]) / 2
    high = np.abs(values_at(middle) - before) > PULSE * np.abs(after - before)
    return tuple(middle[high].tolist())


def _peaks(level: NDArray[np.intp], values: Array) -> list[int]:
    """Return grid points at peaks of pulses of up to `BRIEF` intervals, which stages may miss."""
    deepest = np.flatnonzero(level == DEPTH)
    found: list[int] = []
    for run in np.split(deepest, np.flatnonzero(np.diff(deepest) > 1) + 1):
        if 1 < run.size <= BRIEF:
            a, b = int(run[0]), int(run[-1]) + 1
            height = np.abs(values[a : b + 1] - values[a])
            if height.max() > PULSE * height[-1]:
                found.append(a + int(height.argmax()))
    return found


def levels(values: Array) -> NDArray[np.intp]:
    """Return the number of halvings of the span for a nearly linear piece at each grid interval.

    The grid has 2^k + 1 values.
    """
    cells = values.size - 1
    depth = cells.bit_length() - 1
    allowed = STRAIGHT * np.ptp(values)
    found = np.full(cells, depth)
    for level in range(depth - 1, -1, -1):
        width = cells >> level
        ends = values[::width]
        line = ends[:-1, None] + np.diff(ends)[:, None] * (np.arange(width) / width)
        straight = (np.abs(values[:-1].reshape(-1, width) - line) <= allowed).all(axis=1)
        found.reshape(-1, width)[straight] = level
    return found


def changes(level: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return grid points at which the level has changed by `LEVELS` since the last such point."""
    found = [0]
    for i in np.flatnonzero(np.diff(level)) + 1:
        if abs(level[i] - level[found[-1]]) >= LEVELS:
            found.append(int(i))
    return np.array(found[1:], dtype=np.intp)
