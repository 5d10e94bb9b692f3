"""The header file of a block: its data sheet, structs and prototypes."""

from collections.abc import Iterator, Sequence
from textwrap import wrap

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.guards import constants
from symfric.codegen.writing.layout import Member, members, prefix
from symfric.codegen.writing.routines import routines
from symfric.codegen.writing.sheet import interval, meaning, sheet
from symfric.codegen.writing.text import WIDTH, banner, block_comment, comment
from symfric.emitter.c99 import Real
from symfric.foundation.parameters import Variable

MEANING = {
    "state": "States: what a step remembers; one struct for each contact or joint.",
    "param": "Parameters: may be changed between any two steps.",
    "in": "Inputs of a step.",
    "out": "Outputs of a step.",
}
"""Of the structs."""

NARROW = 30
"""Columns that a comment beside a member has at least."""


def header(block: Block, real: Real, guards: bool = True) -> str:
    """Text of the header file; raises as `routines`."""
    name = prefix(block, real)
    guard = f"{name.upper()}_H"
    structs = "".join(
        _struct(block, group, rows, real, guards) for group, rows in members(block).items()
    )
    status = constants(block, real) + "\n" if guards else ""
    prototypes = "\n".join(f"/* {r.doc} */\n{r.head};\n" for r in routines(block, real, guards))
    return f"""{block_comment([*banner(block, f"{name}.h"), *sheet(block, guards)])}
#ifndef {guard}
#define {guard}

#ifdef __cplusplus
extern "C" {{
#endif

{structs}{_constants(block, name)}{status}{prototypes}
#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


def _variables(block: Block, group: str) -> Sequence[Variable]:
    return {"state": block.states, "param": block.parameters, "in": block.inputs}.get(group, ())


def _struct(block: Block, group: str, rows: Sequence[Member], real: Real, guards: bool) -> str:
    """A struct, every member with its meaning, unit, start or default value, and range."""
    variables, width = _variables(block, group), max(len(row.declared) for row in rows) + 1
    lines = ""
    for row in rows:
        own = variables[row.first : row.first + row.count]
        text = meaning(row.doc, row.unit, *_numbers(group, own, guards))
        start = f"    {real.name} {row.declared + ';':<{width}} /* "
        room = max(WIDTH - len(start) - 3, NARROW)
        whole = wrap(comment(text), room, break_long_words=False, break_on_hyphens=False)
        lines += start + ("\n" + " " * len(start)).join(whole) + " */\n"
    name = f"{prefix(block, real)}_{group}_t"
    return f"/* {MEANING[group]} */\ntypedef struct {{\n{lines}}} {name};\n\n"


def _numbers(group: str, variables: Sequence[Variable], guards: bool) -> Iterator[str]:
    """Start or default value, where all have the same, and range."""
    starts = list(dict.fromkeys(f"{float(v.start):g}" for v in variables))
    if starts and group in ("state", "param"):
        shown = starts if len(starts) < 2 else [starts[0], "...", starts[-1]]
        yield f"{'start' if group == 'state' else 'default'} {' '.join(shown)}"
    if variables:
        yield interval(variables, group, guards)


def _constants(block: Block, name: str) -> str:
    """Declarations of the default parameters and of the start values."""
    found = ""
    if block.parameters:
        found += (
            f"/* To be copied, and changed. */\nextern const {name}_param_t {name}_default;\n\n"
        )
    if block.states:
        found += f"/* Start values of the model. */\nextern const {name}_state_t {name}_start;\n\n"
    return found
