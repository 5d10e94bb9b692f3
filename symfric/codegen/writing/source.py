"""The source file of a block."""

from collections.abc import Sequence

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.guards import helpers
from symfric.codegen.writing.layout import members, prefix
from symfric.codegen.writing.routines import routines
from symfric.codegen.writing.text import banner, block_comment, comment, folded
from symfric.emitter.c99 import TRANSCENDENTAL, Real, macro
from symfric.foundation.parameters import Variable

ALIGNED = 30
"""Width of values whose comments stand in a column."""


def source(block: Block, real: Real, guards: bool = True) -> str:
    """Text of the source file; raises as `routines`."""
    name = prefix(block, real)
    functions = routines(block, real, guards)
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
    """The constants: default parameters and start values."""
    name = prefix(block, real)
    return _constant(f"{name}_param_t {name}_default", "param", block.parameters, block, real) + (
        _constant(f"{name}_state_t {name}_start", "state", block.states, block, real)
    )


def _constant(
    declared: str, group: str, variables: Sequence[Variable], block: Block, real: Real
) -> str:
    """A constant struct with the start value of every variable; arrays in braces of their own."""
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
