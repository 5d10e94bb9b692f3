"""CasADi expressions as lists of instructions, for files that must not run code.

The format of CasADi can contain any `Function`, including shell commands (`jit`), libraries
(`external`) and callbacks. A list of instructions contains only symbols, constants and the scalar
operations in `OPERATIONS`, and is checked completely before expressions are built. Expressions that
CasADi built with simplification, its default, are restored with the same operations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation import identity
from symfric.foundation.numeric import applied, walk

UNARY = (
    "neg", "exp", "log", "sqrt", "sq", "twice", "sin", "cos", "tan", "asin", "acos", "atan",
    "floor", "ceil", "not", "fabs", "sign", "erf", "inv", "sinh", "cosh", "tanh", "asinh", "acosh",
    "atanh", "erfinv", "log1p", "expm1",
)  # fmt: skip
BINARY = (
    "add", "sub", "mul", "div", "pow", "constpow", "lt", "le", "eq", "ne", "and", "or", "fmod",
    "copysign", "if_else_zero", "fmin", "fmax", "atan2", "hypot", "remainder",
)  # fmt: skip
OPERATIONS = (*UNARY, *BINARY)
"""Allowed operations: names of CasADi without "OP_"."""
CODES: dict[str, int] = {name: getattr(ca, f"OP_{name.upper()}") for name in OPERATIONS}
NAMES = {code: name for name, code in CODES.items()}
MOST_ENTRIES = 10**7
"""Largest number of entries of one expression, including zeros."""
DEEPEST = 8000
"""Largest depth of nested operations; CasADi may overflow the stack with deeper expressions."""


@final
@dataclass(frozen=True, eq=False)
class Instructions:
    """Expressions as numbered scalars: symbols, then constants, then results of operations.

    Attributes:
        labels: name of each symbol.
        names: unique name of each symbol (`symfric.foundation.identity`).
        constants: values of the constants, shape (c,).
        operations: names of the operations that occur.
        code: (operation, first operand, second operand) of each operation, shape (k, 3); a unary
            operation repeats its operand.
        shapes: rows and columns of each expression, shape (e, 2).
        entries: (expression, row, column, number) of each structural nonzero, by expression,
            column and row, shape (nnz, 4).
    """

    labels: tuple[str, ...]
    names: tuple[str, ...]
    constants: NDArray[np.float64]
    operations: tuple[str, ...]
    code: NDArray[np.int64]
    shapes: NDArray[np.int64]
    entries: NDArray[np.int64]

    @classmethod
    def of(cls, expressions: Sequence[ca.SX]) -> "Instructions":
        """Return the instructions of some expressions; common subexpressions occur once.

        Raises:
            ValueError: an operation is not in `OPERATIONS`, such as a function call.
        """
        atoms = identity.named(expressions)
        columns = [ca.vec(e.nz[:]) for e in expressions if e.nnz()]
        symbols: Any = ca.vertcat(ca.SX(0, 1), *(atom.symbol for atom in atoms))
        f = ca.Function("f", [symbols], [ca.vertcat(ca.SX(0, 1), *columns)])
        constants, code = list[float](), list[tuple[int, int, int]]()

        def numbered(k: int, operands: list[int]) -> int:
            op = f.instruction_id(k)
            if op == ca.OP_INPUT:
                return f.instruction_input(k)[1]
            if op == ca.OP_CONST:  # provisional numbers -1, -2, ...
                constants.append(f.instruction_constant(k))
                return -len(constants)
            if op not in NAMES:
                what = "a call of a Function that does not expand to SX, such as an interpolant"
                what = what if op == ca.OP_CALL else f"CasADi's operation {op}"
                raise ValueError(f"expected elementary operations, got {what}")
            code.append((op, operands[0], operands[-1]))
            return len(atoms) + len(code) - 1

        (results,) = walk(f, numbered)
        used = sorted({op for op, _, _ in code})
        rows = np.array(code, dtype=np.int64).reshape(-1, 3)
        numbers = np.array(results, dtype=np.int64)
        for operands in (rows[:, 1], rows[:, 2], numbers):
            operands[operands >= len(atoms)] += len(constants)
            operands[operands < 0] = len(atoms) - 1 - operands[operands < 0]
        rows[:, 0] = np.searchsorted(used, rows[:, 0])
        places = [
            (k, *place)
            for k, e in enumerate(expressions)
            for place in zip(*e.sparsity().get_triplet(), strict=True)
        ]
        return cls(
            tuple(atom.symbol.name() for atom in atoms),
            tuple(atom.name for atom in atoms),
            np.array(constants),
            tuple(NAMES[op] for op in used),
            rows,
            np.array([e.shape for e in expressions], dtype=np.int64).reshape(-1, 2),
            np.column_stack([np.array(places, dtype=np.int64).reshape(-1, 3), numbers]),
        )

    def expressions(self, trusted: bool = False) -> list[ca.SX]:
        """Return the expressions, with the symbols of this process that have the unique names.

        Raises:
            ValueError: the instructions are invalid; not checked if `trusted`.
        """
        if not trusted:
            self.check()
        atoms = identity.atoms_of(self.labels, self.names)
        nodes: list[Any] = [*(a.symbol for a in atoms), *map(ca.SX, self.constants.tolist())]
        code = [CODES[name] for name in self.operations]
        operands = [1 if name in UNARY else 2 for name in self.operations]
        for k, a, b in self.code.tolist():
            nodes.append(applied(code[k], (nodes[a], nodes[b])[: operands[k]]))
        ends = np.searchsorted(self.entries[:, 0], np.arange(len(self.shapes) + 1))
        found: list[ca.SX] = []
        shapes = self.shapes.tolist()
        for (rows, columns), begin, end in zip(shapes, ends[:-1], ends[1:], strict=True):
            row, column, number = self.entries[begin:end, 1:].T.tolist()
            nonzeros = ca.vertcat(ca.SX(0, 1), *(nodes[k] for k in number))
            found.append(ca.SX(ca.Sparsity.triplet(rows, columns, row, column), nonzeros))
        identity.keep(found, atoms)
        return found

    def check(self) -> None:
        """Check operations, entries, and operands, which must precede their operation.

        Raises:
            ValueError: something is invalid, or more than `DEEPEST` operations are nested.
        """
        symbols, count = len(self.labels), len(self.labels) + len(self.constants)
        places, shapes = self.entries[:, [0, 2, 1]], self.shapes
        of, row, column, number = self.entries.T
        sound = (
            symbols == len(self.names) == len(set(self.names))
            and set(self.operations) <= CODES.keys()
            and self.code.shape[1:] == (3,)
            and _within(self.code[:, 0], len(self.operations))
            and _within(self.code[:, 1:].T, count + np.arange(len(self.code)))
            and shapes.shape[1:] == (2,)
            and _within(shapes, MOST_ENTRIES + 1)
            and _within(np.prod(shapes, axis=1), MOST_ENTRIES + 1)
            and _within(of, len(shapes))
            and _within(row, shapes[of, 0])
            and _within(column, shapes[of, 1])
            and _within(number, count + len(self.code))
            and np.array_equal(np.unique(places, axis=0), places)
        )
        if not sound:
            raise ValueError("expected instructions that symfric wrote, got others")
        depth = [0] * count
        for a, b in self.code[:, 1:].tolist():
            depth.append(1 + max(depth[a], depth[b]))
        if max(depth, default=0) > DEEPEST:
            raise ValueError(f"expected at most {DEEPEST} nested operations, got {max(depth)}")


def _within(numbers: NDArray[np.int64], end: NDArray[np.int64] | int) -> bool:
    """Return True if all numbers lie in [0, end)."""
    return bool(((numbers >= 0) & (numbers < end)).all())
