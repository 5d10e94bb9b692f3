"""The unit test of a kit: plain C that repeats the proof where the code will run."""

import csv
import io
from itertools import pairwise

import numpy as np

from symfric.codegen.blocks.block import Block
from symfric.codegen.kit.c_text import braces, declarations, fields, number, step
from symfric.codegen.kit.vectors import BASE, PARAMETER_SHARE, ROUNDINGS, Vectors
from symfric.codegen.writing.layout import members, prefix
from symfric.codegen.writing.text import banner, block_comment, folded
from symfric.emitter.c99 import Real

EXPLAINED = """\
A number passes if it differs from what CasADi computed in double precision by no more than its
tolerance: {base:g} of the peak of its signal over all rows, for the rounding of a few operations,
of the functions of math.h and of fused multiply-add, which differ between compilers and targets; or
{roundings:g} times what rounding to this type changes in nine of ten rows, where that is more,
as in differences of large numbers."""

TEST = """\
{banner}
#include "{name}.h"
#include "{name}_vectors.h"

#include <math.h>
#ifdef {macro}_TEST_PRINT
#include <stdio.h>
#endif

/* The number of wrong results; 0 if all are right. */
int {name}_test(void);

/* Whether a number is wrong; NaN is. */
static int {name}_wrong({real} got, {real} wanted, {real} tolerance)
{{
    return !(fabs{letter}(got - wanted) <= tolerance);
}}

int {name}_test(void)
{{
{declarations}

    for (row = 0; row < {macro}_VECTORS; row++) {{
        const {name}_vector_t *const vector = &{name}_vectors[row];
        const int before = failures;
{body}
#ifdef {macro}_TEST_PRINT
        if (failures > before) {{
            printf("{name}: row %d: %d wrong\\n", row, failures - before);
        }}
#else
        (void)before;
#endif
    }}
    return failures;
}}

#ifndef {macro}_TEST_NO_MAIN
int main(void)
{{
    return {name}_test() == 0 ? 0 : 1;
}}
#endif
"""


def unit_test(block: Block, real: Real, guards: bool) -> str:
    """Text of NAME_test.c.

    The function returns the number of wrong results and needs neither stdio nor memory of its own;
    with NAME_TEST_PRINT it prints them, with NAME_TEST_NO_MAIN it leaves `main` to others.
    """
    name = prefix(block, real)
    lines = declarations(block, real) + ["unsigned int status = 0u;"] * guards
    text = f"Unit test of {name}: returns the number of wrong results. No stdio is needed."
    about = [
        *banner(block, f"{name}_test.c"),
        "",
        text,
        f"Define {name.upper()}_TEST_PRINT to print them, and {name.upper()}_TEST_NO_MAIN to call",
        f"{name}_test() from elsewhere.",
    ]
    return TEST.format(
        banner=block_comment(about),
        name=name,
        macro=name.upper(),
        real=real.name,
        letter=real.letter,
        declarations="\n".join(f"    {line}" for line in (*lines, "int failures = 0;", "int row;")),
        body="\n".join(f"        {line}" for line in _body(block, real, guards)),
    )


def _body(block: Block, real: Real, guards: bool) -> list[str]:
    """One row: numbers in, a step, numbers out."""
    name = prefix(block, real)
    states, inputs, outputs = (fields(block, group) for group in ("state", "in", "out"))
    lines = [f"{place} = vector->state[{i}];" for i, place in enumerate(states)]
    lines += [f"{place} = vector->in[{i}];" for i, place in enumerate(inputs)]
    if block.parameters:
        lines += [f"param = {name}_default;", "switch (vector->changed) {"]
        for i, place in enumerate(fields(block, "param")):
            lines += [f"case {i}:", f"    {place} = vector->value;", "    break;"]
        lines += ["default:", "    break;", "}"]
    lines += step(block, real, guards).splitlines()
    for what, group in (("next", states), ("out", outputs)):
        lines += [
            f"failures += {name}_wrong({place}, vector->{what}[{i}], {name}_{what}_tolerance[{i}]);"
            for i, place in enumerate(group)
        ]
    lines += ["failures += status != vector->status;"] * guards
    return lines + _resets(block, real, guards)


def _resets(block: Block, real: Real, guards: bool) -> list[str]:
    """The further initialisations, from the inputs of a row that are not bad."""
    if not block.resets:
        return []
    name, lines = prefix(block, real), list[str]()
    given = ", ".join(f"&{group}" for group in ("state", "param", "in") if group in members(block))
    places = fields(block, "state")
    for k, reset in enumerate(block.resets):
        lines.append(f"{name}_{reset}({given});")
        lines += [
            f"failures += {name}_wrong({place}, vector->reset[{i}], {name}_reset_tolerance[{i}]);"
            for i, place in enumerate(places, start=k * len(places))
        ]
    return ["if (vector->status == 0u) {", *(f"    {x}" for x in lines), "}"] if guards else lines


