"""CasADi functions as JavaScript, with the statements of the C."""

from pathlib import Path

import casadi as ca

from symfric.emitter.c99 import SCRIPT
from symfric.emitter.emit import INDENT, emit
from symfric.foundation.graph import graph

LIBRARY = Path(__file__).with_name("functions.js").read_text("utf-8")
"""Functions that the result of `script` may call."""


def script(function: ca.Function, name: str) -> str:
    """Return a JavaScript function with the operations of `function`, an SX Function.

    Its arguments are arrays in the order of `function`, and its result is one array with the rows
    of all results. Each operation is that of the C in double precision.
    Functions such as `exp` and `pow` are those of the browser and may differ in the last bits.

    Raises:
        ValueError: errors of `graph` and `emit`.
    """
    arguments = [f"a{k}" for k in range(function.n_in())]
    names = [
        [f"{argument}[{row}]" for row in range(function.numel_in(k))]
        for k, argument in enumerate(arguments)
    ]
    targets: list[list[str]] = []
    total = 0
    for k in range(function.n_out()):
        rows = range(total, total + function.numel_out(k))
        targets.append([f"result[{row}] = {{}};" for row in rows])
        total = rows.stop
    code = emit(graph(function), names, targets, SCRIPT)
    lines = [f"const result = new Array({total});", *code.lines, "return result;"]
    body = "\n".join(INDENT + line for line in lines)
    return f"function {name}({', '.join(arguments)}) {{\n{body}\n}}\n"
