"""C functions of a block, its source file and its header file with the data sheet."""

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from math import isfinite
from textwrap import wrap
from types import MappingProxyType
from typing import NamedTuple

import casadi as ca

from symfric.codegen.blocks.block import GROUPS, SHEET, TEMPLATES, Block, CBlock, Member, banner
from symfric.codegen.guards import (
    STEP_SIZE,
    constants,
    finite_outputs,
    fit_parameters,
    found_states,
    helpers,
    mended,
    parameter_range,
    range_of,
)
from symfric.emitter.arrays import emit_rolled
from symfric.emitter.c99 import (
    TRANSCENDENTAL,
    WIDTH,
    block_comment,
    comment,
    filled,
    folded,
    macro,
    representable,
)
from symfric.emitter.emit import emit
from symfric.foundation.graph import graph
from symfric.foundation.parameters import Variable


class Routine(NamedTuple):
    """C function.

    Attributes:
        result: return type.
        calls: function of math.h (name for double) -> number of calls.
        operations: number of operations, calls included.
    """

    name: str
    result: str
    arguments: tuple[str, ...]
    doc: str
    statements: tuple[str, ...]
    calls: Mapping[str, int] = MappingProxyType({})
    operations: int = 0

    @property
    def head(self) -> str:
        """Prototype without its semicolon."""
        start = f"{self.result} {self.name}("
        whole = f"{start}{', '.join(self.arguments)})"
        return whole if len(whole) <= WIDTH else whole.replace(", ", ",\n" + " " * len(start))


@lru_cache(maxsize=4)
def routines(c: CBlock) -> tuple[Routine, ...]:
    """Return the C functions of a block: `_init`, `_reset`, its resets and `_step`.

    A block without states and with one output is a single function of scalars instead. With guards,
    the resets and `_step` return the status of `symfric.codegen.guards`, and a function of scalars
    sets its bits in an argument.

    Raises:
        ValueError: an operation without counterpart in C99, or a constant outside the type.
    """
    block, name = c.block, c.name
    if block.is_function:
        ((shown, output),) = block.outputs.items()
        doc = f"{shown} [{output.unit}]: {output.doc}".rstrip(": ") + "."
        doc += " Sets bits of *status and clears none: start with 0." * c.guards
        ends = f"const {c.real.name} {shown} = {{}};" if c.guards else "return {};"
        return (_routine(c, name, doc, block.step, [[], [ends]]),)
    store = [f"state->{place} = {{}};" for place in block.places("state")]
    show = [f"out->{place} = {{}};" for place in block.places("out")]
    found: list[Routine] = []
    if block.states:
        own, start = f"{name}_state_t *state", f"const {name}_state_t *start"
        init = "Sets an initial state, such as that of the model; call it before the first step."
        reset, given = "Sets the initial state of the model.", f"*state = {name}_start;"
        found.append(Routine(f"{name}_init", "void", (own, start), init, ("*state = *start;",)))
        found.append(Routine(f"{name}_reset", "void", (own,), reset, (given,)))
    for reset, (_, doc) in block.resets.items():
        found.append(_routine(c, f"{name}_{reset}", doc, block.reset(reset), [store]))
    doc = "One step: outputs and next state" if block.states else "All outputs"
    doc += "; returns the status." if c.guards else "."
    return (*found, _routine(c, f"{name}_step", doc, block.step, [store, show]))


def _routine(
    c: CBlock, name: str, doc: str, function: ca.Function, targets: Sequence[Sequence[str]]
) -> Routine:
    block, scalars, steps = c.block, c.block.is_function, len(targets) > 1
    checked = {(2, j) for j in range(len(block.inputs))} if c.guards else set()
    if c.guards:  # values that the guards load
        checked |= {(1, j) for j, v in enumerate(block.parameters) if v.name == STEP_SIZE}
    loads = {
        (i, j): f"{group}->{place}"
        for i, group in enumerate(block.groups)
        for j, place in enumerate(block.places(group))
    }
    whole, arrays = graph(function), block.indexed(GROUPS[::3][: len(targets)], c.guards)
    names = [[v.name for v in of] for of in block.groups.values()]
    given = representable(whole, c.real), names, targets, c.real
    free = {entry: place for entry, place in loads.items() if entry not in checked}
    if c.author is not None:
        code = c.author.code(targets, free)
    elif arrays.read or arrays.written:
        code = emit_rolled(*given, arrays, free)
    else:
        code = emit(*given, loads=free)
    arguments = [
        f"{'const ' * (group in GROUPS[1:3])}{c.name}_{group}_t *{group}"
        for group in GROUPS
        if group in block.members and (group != "out" or steps)
    ]
    seen = {GROUPS[i] for i, _ in code.used} | {"state"}
    idle = [group for group in GROUPS[:3] if group in block.members and group not in seen]
    if scalars:
        arguments = [f"{c.real.name} {v.name}" for v in block.inputs] + arguments
        arguments += ["unsigned int *status"] * c.guards
        idle += [v.name for j, v in enumerate(block.inputs) if (2, j) not in code.used]
    body = code.lines
    if c.guards:
        before: list[str] = []
        for i, j in sorted(code.used & checked, key=lambda entry: (-entry[0], entry[1])):
            group, variable = GROUPS[i], block.groups[GROUPS[i]][j]
            if (i, j) in loads:
                before.append(f"{c.real.name} {variable.name} = {loads[i, j]};")
            before += mended(c, variable, group)
        if any(i == 1 for i, _ in code.used - checked):
            before += fit_parameters(c)
        body = (*before, *body)
        if steps:
            body = (*before, *found_states(c), *code.lines, *finite_outputs(c))
    body = (*(f"(void){what};" for what in idle), *body)
    result = c.real.name if scalars else "void"
    if c.guards and not scalars:
        result, body = "unsigned int", ("unsigned int status = 0u;", *body, "return status;")
    return Routine(name, result, tuple(arguments), doc, body, code.calls, code.operations)