def vector_header(found: Vectors, guards: bool) -> str:
    """Text of NAME_vectors.h: the rows as constant arrays."""
    block, real = found.block, found.real
    name, count = prefix(block, real), len(found.steps)
    sizes = {"state": len(block.states), "in": len(block.inputs)}
    later = results(block)
    lines = [f"{real.name} {what}[{size}];" for what, size in sizes.items() if size]
    if block.parameters:
        lines += [f"{real.name} value; /* of the parameter that is changed */"]
        lines += ["int changed; /* number of that parameter, -1 for none */"]
    lines += [f"{real.name} {what}[{size}];" for what, size in later.items() if size]
    lines += ["unsigned int status;"] * guards
    rows = "".join(f"{folded(line, '    ')}\n" for line in _rows(found, guards))
    ends = np.cumsum([0, *later.values()])
    tolerances = "".join(
        folded(
            f"static const {real.name} {name}_{what}_tolerance[{size}] = "
            f"{braces(found.tolerance[end - size : end], real)};",
            "",
        )
        + "\n"
        for (what, size), end in zip(later.items(), ends[1:], strict=True)
        if size
    )
    about = EXPLAINED.format(base=BASE[real.size], roundings=ROUNDINGS).splitlines()
    order = ", ".join(v.name for v in block.states) or "none"
    texts = [
        *banner(block, f"{name}_vectors.h"),
        "",
        "Steps of their own: the states before, the inputs, one parameter that is changed (by",
        f"{PARAMETER_SHARE:.0%} of its default) or none, and the states after and the outputs.",
        f"States: {order}.",
        "",
        *about,
    ]
    return f"""{block_comment(texts)}
#ifndef {name.upper()}_VECTORS_H
#define {name.upper()}_VECTORS_H

#include <math.h>

#define {name.upper()}_VECTORS {count}

typedef struct {{
{"".join(f"    {line}{chr(10)}" for line in lines)}}} {name}_vector_t;

{tolerances}
static const {name}_vector_t {name}_vectors[{name.upper()}_VECTORS] = {{
{rows}}};

#endif
"""


def results(block: Block) -> dict[str, int]:
    """Arrays of results in a row and how many numbers they hold."""
    states = len(block.states)
    return {"next": states, "out": len(block.outputs), "reset": states * len(block.resets)}


def _rows(found: Vectors, guards: bool) -> list[str]:
    """Each row as the initialiser of a struct."""
    real, steps, lines = found.real, found.steps, list[str]()
    ends = np.cumsum([0, *results(found.block).values()])
    for k in range(len(steps)):
        parts = [braces(x[k], real) for x in (steps.states, steps.inputs) if x.size]
        if found.block.parameters:
            parts += [number(float(steps.values[k]), real), str(steps.changed[k])]
        later = [found.results[k, a:b] for a, b in pairwise(ends)]
        parts += [braces(x, real) for x in later if x.size]
        parts += [f"{found.status[k]}u"] * guards
        lines.append("{" + ", ".join(parts) + "},")
    return lines


def table(found: Vectors, guards: bool) -> str:
    """The same rows as CSV, for other tools: columns with names and units."""
    block = found.block
    names = [v.name for v in block.parameters]
    head = [f"{v.name} before [{v.unit}]" for v in block.states]
    head += [f"{v.name} [{v.unit}]" for v in block.inputs]
    head += ["changed parameter", "its value"] if names else []
    head += [f"{v.name} after [{v.unit}]" for v in block.states]
    head += [f"{n} [{o.unit}]" for n, o in block.outputs.items()]
    head += [f"{v.name} by {reset} [{v.unit}]" for reset in block.resets for v in block.states]
    head += ["status"] * guards
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerow(_tolerance_row(found, len(head), guards))
    steps = found.steps
    for k, i in enumerate(steps.changed.tolist()):
        changed = [names[i], repr(float(steps.values[k]))] if i >= 0 else ["", ""]
        numbers = [repr(x) for part in (steps.states, steps.inputs) for x in part[k].tolist()]
        later = [repr(x) for x in found.results[k].tolist()]
        status = [str(found.status[k])] * guards
        writer.writerow(numbers + (changed if names else []) + later + status)
    return text.getvalue()


def _tolerance_row(found: Vectors, width: int, guards: bool) -> list[str]:
    """The second row: the tolerance of each result."""
    values = [repr(float(x)) for x in found.tolerance]
    empty = width - len(values) - guards
    return ["tolerance", *[""] * (empty - 1), *values, *["0"] * guards]
