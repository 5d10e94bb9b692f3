"""Header file of a block: its data sheet, structs and prototypes."""

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from textwrap import wrap

from symfric.codegen.blocks.block import Block
from symfric.codegen.guards import constants, parameter_range, range_of
from symfric.codegen.layout import WIDTH, Member, banner, block_comment, comment, members, prefix
from symfric.codegen.routines import routines
from symfric.emitter.c99 import Real
from symfric.foundation.parameters import Variable

MEANING = {
    "state": "States, kept between steps; one struct for each contact or joint.",
    "param": "Parameters, which may be changed between steps.",
    "in": "Inputs of a step.",
    "out": "Outputs of a step.",
}
"""Comments of the structs."""

NARROW = 30
"""Least width of a comment next to a member [columns]."""


def header(block: Block, real: Real, guards: bool = True) -> str:
    """Return the text of the header file; raises as `routines`."""
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

{structs}{_declared(block, name)}{status}{prototypes}
#ifdef __cplusplus
}}
#endif

#endif /* {guard} */
"""


def _variables(block: Block, group: str) -> Sequence[Variable]:
    return {"state": block.states, "param": block.parameters, "in": block.inputs}.get(group, ())


def _struct(block: Block, group: str, rows: Sequence[Member], real: Real, guards: bool) -> str:
    """Return a struct, every member with its meaning, unit, start or default value, and range."""
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
    """Yield start or default value, if all are equal, and range."""
    starts = list(dict.fromkeys(f"{float(v.start):g}" for v in variables))
    if starts and group in ("state", "param"):
        shown = starts if len(starts) < 2 else [starts[0], "...", starts[-1]]
        yield f"{'start' if group == 'state' else 'default'} {' '.join(shown)}"
    if variables:
        yield interval(variables, group, guards)


def _declared(block: Block, name: str) -> str:
    """Return declarations of the default parameters and of the start values."""
    found = ""
    if block.parameters:
        found += (
            f"/* Default parameters to copy. */\nextern const {name}_param_t {name}_default;\n\n"
        )
    if block.states:
        found += f"/* Start values of the model. */\nextern const {name}_state_t {name}_start;\n\n"
    return found


def sheet(block: Block, guards: bool) -> Iterator[str]:
    """Return the data sheet, line by line."""
    yield from ["", *(line for text in block.doc.splitlines() for line in _wrapped(text))]
    yield from _section("Equations", block.equations.splitlines())
    yield from _section("Discretisation", _lines(block.discretisation))
    yield from _section("Sample time", _lines(_sample_time(block)))
    yield from _section("Use", _list(block.use))
    yield from _section("Inputs", _inputs(block, guards) if block.is_function else ())
    yield from _section("Not valid, and limits", _list(block.limits))
    yield from _section("Guards", _list(_guards(block)) if guards else ())
    yield from _section("Constants of this code", _constants(block))
    yield from _section("Sources", _list(block.sources))


def _section(title: str, lines: Iterable[str]) -> Iterator[str]:
    found = [f"    {line}".rstrip() for line in lines]
    if found:
        yield from ["", f"{title}:", *found]


def _wrapped(text: str, room: int = WIDTH - 3) -> list[str]:
    return wrap(text, room, break_long_words=False, break_on_hyphens=False) or [""]


def _lines(text: str) -> Iterator[str]:
    """Yield sentences wrapped; indented formulas are unchanged."""
    for line in text.splitlines():
        yield from [line] if line.startswith(" ") else _wrapped(line, WIDTH - 7)


def _list(texts: Sequence[str]) -> Iterator[str]:
    for text in texts:
        first, *rest = _wrapped(text, WIDTH - 9)
        yield f"- {first}"
        yield from (f"  {line}" for line in rest)


def _sample_time(block: Block) -> str:
    """Return the text about the step size and its setting."""
    h = block.sample_time
    if h is None:
        return ""
    if "h" in block.constants:
        return f"h = {h:g} s, a constant of this code: call it at exactly this interval."
    return (
        f"h, a parameter, {h:g} s by default: set it to the interval at which the code is called. "
        "It may change from step to step."
    )


def _guards(block: Block) -> list[str]:
    """Return sentences about the repair of invalid numbers, and its report."""
    safe = ", ".join(f"{v.name} = {range_of(v).safe:g}" for v in block.inputs)
    found = [f"Inputs outside their range are clamped to it; not finite ones are replaced: {safe}."]
    if block.states:
        found.append("If a state is not finite or absurdly large, all restart at their start.")
    if any(v.name != "h" for v in block.parameters):
        found.append("If a parameter is outside its range, the default set is used for this step.")
    if any(v.name == "h" for v in block.parameters):
        found.append("A step size outside its range is clamped to it.")
    found.append("Every change by a guard sets a bit of the status; valid numbers are not changed.")
    return found if block.inputs else found[1:]


def _constants(block: Block) -> Iterator[str]:
    """Yield the numbers folded into the formulas, a line each."""
    texts = {name: f"{name} = {value:g}" for name, value in block.constants.items()}
    width = max(map(len, texts.values()), default=0)
    about = {"h": "step size [s]"} | dict(block.about)
    for name, text in texts.items():
        yield f"{text:<{width}}  {about.get(name, '')}"


def _inputs(block: Block, guards: bool) -> Iterator[str]:
    """Yield meaning, unit and range of the arguments of a function, a line each."""
    width = max((len(v.name) for v in block.inputs), default=0)
    for v in block.inputs:
        yield f"{v.name:<{width}}  {meaning(v.doc, v.unit, interval([v], 'in', guards))}"


def meaning(doc: str, unit: str, *more: str) -> str:
    """Return the meaning of a number, its unit, and further texts."""
    return ", ".join(text for text in (f"{doc} [{unit}]".strip(), *more) if text)


def interval(variables: Sequence[Variable], group: str, guards: bool) -> str:
    """Return the closed interval in which each of some variables is valid; "" for all numbers.

    Args:
        group: "state", "param" or "in"; guards enforce the latter two.
    """
    ends = [_ends(v, group, guards) for v in variables]
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    if low == -high and isfinite(high):
        return f"+-{high:g}"
    if isfinite(low) and isfinite(high):
        return f"{low:g} to {high:g}"
    if isfinite(low):
        return f">= {low:g}"
    return f"<= {high:g}" if isfinite(high) else ""


def _ends(variable: Variable, group: str, guards: bool) -> tuple[float, float]:
    if guards and group != "state":
        kept = range_of(variable) if group == "in" else parameter_range(variable)
        return kept.low, kept.high
    return variable.lower, variable.upper
