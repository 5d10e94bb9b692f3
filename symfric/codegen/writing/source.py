"""The source file of a block."""

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.layout import prefix
from symfric.codegen.writing.routines import routines
from symfric.codegen.writing.text import banner, block_comment, folded
from symfric.emitter.c99 import TRANSCENDENTAL, Real, macro


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
    return f"""{block_comment(banner(block, f"{name}.c"))}
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