ALIGNED = 30
"""Largest width of values whose comments are aligned [columns]."""


def source(c: CBlock) -> str:
    """Return the text of the source file; raise the errors of `routines`."""
    functions = routines(c)
    called = sorted({call for r in functions for call in r.calls} & set(TRANSCENDENTAL.values()))
    macros = "".join(
        f"#ifndef {macro(call, c.real)}\n#define {macro(call, c.real)} {call}{c.real.letter}\n"
        "#endif\n"
        for call in called
    )
    if macros:
        macros = f"/* Define these to use your own, faster functions. */\n{macros}\n"
    bodies = "\n".join(
        f"{r.head}\n{{\n" + "".join(folded(line, "    ") + "\n" for line in r.statements) + "}\n"
        for r in functions
    )
    if c.guards:
        bodies = helpers(c, bodies) + bodies
    if c.author is not None:
        bodies = c.author.helpers(bodies) + bodies
    headers = ["stdbool"] * ("bool " in bodies) + ["stdint", "string"] * c.guards
    includes = "".join(f"#include <{header}.h>\n" for header in headers)
    return (
        f'{block_comment(banner(c.block, f"{c.name}.c"))}\n#include "{c.name}.h"\n\n'
        f"#include <math.h>\n{includes}\n{macros}"
        f"{_constant(c, 'param', 'default')}{_constant(c, 'state', 'start')}{bodies}"
    )


def _constant(c: CBlock, group: str, name: str) -> str:
    """Return a constant struct with the start value of every variable; braces enclose arrays."""
    rows: list[tuple[str, str]] = []
    for member in c.block.members.get(group, ()):
        variables = c.block.groups[group][member.first : member.first + member.length]
        text = ", ".join(c.real.literal(float(v.start)) for v in variables)
        text = f"{{{text}}}," if member.size else f"{text},"
        rows.append((text, f"{member.name} [{member.unit}]"))
    if not rows:
        return ""
    width = max((len(text) for text, _ in rows if len(text) <= ALIGNED), default=0)
    lines = (folded(f"{text:<{width}} /* {comment(about)} */", "    ") for text, about in rows)
    joined = "\n".join(lines)
    return f"const {c.name}_{group}_t {c.name}_{name} = {{\n{joined}\n}};\n\n"


NARROW = 30
"""Smallest width of a comment next to a member [columns]."""


def header(c: CBlock) -> str:
    """Return the text of the header file; raise the errors of `routines`."""
    block, name = c.block, c.name
    structs = "".join(_struct(c, group, rows) for group, rows in block.members.items())
    for group, constant, what in (
        ("param", "default", "Default parameters to copy."),
        ("state", "start", "Start values of the model."),
    ):
        if group in block.members:
            structs += f"/* {what} */\nextern const {name}_{group}_t {name}_{constant};\n\n"
    return filled(
        TEMPLATES / "header.h",
        sheet=block_comment([*banner(block, f"{name}.h"), *sheet(c)]),
        guard=f"{name.upper()}_H",
        structs=("#include <stdint.h>\n\n" if c.real.whole else "") + structs,
        status=constants(c) + "\n" if c.guards else "",
        prototypes="\n".join(f"/* {r.doc} */\n{r.head};\n" for r in routines(c)),
    )


def _struct(c: CBlock, group: str, rows: Sequence[Member]) -> str:
    """Return a struct whose members have comments: meaning, unit, start or default, range."""
    width, lines = max(len(row.declared) for row in rows) + 1, ""
    for row in rows:
        own = c.block.groups.get(group, ())[row.first : row.first + row.length]
        text = meaning(row.doc, row.unit, *_numbers(group, own, c.guards))
        start = f"    {c.real.name} {row.declared + ';':<{width}} /* "
        columns = max(WIDTH - len(start) - 3, NARROW)
        lines += start + ("\n" + " " * len(start)).join(_wrapped(comment(text), columns)) + " */\n"
    return f"/* {SHEET['structs'][group]} */\ntypedef struct {{\n{lines}}} {c.name}_{group}_t;\n\n"


