"""Loops in C: the bits of CasADi for regular, nearly regular and random graphs, and their form."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from symfric.emitter.arrays import Arrays, emit_rolled
from symfric.emitter.c99 import DOUBLE, Real
from symfric.emitter.emit import emit
from symfric.emitter.rolling import Array
from symfric.foundation.graph import graph

N, OUTER = 6, 3

LEAVES = ("x", "y", "k", "next x", "first x", "last k", "previous x", "u", "c", "same", "total")
"""What the element i may take: x_i, y_i, k_i, x_i+1, x_1, k_n, x_i-1, inputs, a constant each, the
same constant, a sum over all elements."""

OPERATIONS: dict[str, Callable[..., ca.SX]] = {
    "+": lambda a, b, c: a + b,
    "-": lambda a, b, c: a - b,
    "*": lambda a, b, c: a * b,
    "select": lambda a, b, c: ca.if_else(a < b, c, a),
    "nested": lambda a, b, c: ca.if_else(ca.logic_and(a < c, b <= c), b, ca.if_else(a < b, c, b)),
    "abs": lambda a, b, c: ca.fabs(a) - b,
    "sign": lambda a, b, c: ca.sign(a) * c,
    "either": lambda a, b, c: ca.logic_or(a < b, c < 0),
}


@dataclass(frozen=True)
class Step:
    """One operation of an element, on what was made before it."""

    operation: str
    operands: tuple[int, int, int]


@dataclass(frozen=True)
class Program:
    """What each element does, and the odd one, if any."""

    leaves: tuple[str, ...]
    steps: tuple[Step, ...]
    constants: tuple[float, ...]
    odd: int = -1
    change: tuple[int, Step] | None = None

    def element(self, i: int, given: dict[str, ca.SX], total: ca.SX) -> list[ca.SX]:
        x, y, k, u = (given[name] for name in "xyku")
        known = {
            "x": x[i], "y": y[i], "k": k[i], "next x": x[(i + 1) % N], "first x": x[0],
            "last k": k[N - 1], "previous x": x[i - 1], "u": u[0], "c": ca.SX(self.constants[i]),
            "same": ca.SX(0.75), "total": total,
        }  # fmt: skip
        made = [*(known[leaf] for leaf in self.leaves), u[1], x[i]]
        for number, step in enumerate(self.steps):
            if self.change is not None and (i, number) == (self.odd, self.change[0]):
                step = self.change[1]
            operands = (made[o % len(made)] for o in step.operands)
            made.append(ca.SX(OPERATIONS[step.operation](*operands)))
        return made

    def function(self) -> ca.Function:
        """(x, y, k, u) -> (x+, y+, out), all columns; x+ and y+ take the place of x and y."""
        sizes = {"x": N, "y": N, "k": N, "u": OUTER}
        given = {name: ca.SX.sym(name, size) for name, size in sizes.items()}
        total = ca.SX(0)
        for i in range(N):
            total = total + given["k"][i] * given["y"][i]
        made = [self.element(i, given, total) for i in range(N)]
        sums = [given["u"][2], made[0][-2]]
        for i in range(N):
            sums[0] = sums[0] + made[i][-1]
            sums[1] = sums[1] + made[i][-2] if i else sums[1]
        x = ca.vertcat(*(m[-1] for m in made))
        y = ca.vertcat(*(m[-3] for m in made))
        results = [ca.densify(r) for r in (x, y, ca.vertcat(*sums, total * made[2][-1]))]
        return ca.Function("f", list(given.values()), results)


def program(random: np.random.Generator, odd: bool) -> Program:
    def step() -> Step:
        operation = str(random.choice(list(OPERATIONS)))
        return Step(operation, tuple(int(o) for o in random.integers(0, 40, 3)))

    leaves = tuple(str(leaf) for leaf in random.choice(LEAVES, 5))
    steps = tuple(step() for _ in range(int(random.integers(4, 9))))
    made = Program(leaves, steps, tuple(random.choice([0.5, 1.0, 2.0, 3.0, -1.5], N)))
    if not odd:
        return made
    change = int(random.integers(len(steps))), step()
    return Program(leaves, steps, made.constants, int(random.integers(N)), change)


def written(function: ca.Function, real: Real = DOUBLE, arrays: bool = True) -> tuple[str, ...]:
    """Lines of the body of f(x, y, k, u, out)."""
    names = [[f"{name}_{j}" for j in range(function.size1_in(i))] for i, name in enumerate("xyku")]
    loads = {(i, j): f"{name}[{j}]" for i, name in enumerate("xyku") for j in range(len(names[i]))}
    targets = [
        [f"{name}[{j}] = {{}};" for j in range(function.size1_out(i))]
        for i, name in enumerate(("x", "y", "out"))
    ]
    source = graph(function)
    if not arrays:
        return emit(source, names, targets, real, loads=loads).lines
    read = tuple(Array(i, 0, len(names[i]), name) for i, name in enumerate("xyk"))
    indexed = Arrays(read, tuple(Array(i, 0, len(targets[i]), name) for i, name in enumerate("xy")))
    return emit_rolled(source, names, targets, real, indexed, loads).lines


HEAD = "void f{}(double *x, double *y, const double *k, const double *u, double *out)"


@pytest.fixture(scope="module")
def in_c(compiler, tmp_path_factory):
    """Many functions compiled at once: calls of them by their number."""

    def compiled(functions: list[ca.Function]) -> Callable[..., np.ndarray]:
        folder = tmp_path_factory.mktemp("rolled")
        bodies = [
            f"{HEAD.format(i)}\n{{\n" + "\n".join(written(f)) + "\n(void)k; (void)u; }\n"
            for i, f in enumerate(functions)
        ]
        macros = "#define SF_EXP exp\n#define SF_TANH tanh\n"
        (folder / "f.c").write_text(
            "#include <math.h>\n#include <stdbool.h>\n" + macros + "\n".join(bodies)
        )
        flags = ("-std=c99", "-O1", "-ffp-contract=off", "-shared", "-fPIC", "-Wall", "-Werror")
        compiler.run(*flags, str(folder / "f.c"), "-o", str(folder / "f.so"), "-lm")
        library = ctypes.CDLL(str(folder / "f.so"))

        def call(number: int, *arguments: np.ndarray) -> np.ndarray:
            columns = [np.array(a, float) for a in arguments]
            columns.append(np.zeros(functions[number].size1_out(2)))
            pointers = [c.ctypes.data_as(ctypes.c_void_p) for c in columns]
            getattr(library, f"f{number}")(*pointers)
            return np.concatenate([columns[0], columns[1], columns[4]])

        return call

    return compiled


def points(random: np.random.Generator, function: ca.Function, count: int):
    sizes = [function.size1_in(i) for i in range(4)]
    special = [0.0, -0.0, 1.0, -1.0, 0.5, np.inf, -np.inf, np.nan, 1e300, 5e-324]
    draws: list[Callable[[int], np.ndarray]] = [
        random.standard_normal,
        lambda n: random.integers(-2, 3, n).astype(float),
        lambda n: random.choice(special, n),
    ]
    for k in range(count):
        yield [draws[k % 3](n) for n in sizes]


def check(functions: list[ca.Function], in_c, random: np.random.Generator, count: int) -> None:
    call = in_c(functions)
    for number, function in enumerate(functions):
        for arguments in points(random, function, count):
            c = call(number, *arguments)
            vm = np.concatenate([np.ravel(r.full()) for r in function(*arguments)])
            assert np.array_equal(c, vm, equal_nan=True), number


def has_loops(lines: tuple[str, ...]) -> bool:
    return any(line.startswith("for (") for line in lines)


@pytest.mark.parametrize("odd", [False, True], ids=["regular", "one element is odd"])
def test_random_elements_have_the_bits_of_casadi(in_c, odd: bool) -> None:
    random = np.random.default_rng(7 + odd)
    functions = [program(random, odd).function() for _ in range(30)]
    rolled = sum(has_loops(written(f)) for f in functions)
    assert rolled > (20 if not odd else 10)
    check(functions, in_c, random, 18)
