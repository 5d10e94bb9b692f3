"""Functions of columns as C on arrays, by the own emitter: for FMUs and graphics processors.

What it writes needs nothing but `math.h` and `stdbool.h` (of C; C++ and CUDA have both): no work
arrays, no integers of CasADi's, no calls between functions. Double precision has CasADi's bits.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import final

import casadi as ca

from symfric.emitter.c99 import DOUBLE, TRANSCENDENTAL, Real, macro, representable
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph


@final
@dataclass(frozen=True)
class Written:
    """A C function.

    Attributes:
        head: without a semicolon.
        body: statements, a line each.
        calls: functions of `math.h` that it reaches through macros (`macros`), by double's name.
        operations: how many, calls included.
    """

    head: str
    body: tuple[str, ...]
    calls: frozenset[str]
    operations: int

    @property
    def text(self) -> str:
        """The whole function."""
        return f"{self.head}\n{{\n" + "".join(f"    {line}\n" for line in self.body) + "}\n"


def in_c(
    function: ca.Function,
    name: str,
    arguments: Sequence[str] = (),
    results: Sequence[str] = (),
    real: Real = DOUBLE,
    head: str = "static ",
) -> Written:
    """`head` void `name`(const real *S, ..., real *next, ...) of a Function.

    Args:
        function: of columns, SX or MX (written out, then); sparse results are filled with zeros.
        name: of the C function.
        arguments: C names of the arguments, the Function's own by default.
        results: C names of the results likewise; with an empty name one is left out, and what only
            that takes. Results may not overlap arguments.
        real: floating point type.
        head: what stands before `void`.

    Raises:
        ValueError: operations that C does not have.
    """
    arguments = arguments or function.name_in()
    results = results or function.name_out()
    kept = [k for k, result in enumerate(results) if result]
    source = _dense(function, kept)
    whole = representable(graph(source), real)
    places = [[f"{x}[{i}]" for i in range(source.numel_in(k))] for k, x in enumerate(arguments)]
    targets = [
        [f"{results[k]}[{i}] = {{}};" for i in range(source.numel_out(j))]
        for j, k in enumerate(kept)
    ]
    code = emit(whole, places, targets, real)
    used = {argument for argument, _ in code.used}
    idle = [f"(void){x};" for k, x in enumerate(arguments) if k not in used]
    idle += [f"(void){results[k]};" for j, k in enumerate(kept) if not source.numel_out(j)]
    handed = [f"const {real.name} *{x}" for x in arguments]
    handed += [f"{real.name} *{results[k]}" for k in kept]
    return Written(
        f"{head}void {name}({', '.join(handed)})",
        (*idle, *code.lines),
        frozenset(code.calls) & frozenset(TRANSCENDENTAL.values()),
        code.operations,
    )


def macros(written: Iterable[Written], real: Real = DOUBLE) -> str:
    """Definitions of the macros that these functions call, such as `#define SF_EXP exp`."""
    calls = sorted({call for one in written for call in one.calls})
    return "".join(f"#define {macro(call, real)} {call}{real.letter}\n" for call in calls)


def _dense(function: ca.Function, kept: Sequence[int]) -> ca.Function:
    """The results `kept` of a Function, dense and written out."""
    function = function if function.is_a("SXFunction") else function.expand()
    symbols = [ca.SX.sym(name, *function.size_in(k)) for k, name in enumerate(function.name_in())]
    values = function.call(symbols, True, False)
    return ca.Function(function.name(), symbols, [ca.densify(values[k]) for k in kept])
