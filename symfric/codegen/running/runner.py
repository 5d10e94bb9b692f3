"""Running a block on the same inputs twice: as generated C, and in CasADi's virtual machine.

Both give one row a step: the states after it, the outputs, the states that each reset would make of
the inputs, and with guards the status.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.running.guarded import Model
from symfric.codegen.writing.guards import Status
from symfric.codegen.writing.layout import members, prefix
from symfric.emitter.c99 import Real
from symfric.foundation.compiler import CompileError
from symfric.foundation.programs import PATIENCE, ProgramError, finished

Array = NDArray[np.float64]

PER_STEP = 1e-3
"""Seconds that a step may take."""

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


def program(block: Block, real: Real, guards: bool = True) -> str:
    """A C program that reads inputs from standard input and writes a row a step, all binary.

    With a second argument on its command line it reads the parameters before the inputs.
    """
    name = prefix(block, real)
    types = {group: f"{name}_{group}_t" for group in members(block)}
    own = {group: f"&{group}" for group in types} | {"param": "param"}
    if block.is_function:
        scalars = [f"in[{i}]" for i in range(len(block.inputs))]
        rest = [own[group] for group in types] + ["&status"] * guards
        types |= {"out": real.name}
        calls = ["status = 0u;"] * guards
        calls += [f"out = {name}({', '.join(scalars + rest)});", _write("out")]
    else:
        step = ", ".join(own[group] for group in GROUPS if group in types)
        calls = [f"{'status = ' * guards}{name}_step({step});"]
        calls += [_write(g) for g in ("state", "out") if g in types]
    for reset in block.resets:
        rest = [own[group] for group in ("param", "in") if group in types]
        calls += [f"{name}_{reset}({', '.join(['&other', *rest])});", _write("other")]
    declarations = [f"{kind} {group};" for group, kind in types.items() if group != "param"]
    if block.inputs:
        calls.insert(0, _read("in"))
    if block.parameters:
        calls.insert(0, f"if (argc > 2) {{ {_read('given')} }}")
        declarations.append(f"{types['param']} given = {name}_default;")
        declarations.append(f"const {types['param']} *param = argc > 2 ? &given : &{name}_default;")
    if block.resets:
        declarations.append(f"{types['state']} other;")
    if guards:
        declarations += ["unsigned int status;", f"{real.name} said;"]
        calls += [f"said = ({real.name})status;", _write("said")]
    if block.is_function and block.inputs:
        declarations.append(f"{real.name} in[{len(block.inputs)}];")
    if block.states:
        declarations.append(f"{name}_init(&state, &{name}_start);")
    return PROGRAM.format(
        name=name,
        declarations="\n".join(f"    {line}" for line in declarations),
        body="\n".join(f"        {line}" for line in calls),
    )


def _write(what: str) -> str:
    return f"fwrite(&{what}, sizeof {what}, 1, stdout);"


def _read(what: str) -> str:
    return f"if (fread(&{what}, sizeof {what}, 1, stdin) != 1) {{ return 1; }}"


def run_c(
    block: Block,
    real: Real,
    executable: Path,
    inputs: Array,
    parameters: Array | None = None,
    *,
    guards: bool = True,
) -> Array:
    """Rows (steps, columns) that the compiled `program` makes of `inputs` (steps, inputs).

    Args:
        parameters: of every step, shape (steps, parameters); the defaults of the C without them.

    Raises:
        CompileError: the program does not run here, or ends too early.
    """
    kind = np.float32 if real.size == 4 else np.float64
    given = inputs if parameters is None else np.column_stack([parameters, inputs])
    command = [str(executable), str(len(inputs)), *(["own"] if parameters is not None else [])]
    with np.errstate(over="ignore", under="ignore"):
        numbers = given.astype(kind).tobytes()
    try:
        limit = PATIENCE + PER_STEP * len(inputs)
        done = finished(command, numbers, limit=limit, name="the program that was compiled")
    except ProgramError as error:
        raise CompileError(str(error)) from None
    columns = len(signals(block, guards=guards))
    if done.status != 0 or len(done.output) != len(inputs) * columns * real.size:
        raise CompileError(f"the program ended too early, with status {done.status}")
    return np.frombuffer(done.output, kind).reshape(len(inputs), columns).astype(float)


def run_vm(
    block: Block,
    real: Real,
    inputs: Array,
    states: Array | None = None,
    parameters: Array | None = None,
    *,
    guards: bool = True,
) -> Array:
    """The same rows from CasADi in double, with inputs and parameters rounded to `real`.

    The guards are those of `symfric.codegen.writing.guards.Model`.

    Args:
        states: shape (steps, states): every step but the first begins from the row before.
        parameters: of every step, shape (steps, parameters); the defaults without them.
    """
    model = Model(block, real)
    inputs, said = model.typed(inputs), np.zeros(len(inputs), np.int64)
    if guards:
        inputs, said = model.inputs(inputs)
    p, x, u = model.default.copy(), model.start.copy(), np.zeros(len(block.inputs))
    following, y = np.zeros_like(x), np.zeros(len(block.outputs))
    step = bound(block.step, (x, p, u), (following, y))
    others = [np.zeros_like(x) for _ in block.resets]
    calls = [
        bound(block.reset(reset), (x, p, u), (other,))
        for reset, other in zip(block.resets, others, strict=True)
    ]
    rows = np.zeros((len(inputs), len(signals(block, guards=guards))))
    for k, (row, now) in enumerate(zip(rows, inputs, strict=True)):
        u[:] = now
        if states is not None and k:
            x[:] = states[k - 1]
        if parameters is not None:
            p[:] = model.typed(parameters[k])
            if guards:
                p[:], bits = model.parameters(p)
                said[k] |= bits
        if guards and model.lost(x):
            x[:] = model.start
            said[k] |= Status.STATE
        step()
        for call in calls:
            call()
        if guards and not np.isfinite(y).all():
            following[:], y[:] = model.start, 0.0
            said[k] |= Status.OUTPUT
        row[:] = np.concatenate([following, y, *others, said[k : k + 1] if guards else ()])
        x[:] = following
    return rows


def bound(
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


def signals(block: Block, *, guards: bool = True) -> list[str]:
    """Names of the columns."""
    states = [v.name for v in block.states]
    later = [f"{r}.{name}" for r in block.resets for name in states]
    return states + list(block.outputs) + later + ["status"] * guards
