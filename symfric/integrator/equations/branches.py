"""The hyperbolic tangent without branches.

Which way the one of the C library goes depends on its argument, a processor guesses it wrong, and a
small step spends a third of its time there.

Written out in the graph, both engines do the same operations, and vectors of members can, too.
"""

from collections.abc import Sequence

import casadi as ca

from symfric.integrator.equations.instructions import rewritten

MIDDLE = 0.7
"""Up to here tanh x = x + x^3 U(x^2)/V(x^2), equal to 1e-17; beyond, 1 - 2/(e^2|x| + 1) loses less
than a bit to cancellation."""
U = (-0.3333333333333333, -0.02049522886753235, -0.00019901990913769401)
V = (1.0, 0.46148568660258626, 0.023286572463946293, 0.00020636437984939814)
"""Of the rational function that interpolates (tanh x / x - 1) / x^2 at Chebyshev nodes in x^2."""

LARGE = 300
"""Functions with more instructions stay as they are: tanh is little of them, and reading them takes
time."""


def tanh(x: ca.SX) -> ca.SX:
    """Tanh x to 3.5e-16, relative; odd, NaN for NaN; the same operations for all x.

    It has derivatives, right but long: those are better taken of tanh itself, before.
    """
    size = ca.fabs(x)
    square = x * x
    near = x + x * square * (_polynomial(U, square) / _polynomial(V, square))
    far = ca.copysign(1 - 2 / (ca.exp(2 * size) + 1), x)
    return ca.if_else(size < MIDDLE, near, far)


def _polynomial(coefficients: Sequence[float], x: ca.SX) -> ca.SX:
    value = ca.SX(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = value * x + coefficient
    return value


def branchless(function: ca.Function, most: int = LARGE) -> ca.Function:
    """The SX `function` with every tanh written out; itself where it has none, or is large.

    Args:
        function: of columns, or matrices.
        most: instructions that it may have.
    """
    count = function.n_instructions()
    if count > most or ca.OP_TANH not in map(function.instruction_id, range(count)):
        return function

    def rule(k: int, operands: list[ca.SX]) -> ca.SX | None:
        return tanh(operands[0]) if function.instruction_id(k) == ca.OP_TANH else None

    arguments = function.sx_in()
    results = rewritten(function, arguments, rule)
    return ca.Function(function.name(), arguments, results, function.name_in(), function.name_out())
