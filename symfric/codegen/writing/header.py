"""The header file of a block: its data sheet, structs and prototypes."""

from collections.abc import Iterator, Sequence
from math import isfinite
from textwrap import wrap

from symfric.codegen.blocks.block import Block
from symfric.codegen.writing.guards import constants
from symfric.codegen.writing.layout import Member, members, prefix
from symfric.codegen.writing.routines import routines
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


def header(block: Block, real: Real, guards: bool = True) -> str:
    """Text of the header file; raises as `routines`."""
    name = prefix(block, real)
    guard = f"{name.upper()}_H"
    ranges = _ranges(block)
    structs = "".join(
        _struct(f"{name}_{group}_t", MEANING[group], rows, ranges, real)
        for group, rows in members(block).items()
    )
    status = constants(block, real) + "\n" if guards else ""
    prototypes = "\n".join(f"/* {r.doc} */\n{r.head};\n" for r in routines(block, real, guards))
    return f"""{block_comment([*banner(block, f"{name}.h"), *sheet(block, real)])}
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


def sheet(block: Block, real: Real) -> Iterator[str]:
    """The data sheet, line by line: what is computed, how, from what, and what is not valid."""
    yield from ["", *(line for text in block.doc.splitlines() for line in _wrapped(text))]
    yield from _section("Equations", block.equations.splitlines())
    yield from _section("Discretisation", _lines(block.discretisation))
    yield from _section("Sample time", _lines(_sample_time(block)))
    yield from _section("Use", (line for text in block.use for line in _listed(text)))
    yield from _section("Inputs", _described(block.inputs) if block.is_function else ())
    yield from _section("Not valid, and limits", (x for t in block.limits for x in _listed(t)))
    yield from _section("Constants of this code", _lines(_folded(block)))
    yield from _section("Sources", (line for text in block.sources for line in _listed(text)))


def _section(title: str, lines: Sequence[str] | Iterator[str]) -> Iterator[str]:
    found = [f"    {line}".rstrip() for line in lines]
    if found:
        yield from ["", f"{title}:", *found]


def _wrapped(text: str, room: int = WIDTH - 3) -> list[str]:
    return wrap(text, room, break_long_words=False, break_on_hyphens=False) or [""]


def _lines(text: str) -> Iterator[str]:
    """Sentences wrapped, formulas, which are indented, as they stand."""
    for line in text.splitlines():
        yield from [line] if line.startswith(" ") else _wrapped(line, WIDTH - 7)


def _listed(text: str) -> Iterator[str]:
    first, *rest = _wrapped(text, WIDTH - 9)
    yield f"- {first}"
    yield from (f"  {line}" for line in rest)


def _sample_time(block: Block) -> str:
    """What the step size is, and where it is said."""
    h = block.sample_time
    if h is None:
        return ""
    if "h" in block.constants:
        return f"h = {h:g} s, a constant of this code: call it at this interval and no other."
    return (
        f"h, a parameter, {h:g} s by default: set it to the interval at which the code is called. "
        "It may change from step to step."
    )


def _folded(block: Block) -> str:
    """The numbers that were folded into the formulas."""
    return ", ".join(f"{name} = {value:g}" for name, value in block.constants.items())


def _described(variables: Sequence[Variable]) -> Iterator[str]:
    """Meaning, unit and range of each, a line each."""
    width = max((len(v.name) for v in variables), default=0)
    for v in variables:
        yield f"{v.name:<{width}}  {_meaning(v.doc, v.unit, range_of(v))}"


def _meaning(doc: str, unit: str, interval: str) -> str:
    text = f"{doc} [{unit}]".strip()
    return f"{text}, {interval}" if interval else text


def range_of(variable: Variable) -> str:
    """The closed interval that a variable is valid in, in words; "" for all numbers."""
    low, high = variable.lower, variable.upper
    if isfinite(low) and isfinite(high):
        return f"{low:g} to {high:g}"
    if isfinite(low):
        return f">= {low:g}"
    return f"<= {high:g}" if isfinite(high) else ""


def _ranges(block: Block) -> dict[str, str]:
    """Member, or first number of one, -> its range."""
    every = (*block.states, *block.parameters, *block.inputs)
    return {v.name: range_of(v) for v in every}


def _struct(
    name: str, meaning: str, rows: Sequence[Member], ranges: dict[str, str], real: Real
) -> str:
    width = max(len(row.declared) for row in rows) + 1
    lines = "".join(
        f"    {real.name} {row.declared + ';':<{width}} "
        f"/* {comment(_meaning(row.doc, row.unit, ranges.get(row.name, '')))} */\n"
        for row in rows
    )
    return f"/* {meaning} */\ntypedef struct {{\n{lines}}} {name};\n\n"


def _constants(block: Block, name: str) -> str:
    """Declarations of the default parameters and of the start values."""
    found = ""
    if block.parameters:
        found += f"extern const {name}_param_t {name}_default; /* copy it to change some */\n\n"
    if block.states:
        found += f"extern const {name}_state_t {name}_start; /* start values of the model */\n\n"
    return found
