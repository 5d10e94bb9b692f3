"""C functions of a block and their source file."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.guards import (
    STEP_SIZE,
    finite_outputs,
    fit_parameters,
    found_states,
    helpers,
    mended,
)
from symfric.codegen.layout import (
    WIDTH,
    banner,
    block_comment,
    comment,
    folded,
    indexed,
    members,
    places,
    prefix,
)
from symfric.emitter.arrays import emit_rolled
from symfric.emitter.c99 import TRANSCENDENTAL, Real, macro, representable
from symfric.foundation.graph import graph
from symfric.foundation.parameters import Variable


@dataclass(frozen=True)
class Routine:
    """C function.

    Attributes:
        result: return type.
        calls: function of math.h (double's name) -> number of calls.
        operations: number of operations, calls included.
    """

    name: str
    result: str
    arguments: tuple[str, ...]
    doc: str
    statements: tuple[str, ...]
    calls: Counter[str] = field(default_factory=Counter[str])
    operations: int = 0

    @property
    def head(self) -> str:
        """Prototype without its semicolon."""
        start = f"{self.result} {self.name}("
        one_line = f"{start}{', '.join(self.arguments)})"
        return (
            one_line if len(one_line) <= WIDTH else one_line.replace(", ", ",\n" + " " * len(start))
        )


def routines(block: Block, real: Real, guards: bool = True) -> tuple[Routine, ...]:
    """Return the C functions of a block: `_init`, `_reset`, its resets and `_step`, or a scalar
    one.

    With `guards` they return the status of `symfric.codegen.guards`, and a function of scalars adds
    its bits to an argument; without they return nothing and check nothing.

    Raises:
        ValueError: an operation without counterpart in C99, or a constant outside the type.
    """
    name = prefix(block, real)
    if block.is_function:
        (output,) = block.outputs.values()
        (shown,) = block.outputs
        doc = f"{shown} [{output.unit}]: {output.doc}".rstrip(": ") + "."
        doc += " Sets bits of *status and clears none: start with 0." if guards else ""
        ends = f"const {real.name} {shown} = {{}};" if guards else "return {};"
        return (_routine(block, real, name, doc, block.step, [[], [ends]], guards),)
    store = [f"state->{place} = {{}};" for place in places(block, "state")]
    show = [f"out->{place} = {{}};" for place in places(block, "out")]
    found = list(_starts(block, real)) if block.states else []
    found += [
        _routine(block, real, f"{name}_{reset}", doc, block.reset(reset), [store], guards)
        for reset, (_, doc) in block.resets.items()
    ]
    doc = "One step: outputs and next state" if block.states else "All outputs"
    doc += "; returns the status." if guards else "."
    found.append(_routine(block, real, f"{name}_step", doc, block.step, [store, show], guards))
    return tuple(found)


def _starts(block: Block, real: Real) -> tuple[Routine, Routine]:
    """Return `_init` with given start values, `_reset` to those of the model."""
    name = prefix(block, real)
    own, given = f"{name}_state_t *state", f"const {name}_state_t *start"
    init = "Sets an initial state, such as that of the model; call it before the first step."
    reset = "Sets the initial state of the model."
    return (
        Routine(f"{name}_init", "void", (own, given), init, ("*state = *start;",)),
        Routine(f"{name}_reset", "void", (own,), reset, (f"*state = {name}_start;",)),
    )


def _routine(
    block: Block,
    real: Real,
    name: str,
    doc: str,
    function: ca.Function,
    targets: Sequence[Sequence[str]],
    guards: bool,
) -> Routine:
    groups = (block.states, block.parameters, block.inputs)
    source = representable(graph(function), real)
    scalars, steps = block.is_function, len(targets) > 1
    later = {
        (i, j): f"{GROUPS[i]}->{place}"
        for i, group in enumerate(groups)
        for j, place in enumerate(places(block, GROUPS[i]))
        if not (scalars or guards) or i < 2
        if not (guards and i == 1 and group[j].name == STEP_SIZE)
    }
    names = [[v.name for v in group] for group in groups]
    arrays = indexed(block, GROUPS[::3][: len(targets)], guards)
    code = emit_rolled(source, names, targets, real, arrays, later)
    used = sorted(code.used)
    present = members(block)
    arguments = [
        f"{'const ' if group in ('param', 'in') else ''}{prefix(block, real)}_{group}_t *{group}"
        for group in GROUPS
        if group in present and (group != "out" or steps)
    ]
    seen = {GROUPS[i] for i, _ in used} | {"state"}
    idle = [group for group in GROUPS[:3] if group in present and group not in seen]
    if scalars:
        arguments = [f"{real.name} {v.name}" for v in block.inputs] + arguments
        idle += [v.name for j, v in enumerate(block.inputs) if (2, j) not in used]
    voids = [f"(void){what};" for what in idle]
    if not guards:
        statements = (*voids, *code.lines)
        result = real.name if scalars else "void"
    elif scalars:
        arguments.append("unsigned int *status")
        statements = (*voids, *_guarded(block, real, used, code.lines, steps, "status"))
        result = real.name
    else:
        body = _guarded(block, real, used, code.lines, steps, "&status")
        statements = ("unsigned int status = 0u;", *voids, *body, "return status;")
        result = "unsigned int"
    return Routine(name, result, tuple(arguments), doc, statements, code.calls, code.operations)


def _loads(block: Block, real: Real, used: Sequence[tuple[int, int]]) -> list[str]:
    """Return locals with the names of the variables; a function of scalars has them as
    arguments.
    """
    groups = (block.states, block.parameters, block.inputs)
    return [
        f"const {real.name} {groups[i][j].name} = {GROUPS[i]}->{places(block, GROUPS[i])[j]};"
        for i, j in used
        if not (block.is_function and GROUPS[i] == "in")
    ]


def _guarded(
    block: Block,
    real: Real,
    used: Sequence[tuple[int, int]],
    lines: Sequence[str],
    steps: bool,
    status: str,
) -> list[str]:
    """Return `lines` between guards: inputs, step size, parameters, states, then outputs.

    The step size is read before invalid parameters are replaced by the defaults.
    """
    steered = [(1, j) for j, v in enumerate(block.parameters) if v.name == STEP_SIZE]
    sizes = [entry for entry in used if entry in steered]
    inputs = [entry for entry in used if entry[0] == 2]
    others = [entry for entry in used if entry not in (*sizes, *inputs)]
    found: list[str] = []
    for i, j in (*inputs, *sizes):
        variable = (block.parameters, block.inputs)[i - 1][j]
        found += [load.removeprefix("const ") for load in _loads(block, real, [(i, j)])]
        found += mended(block, real, variable, GROUPS[i], status)
    if any(i == 1 for i, _ in others):
        found += fit_parameters(block, real, status)
    if steps:
        found += found_states(block, real, status)
    ends = finite_outputs(block, real, status) if steps else []
    return [*found, *lines, *ends]


ALIGNED = 30
"""Width of values with aligned comments."""


def source(block: Block, real: Real, guards: bool = True) -> str:
    """Return the text of the source file; raises as `routines`."""
    name = prefix(block, real)
    functions = routines(block, real, guards)
    called = sorted({call for r in functions for call in r.calls} & set(TRANSCENDENTAL.values()))
    macros = "".join(
        f"#ifndef {macro(call, real)}\n#define {macro(call, real)} {call}{real.letter}\n#endif\n"
        for call in called
    )
    if macros:
        macros = "/* Define these to use your own, faster functions. */\n" + macros + "\n"
    bodies = "\n".join(
        f"{r.head}\n{{\n" + "".join(folded(line, "    ") + "\n" for line in r.statements) + "}\n"
        for r in functions
    )
    if guards:
        bodies = helpers(block, real, bodies) + bodies
    booleans = "#include <stdbool.h>\n" if "bool " in bodies else ""
    if guards:
        booleans += "#include <stdint.h>\n#include <string.h>\n"
    return f"""{block_comment(banner(block, f"{name}.c"))}
#include "{name}.h"

#include <math.h>
{booleans}
{macros}{_defaults(block, real)}{bodies}"""


def _defaults(block: Block, real: Real) -> str:
    """Return the constants: default parameters and start values."""
    name = prefix(block, real)
    return _constant(f"{name}_param_t {name}_default", "param", block.parameters, block, real) + (
        _constant(f"{name}_state_t {name}_start", "state", block.states, block, real)
    )


def _constant(
    declared: str, group: str, variables: Sequence[Variable], block: Block, real: Real
) -> str:
    """Return a constant struct with the start value of every variable; arrays in their own
    braces.
    """
    if not variables:
        return ""
    rows: list[tuple[str, str]] = []
    for member in members(block)[group]:
        values = [v.start for v in variables[member.first : member.first + member.count]]
        text = ", ".join(real.literal(float(value)) for value in values)
        rows.append(
            (f"{{{text}}}," if member.size else f"{text},", f"{member.name} [{member.unit}]")
        )
    width = max((len(text) for text, _ in rows if len(text) <= ALIGNED), default=0)
    lines = "".join(
        folded(f"{text:<{width}} /* {comment(name)} */", "    ") + "\n" for text, name in rows
    )
    return f"const {declared} = {{\n{lines}}};\n\n"
