"""Running a block on the same inputs twice: as generated C, and in CasADi's virtual machine.

Both give one row a step: the states after it, the outputs, and the states that each reset would
make of the inputs.
"""

import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.writing.layout import members, prefix
from symfric.emitter.c99 import Real
from symfric.foundation.compiler import CompileError

Array = NDArray[np.float64]

PROGRAM = """#include "{name}.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{{
    long steps = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
{declarations}

    for (; steps > 0; steps--) {{
{body}
    }}
    return 0;
}}
"""


def program(block: Block, real: Real) -> str:
    """A C program that reads inputs from standard input and writes a row a step, all binary."""
    name = prefix(block, real)
    types = {group: f"{name}_{group}_t" for group in members(block)}
    own = {group: f"&{group}" for group in types} | {"param": f"&{name}_default"}
    if block.is_function:
        scalars = [f"in[{i}]" for i in range(len(block.inputs))]
        arguments = ", ".join(scalars + [own[group] for group in types])
        types |= {"out": real.name}
        calls = [f"out = {name}({arguments});", _write("out")]
    else:
        step = ", ".join(own[group] for group in GROUPS if group in types)
        calls = [f"{name}_step({step});", *(_write(g) for g in ("state", "out") if g in types)]
    for reset in block.resets:
        rest = [own[group] for group in ("param", "in") if group in types]
        calls += [f"{name}_{reset}({', '.join(['&other', *rest])});", _write("other")]
    if block.inputs:
        calls.insert(0, "if (fread(&in, sizeof in, 1, stdin) != 1) { return 1; }")
    if block.resets:
        types["other"] = types["state"]
    declarations = [f"{kind} {group};" for group, kind in types.items() if group != "param"]
    if block.is_function and block.inputs:
        declarations.append(f"{real.name} in[{len(block.inputs)}];")
    if block.states:
        declarations.append(f"{name}_init(&state);")
    return PROGRAM.format(
        name=name,
        declarations="\n".join(f"    {line}" for line in declarations),
        body="\n".join(f"        {line}" for line in calls),
    )


def _write(what: str) -> str:
    return f"fwrite(&{what}, sizeof {what}, 1, stdout);"


def run_c(block: Block, real: Real, executable: Path, inputs: Array) -> Array:
    """Rows (steps, columns) that the compiled `program` makes of `inputs` (steps, inputs).

    Raises:
        CompileError: the program does not run here, or ends too early.
    """
    kind = np.float32 if real.size == 4 else np.float64
    try:
        done = subprocess.run(
            [str(executable), str(len(inputs))],
            input=inputs.astype(kind).tobytes(),
            capture_output=True,
            check=False,
        )
    except OSError as error:
        raise CompileError(f"the program does not run on this machine: {error.strerror}") from None
    columns = len(signals(block))
    if done.returncode != 0 or len(done.stdout) != len(inputs) * columns * real.size:
        raise CompileError(f"the program ended too early, with status {done.returncode}")
    return np.frombuffer(done.stdout, kind).reshape(len(inputs), columns).astype(float)


def run_vm(block: Block, real: Real, inputs: Array, states: Array | None = None) -> Array:
    """The same rows from CasADi in double, with inputs and parameters rounded to `real`.

    With `states`, shape (steps, states), every step but the first begins from the row before.
    """
    kind = np.float32 if real.size == 4 else np.float64
    inputs = inputs.astype(kind).astype(float)
    p = np.array([v.start for v in block.parameters], dtype=kind).astype(float)
    x = np.array([v.start for v in block.states], dtype=kind).astype(float)
    u = np.zeros(len(block.inputs))
    following, y = np.zeros_like(x), np.zeros(len(block.outputs))
    step = _bound(block.step, (x, p, u), (following, y))
    others = [np.zeros_like(x) for _ in block.resets]
    calls = [
        _bound(block.reset(reset), (x, p, u), (other,))
        for reset, other in zip(block.resets, others, strict=True)
    ]
    rows = np.zeros((len(inputs), len(signals(block))))
    for k, (row, now) in enumerate(zip(rows, inputs, strict=True)):
        u[:] = now
        if states is not None and k:
            x[:] = states[k - 1]
        step()
        for call in calls:
            call()
        row[:] = np.concatenate([following, y, *others])
        x[:] = following
    return rows


def _bound(
    function: ca.Function, arguments: Sequence[Array], results: Sequence[Array]
) -> Callable[[], None]:
    """A call without copies: CasADi reads and writes the arrays themselves."""
    buffer: Any
    buffer, evaluate = function.buffer()
    for i, array in enumerate(arguments):
        if array.size:
            buffer.set_arg(i, array.data)
    for i, array in enumerate(results):
        if array.size:
            buffer.set_res(i, array.data)

    def call(alive: object = (function, buffer)) -> None:
        evaluate()

    return call


def signals(block: Block) -> list[str]:
    """Names of the columns."""
    states = [v.name for v in block.states]
    return states + list(block.outputs) + [f"{r}.{name}" for r in block.resets for name in states]
