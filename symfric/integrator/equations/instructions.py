"""An expression built again, operation by operation, some of them otherwise."""

from collections.abc import Callable

import casadi as ca

Rule = Callable[[int, list[ca.SX]], ca.SX | None]
"""(number of an instruction, its operands) -> what stands for it; None for itself."""


def rewritten(function: ca.Function, arguments: list[ca.SX], rule: Rule) -> list[ca.SX]:
    """Results of an SX `function` at `arguments`, columns of symbols, rewritten by `rule`."""
    symbols = [ca.vertsplit(ca.vec(argument)) for argument in arguments]
    found = [[ca.SX(0)] * function.nnz_out(i) for i in range(function.n_out())]
    work: dict[int, ca.SX] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        at, to = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            found[to[0]][to[1]] = work[at[0]]
        elif operation == ca.OP_INPUT:
            work[to[0]] = symbols[at[0]][at[1]]
        elif operation == ca.OP_CONST:
            work[to[0]] = ca.SX(function.instruction_constant(k))
        else:
            operands = [work[i] for i in at]
            value = rule(k, operands)
            if value is None:
                new = ca.SX.unary if len(at) == 1 else ca.SX.binary
                value = new(operation, *operands)
            work[to[0]] = value
    return [
        ca.SX(function.sparsity_out(i), ca.vertcat(ca.SX(0, 1), *v)) for i, v in enumerate(found)
    ]
