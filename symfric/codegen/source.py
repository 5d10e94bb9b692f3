"""Header and source file of a block in one floating point type.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types live in one program. Nothing is allocated and no data but the constant defaults exist,
so one block serves any number of joints.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from textwrap import wrap

import casadi as ca

from symfric.codegen.block import GROUPS, Block
from symfric.codegen.c99 import TRANSCENDENTAL, Real, macro
from symfric.codegen.emitter import emit
from symfric.foundation.graph import graph

WIDTH = 100


@dataclass(frozen=True)
class Routine:
    """One C function.

    Attributes:
        result: type of what it returns.
        calls: function of math.h (double's name) -> number of calls.
        operations: number of operations, calls included.
    """

    name: str
    result: str
    arguments: tuple[str, ...]
    doc: str
    statements: tuple[str, ...]
    calls: Counter[str]
    operations: int

    @property
    def head(self) -> str:
        """The prototype without its semicolon."""
        start = f"{self.result} {self.name}("
        one_line = f"{start}{', '.join(self.arguments)})"
        return (
            one_line if len(one_line) <= WIDTH else one_line.replace(", ", ",\n" + " " * len(start))
        )


def prefix(block: Block, real: Real) -> str:
    """What all names of a block in one type begin with; also the name of its files."""
    return f"{block.name}_{real.suffix}"


def members(block: Block) -> dict[str, list[tuple[str, str, str]]]:
    """Struct -> (name, unit, text) of its members; empty structs are left out."""
    variables = {"state": block.states, "param": block.parameters, "in": block.inputs}
    found = {group: [(v.name, v.unit, v.doc) for v in of] for group, of in variables.items()}
    found["out"] = [(name, output.unit, output.doc) for name, output in block.outputs.items()]
    if block.is_function:
        del found["in"], found["out"]
    return {group: rows for group, rows in found.items() if rows}


def routines(block: Block, real: Real) -> tuple[Routine, ...]:
    """The C functions of a block: `_init`, its resets and `_step`, or one function of scalars.

    Raises:
        ValueError: an operation without counterpart in C99, or a constant outside the type.
    """
    name = prefix(block, real)
    if block.is_function:
        (output,) = block.outputs.values()
        (shown,) = block.outputs
        doc = f"{shown} [{output.unit}]: {output.doc}".rstrip(": ") + "."
        return (_routine(block, real, name, doc, block.step, [[], ["return {};"]]),)
    store = [f"state->{v.name} = {{}};" for v in block.states]
    show = [f"out->{output} = {{}};" for output in block.outputs]
    found = [
        _routine(block, real, f"{name}_{reset}", doc, block.reset(reset), [store])
        for reset, (_, doc) in block.resets.items()
    ]
    if block.states:
        found.insert(0, _init(block, real))
    doc = "One step: outputs and next state." if block.states else "All outputs."
    found.append(_routine(block, real, f"{name}_step", doc, block.step, [store, show]))
    return tuple(found)


def _init(block: Block, real: Real) -> Routine:
    name = prefix(block, real)
    values = tuple(f"state->{v.name} = {real.literal(float(v.start))};" for v in block.states)
    doc = "Initial state; call it before the first step."
    return Routine(f"{name}_init", "void", (f"{name}_state_t *state",), doc, values, Counter(), 0)


def _routine(
    block: Block,
    real: Real,
    name: str,
    doc: str,
    function: ca.Function,
    targets: Sequence[Sequence[str]],
) -> Routine:
    groups = (block.states, block.parameters, block.inputs)
    source = graph(function)
    code = emit(source, [[v.name for v in group] for group in groups], targets, real)
    scalars = block.is_function
    used = sorted(node.entry for node in source.nodes if node.op == ca.OP_INPUT)
    loads = [
        f"const {real.name} {groups[i][j].name} = {GROUPS[i]}->{groups[i][j].name};"
        for i, j in used
        if not (scalars and GROUPS[i] == "in")
    ]
    present = members(block)
    arguments = [
        f"{'const ' if group in ('param', 'in') else ''}{prefix(block, real)}_{group}_t *{group}"
        for group in GROUPS
        if group in present and (group != "out" or len(targets) > 1)
    ]
    idle = [g for i, g in enumerate(GROUPS[:3]) if g in present and i not in {u[0] for u in used}]
    if scalars:
        arguments = [f"{real.name} {v.name}" for v in block.inputs] + arguments
        idle += [v.name for j, v in enumerate(block.inputs) if (2, j) not in used]
    voids = [f"(void){what};" for what in idle if what != "state"]
    result = real.name if scalars else "void"
    statements = (*voids, *loads, *code.lines)
    return Routine(name, result, tuple(arguments), doc, statements, code.calls, code.operations)


def header(block: Block, real: Real) -> str:
    """Text of the header file; raises as `routines`."""
    name = prefix(block, real)
    guard = f"{name.upper()}_H"
    structs = "".join(
        _struct(f"{name}_{group}_t", rows, real) for group, rows in members(block).items()
    )
    default = f"extern const {name}_param_t {name}_default;\n\n" if block.parameters else ""
    prototypes = "\n".join(f"/* {r.doc} */\n{r.head};\n" for r in routines(block, real))
    return f"""{_block_comment(_banner(block, f"{name}.h") + _about(block))}
#ifndef {guard}
#define {guard}

#ifdef __cplusplus
extern "C" {{
#endif

{structs}{default}{prototypes}
#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


def source(block: Block, real: Real) -> str:
    """Text of the source file; raises as `routines`."""
    name = prefix(block, real)
    functions = routines(block, real)
    called = sorted({call for r in functions for call in r.calls} & set(TRANSCENDENTAL.values()))
    macros = "".join(
        f"#ifndef {macro(call, real)}\n#define {macro(call, real)} {call}{real.letter}\n#endif\n"
        for call in called
    )
    if macros:
        macros = "/* Define these to put your own, faster functions in. */\n" + macros + "\n"
    bodies = "\n".join(
        f"{r.head}\n{{\n" + "".join(folded(line, "    ") + "\n" for line in r.statements) + "}\n"
        for r in functions
    )
    booleans = "#include <stdbool.h>\n" if "const bool " in bodies else ""
    return f"""{_block_comment(_banner(block, f"{name}.c"))}
#include "{name}.h"

#include <math.h>
{booleans}
{macros}{_defaults(block, real)}{bodies}"""


def _defaults(block: Block, real: Real) -> str:
    if not block.parameters:
        return ""
    name = prefix(block, real)
    values = [f"{real.literal(float(p.start))}," for p in block.parameters]
    width = max(map(len, values))
    rows = "".join(
        f"    {value:<{width}} /* {p.name} [{p.unit}] */\n"
        for value, p in zip(values, block.parameters, strict=True)
    )
    return f"const {name}_param_t {name}_default = {{\n{rows}}};\n\n"


def _struct(name: str, rows: Sequence[tuple[str, str, str]], real: Real) -> str:
    width = max(len(member) for member, _, _ in rows) + 1
    lines = "".join(
        f"    {real.name} {member + ';':<{width}} /* {_comment(f'{text} [{unit}]'.strip())} */\n"
        for member, unit, text in rows
    )
    return f"typedef struct {{\n{lines}}} {name};\n\n"


def _banner(block: Block, file: str) -> list[str]:
    return [
        f"{file}: C99 made by symfric {version('symfric')} with CasADi {version('casadi')}, "
        f"model {block.fingerprint}.",
        "This generated code is yours. SPDX-License-Identifier: MIT-0",
    ]


def _about(block: Block) -> list[str]:
    constants = ", ".join(f"{name} = {value:g}" for name, value in block.constants.items())
    last = ["", *wrap(f"Constants: {constants}.", WIDTH - 3)] if constants else []
    return ["", *block.doc.splitlines(), *last]


def _block_comment(lines: Sequence[str]) -> str:
    return "/* " + "\n".join(f" * {_comment(line)}".rstrip() for line in lines)[3:] + "\n */"


def _comment(text: str) -> str:
    """Text that cannot end the comment it stands in."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def folded(line: str, margin: str) -> str:
    """A long line broken at blanks."""
    return "\n".join(
        wrap(
            line,
            WIDTH,
            initial_indent=margin,
            subsequent_indent=margin + "    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    )