def _numbers(group: str, variables: Sequence[Variable], guards: bool) -> Iterator[str]:
    """Yield the start or default values (first and last, if they differ) and the range."""
    starts = list(dict.fromkeys(f"{float(v.start):g}" for v in variables))
    if starts and group in ("state", "param"):
        shown = starts if len(starts) < 2 else [starts[0], "...", starts[-1]]
        yield f"{'start' if group == 'state' else 'default'} {' '.join(shown)}"
    if variables:
        yield interval(variables, group, guards)


def sheet(c: CBlock) -> Iterator[str]:
    """Yield the data sheet, line by line."""
    block, texts = c.block, SHEET["sample_time"]
    said = texts["constant" if "h" in block.constants else "parameter"]
    h = block.sample_time
    yield from ["", *(line for text in block.doc.splitlines() for line in _wrapped(text))]
    for title, lines in {
        "Equations": block.equations.splitlines(),
        "Discretisation": _lines(block.discretisation),
        "Sample time": () if h is None else _wrapped(said.format(h=h), WIDTH - 7),
        "Use": _list(block.use),
        "Inputs": _inputs(c) if block.is_function else (),
        "Not valid, and limits": _list(block.limits),
        "Guards": _list(_guards(block)) if c.guards else (),
        "Constants of this code": _constants(block),
        "Sources": _list(block.sources),
    }.items():
        found = [f"    {line}".rstrip() for line in lines]
        yield from ["", f"{title}:", *found] if found else ()


def _wrapped(text: str, columns: int = WIDTH - 3) -> list[str]:
    return wrap(text, columns, break_long_words=False, break_on_hyphens=False) or [""]


def _lines(text: str) -> Iterator[str]:
    """Yield the lines of a text; sentences are wrapped, indented formulas are not."""
    for line in text.splitlines():
        yield from [line] if line.startswith(" ") else _wrapped(line, WIDTH - 7)


def _list(texts: Sequence[str]) -> Iterator[str]:
    for text in texts:
        first, *rest = _wrapped(text, WIDTH - 9)
        yield from [f"- {first}", *(f"  {line}" for line in rest)]


def _guards(block: Block) -> list[str]:
    """Return sentences about the repair of invalid numbers and about the status."""
    safe = ", ".join(f"{v.name} = {range_of(v).safe:g}" for v in block.inputs)
    sizes = [v.name == STEP_SIZE for v in block.parameters]
    shown = {
        "inputs": bool(safe),
        "states": bool(block.states),
        "parameters": not all(sizes),
        "step": any(sizes),
        "status": True,
    }
    return [SHEET["guards"][name].format(safe=safe) for name, there in shown.items() if there]


def _constants(block: Block) -> Iterator[str]:
    """Yield one line for each number that is folded into the formulas."""
    texts = {name: f"{name} = {value:g}" for name, value in block.constants.items()}
    width = max(map(len, texts.values()), default=0)
    about = {"h": "step size [s]"} | dict(block.about)
    yield from (f"{text:<{width}}  {about.get(name, '')}" for name, text in texts.items())


def _inputs(c: CBlock) -> Iterator[str]:
    """Yield one line for each argument of a function of scalars: meaning, unit and range."""
    width = max((len(v.name) for v in c.block.inputs), default=0)
    for v in c.block.inputs:
        yield f"{v.name:<{width}}  {meaning(v.doc, v.unit, interval([v], 'in', c.guards))}"


def meaning(doc: str, unit: str, *more: str) -> str:
    """Return the meaning of a number, its unit and further texts, separated by commas."""
    return ", ".join(text for text in (f"{doc} [{unit}]".strip(), *more) if text)


def interval(variables: Sequence[Variable], group: str, guards: bool) -> str:
    """Return the closed interval in which all `variables` are valid; "" if it is unbounded.

    Args:
        group: "state", "param" or "in"; guards enforce the ranges of "param" and "in".
    """
    ends = [(v.lower, v.upper) for v in variables]
    if guards and group != "state":
        ends = [(range_of if group == "in" else parameter_range)(v)[:2] for v in variables]
    low, high = max(low for low, _ in ends), min(high for _, high in ends)
    if low == -high and isfinite(high):
        return f"+-{high:g}"
    if isfinite(low) and isfinite(high):
        return f"{low:g} to {high:g}"
    if isfinite(low):
        return f">= {low:g}"
    return f"<= {high:g}" if isfinite(high) else ""
