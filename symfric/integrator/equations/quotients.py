"""Quotients by one divisor as products with its reciprocal: a division costs as much as ten others.

Compilers do so only where they may round otherwise than the virtual machine does.
"""

from collections import Counter

import casadi as ca

from symfric.foundation.numeric import reciprocal

OTHERS = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST)


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
    work: dict[int, ca.SX] = {}
    inverse: dict[int, ca.SX] = {}
    found = [ca.SX(0)] * expression.nnz()
    for k, operation in enumerate(operations):
        at = operands[k]
        if operation == ca.OP_OUTPUT:
            found[places[k][1]] = work[at[0]]
            continue
        divisor = divisors.get(k, 0)
        if operation == ca.OP_INPUT:
            value = arguments[at[0]]
        elif operation == ca.OP_CONST:
            value = ca.SX(function.instruction_constant(k))
        elif k in divisors and (often[divisor] > 1 or operations[divisor] == ca.OP_CONST):
            if divisor not in inverse:
                inverse[divisor] = reciprocal(work[at[1]])
            value = work[at[0]] * inverse[divisor]
        elif len(at) == 1:
            value = ca.SX.unary(operation, work[at[0]])
        else:
            value = ca.SX.binary(operation, work[at[0]], work[at[1]])
        work[places[k][0]] = value
    return ca.SX(expression.sparsity(), ca.vertcat(*found))


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
