"""Quotients by one divisor as products with its reciprocal: a division costs as much as ten others.

Compilers do so only where they may round otherwise than the virtual machine does.
"""

from collections import Counter

import casadi as ca

from symfric.foundation.numeric import reciprocal
from symfric.integrator.equations.instructions import rewritten


def divided_once(expression: ca.SX) -> ca.SX:
    """`expression` with divisors that are constant, or divide several times, inverted once."""
    arguments = ca.symvar(expression)
    function = ca.Function("f", arguments, [expression])
    count = function.n_instructions()
    operations = [function.instruction_id(k) for k in range(count)]
    if ca.OP_DIV not in operations:
        return expression
    operands = [function.instruction_input(k) for k in range(count)]
    places = [function.instruction_output(k) for k in range(count)]
    divisors = _divisors(operations, operands, places)
    often = Counter(divisors.values())
    inverse: dict[int, ca.SX] = {}

    def rule(k: int, operands: list[ca.SX]) -> ca.SX | None:
        if k not in divisors:
            return None
        divisor = divisors[k]
        if often[divisor] == 1 and operations[divisor] != ca.OP_CONST:
            return None
        if divisor not in inverse:
            inverse[divisor] = reciprocal(operands[1])
        return operands[0] * inverse[divisor]

    return rewritten(function, arguments, rule)[0]


def _divisors(
    operations: list[int], operands: list[list[int]], places: list[list[int]]
) -> dict[int, int]:
    """Number of each division -> number of the instruction that made its divisor."""
    made: dict[int, int] = {}
    found: dict[int, int] = {}
    for k, operation in enumerate(operations):
        if operation == ca.OP_DIV:
            found[k] = made[operands[k][1]]
        if operation != ca.OP_OUTPUT:
            made[places[k][0]] = k
    return found
