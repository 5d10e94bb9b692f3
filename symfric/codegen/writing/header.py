"""The header file of a block: its data sheet and prototypes."""

from collections.abc import Sequence
from textwrap import wrap

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.layout import Member, members, prefix
from symfric.codegen.writing.routines import routines
from symfric.codegen.writing.text import WIDTH, banner, block_comment, comment
from symfric.emitter.c99 import Real


def header(block: Block, real: Real) -> str:
    """Text of the header file; raises as `routines`."""
    name = prefix(block, real)
    guard = f"{name.upper()}_H"
    structs = "".join(
        _struct(f"{name}_{group}_t", rows, real) for group, rows in members(block).items()
    )
    default = f"extern const {name}_param_t {name}_default;\n\n" if block.parameters else ""
    prototypes = "\n".join(f"/* {r.doc} */\n{r.head};\n" for r in routines(block, real))
    return f"""{block_comment(banner(block, f"{name}.h") + _about(block))}
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


def _struct(name: str, rows: Sequence[Member], real: Real) -> str:
    width = max(len(row.declared) for row in rows) + 1
    lines = "".join(
        f"    {real.name} {row.declared + ';':<{width}} "
        f"/* {comment(f'{row.doc} [{row.unit}]'.strip())} */\n"
        for row in rows
    )
    return f"typedef struct {{\n{lines}}} {name};\n\n"


def _about(block: Block) -> list[str]:
    constants = ", ".join(f"{name} = {value:g}" for name, value in block.constants.items())
    last = ["", *wrap(f"Constants: {constants}.", WIDTH - 3)] if constants else []
    return ["", *block.doc.splitlines(), *last]
