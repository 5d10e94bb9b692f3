"""Export package of a block: unit test, build files, wrappers for other tools.

A unit test in plain C verifies the code on its target machine, with test vectors as a header and as
CSV; CMake builds libraries and tests; a Python loader and a Simulink S-function call the C. Their
fixed text is in `templates`.
"""

import csv
import io
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.layout import (
    TEMPLATES,
    banner,
    block_comment,
    braces,
    declarations,
    fields,
    filled,
    folded,
    members,
    number,
    prefix,
    step,
)
from symfric.codegen.vectors import BASE, PARAMETER_SHARE, ROUNDINGS, Vectors, vectors
from symfric.emitter.c99 import Real

EXPLAINED = """\
A number passes if it differs from the result of CasADi in double precision by no more than its
tolerance: {base:g} of the peak of its signal over all rows, for the rounding of a few operations,
of the functions of math.h and of fused multiply-add, which differ between compilers and targets; or
{roundings:g} times what rounding to this type changes in nine of ten rows, where that is more,
as in differences of large numbers."""


def kit_files(block: Block, reals: Sequence[Real], guards: bool) -> dict[str, str]:
    """Return the texts of the files besides header and source, by file name."""
    texts: dict[str, str] = {}
    for real in reals:
        stem, rows = prefix(block, real), vectors(block, real, guards)
        texts[f"{stem}_test.c"] = unit_test(block, real, guards)
        texts[f"{stem}_vectors.h"] = vector_header(rows, guards)
        texts[f"{stem}_vectors.csv"] = vector_table(rows, guards)
    texts[f"{block.name}_block.cmake"] = cmake(block, reals)
    texts["CMakeLists.txt"] = (TEMPLATES / "CMakeLists.txt").read_text(encoding="utf-8")
    texts[f"{block.name}_ctypes.py"] = loader(block, reals, guards)
    texts[f"{block.name}_sfun.c"] = wrapper(block, reals, guards)
    return texts


def unit_test(block: Block, real: Real, guards: bool) -> str:
    """Return the text of NAME_test.c.

    The function returns the number of wrong results and needs neither stdio nor memory of its own;
    with NAME_TEST_PRINT it prints them, with NAME_TEST_NO_MAIN it has no `main`.
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
    return filled(
        TEMPLATES / "test.c",
        banner=block_comment(about),
        name=name,
        macro=name.upper(),
        real=real.name,
        letter=real.letter,
        declarations="\n".join(f"    {line}" for line in (*lines, "int failures = 0;", "int row;")),
        body="\n".join(f"        {line}" for line in _body(block, real, guards)),
    )


def _body(block: Block, real: Real, guards: bool) -> list[str]:
    """Return the statements of one row: numbers in, a step, numbers out."""
    name = prefix(block, real)
    states, inputs, outputs = (fields(block, group) for group in ("state", "in", "out"))
    lines = [f"{place} = vector->state[{i}];" for i, place in enumerate(states)]
    lines += [f"{place} = vector->in[{i}];" for i, place in enumerate(inputs)]
    if block.parameters:
        lines += [f"param = {name}_default;", "switch (vector->changed) {"]
        for i, place in enumerate(fields(block, "param")):
            lines += [f"case {i}:", f"    {place} = vector->value;", "    break;"]
        lines += ["default:", "    break;", "}"]
    lines += step(block, real, guards)
    for what, group in (("next", states), ("out", outputs)):
        lines += [
            f"failures += {name}_wrong({place}, vector->{what}[{i}], {name}_{what}_tolerance[{i}]);"
            for i, place in enumerate(group)
        ]
    lines += ["failures += status != vector->status;"] * guards
    return lines + _resets(block, real, guards)


def _resets(block: Block, real: Real, guards: bool) -> list[str]:
    """Return the further initialisations, from the valid inputs of a row."""
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
    """Return the text of NAME_vectors.h: the rows as constant arrays."""
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
        "Independent steps: the states before, the inputs, one parameter that is changed (by",
        f"{PARAMETER_SHARE:.0%} of its default) or none, and the states after and the outputs.",
        f"States: {order}.",
        "",
        *about,
    ]
    return filled(
        TEMPLATES / "vectors.h",
        about=block_comment(texts),
        name=name,
        macro=name.upper(),
        count=count,
        members="".join(f"    {line}\n" for line in lines),
        tolerances=tolerances,
        rows=rows,
    )


def results(block: Block) -> dict[str, int]:
    """Return arrays of results in a row and their sizes."""
    states = len(block.states)
    return {"next": states, "out": len(block.outputs), "reset": states * len(block.resets)}


def _rows(found: Vectors, guards: bool) -> list[str]:
    """Return each row as the initialiser of a struct."""
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


def vector_table(found: Vectors, guards: bool) -> str:
    """Return the same rows as CSV, for other tools: columns with names and units."""
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
    """Return the second row: the tolerance of each result."""
    values = [repr(float(x)) for x in found.tolerance]
    empty = width - len(values) - guards
    return ["tolerance", *[""] * (empty - 1), *values, *["0"] * guards]


def loader(block: Block, reals: Sequence[Real], guards: bool) -> str:
    """Return the text of NAME_ctypes.py: class `Block` with `step`, `run` on arrays and `reset`."""
    types = {real.name: prefix(block, real) for real in reals}
    layout = {
        group: [(member.name, member.size) for member in rows]
        for group, rows in members(block).items()
    }
    given = ", ".join(f"{v.name}={v.nominal:g}" for v in block.inputs)
    shown = next(iter(block.outputs), None)
    example = f"    block.step({given})" + (f'["{shown}"]' if shown else "")
    first, *rest = banner(block, f"{block.name}_ctypes.py")
    return filled(
        TEMPLATES / "ctypes_loader.txt",
        title=f"{block.name} from Python: the generated C, by ctypes and NumPy.",
        module=f"{block.name}_ctypes",
        name=block.name,
        fingerprint=block.fingerprint,
        banner="\n".join([first.replace("C99 made", "made"), *rest]),
        type_doc=" or ".join(f'Block("{name}")' for name in types),
        reals=" or ".join(types),
        first=next(iter(types)),
        example=example,
        types=types,
        members="".join(f"    {group!r}: {rows!r},\n" for group, rows in layout.items()),
        inputs=tuple(v.name for v in block.inputs),
        outputs=tuple(block.outputs),
        is_function=block.is_function,
        guards=guards,
        resets=tuple(block.resets),
        groups=GROUPS,
    )


def wrapper(block: Block, reals: Sequence[Real], guards: bool) -> str:
    """Return the text of NAME_sfun.c, for the type double if available, else float."""
    real = max(reals, key=lambda r: r.size)
    states, count = fields(block, "state"), len(block.states)
    outputs = len(block.outputs) + guards
    body = [*_given(block, real), *step(block, real, guards), *_shown(block, guards)]
    body += [f"ssGetRWork(S)[{i}] = (real_T){place};" for i, place in enumerate(states)]
    lines = declarations(block, real) + ["unsigned int status = 0u;"] * guards
    if block.parameters:
        lines.append("const real_T *given;")
    later = [f"ssGetRealDiscStates(S)[{i}] = ssGetRWork(S)[{i}];" for i in range(count)]
    name = prefix(block, real)
    start = [
        f"ssGetRealDiscStates(S)[{i}] = (real_T){name}_start.{place.partition('.')[2]};"
        for i, place in enumerate(states)
    ]
    return filled(
        TEMPLATES / "simulink.c",
        about=block_comment(_about(block, name, guards)),
        name=block.name,
        stem=name,
        parameters=len(block.parameters),
        states=count,
        inputs=len(block.inputs),
        outputs=outputs,
        start=_indented(start or ["(void)S;"]),
        declarations=_indented(lines),
        outputs_body=_indented(body),
        update=_indented(later or ["(void)S;"]),
    )


def _given(block: Block, real: Real) -> list[str]:
    """Return statements that get states, parameters and inputs from Simulink."""
    cast = "" if real.size == 8 else f"({real.name})"
    name, lines = prefix(block, real), list[str]()
    for i, place in enumerate(fields(block, "state")):
        lines.append(f"{place} = {cast}ssGetRealDiscStates(S)[{i}];")
    if block.parameters:
        lines += [
            f"param = {name}_default;",
            "if (mxGetNumberOfElements(ssGetSFcnParam(S, 1)) == PARAMETERS) {",
            "    given = mxGetPr(ssGetSFcnParam(S, 1));",
            *(f"    {p} = {cast}given[{i}];" for i, p in enumerate(fields(block, "param"))),
            "}",
        ]
        if any(v.name == "h" for v in block.parameters):
            lines.append(f"param.h = {cast}mxGetScalar(ssGetSFcnParam(S, 0));")
    for i, place in enumerate(fields(block, "in")):
        lines.append(f"{place} = {cast}ssGetInputPortRealSignal(S, {i})[0];")
    return lines


def _shown(block: Block, guards: bool) -> list[str]:
    """Return statements that pass the outputs, and the status, to Simulink."""
    places = [*fields(block, "out"), *(["status"] if guards else [])]
    return [f"ssGetOutputPortRealSignal(S, {i})[0] = (real_T){p};" for i, p in enumerate(places)]


def _about(block: Block, name: str, guards: bool) -> list[str]:
    """Return the head of the file: build instructions and ports."""
    ports = [f"{v.name} [{v.unit}]" for v in block.inputs]
    shown = [f"{n} [{o.unit}]" for n, o in block.outputs.items()] + ["status"] * guards
    order = ", ".join(v.name for v in block.parameters) or "none"
    h = block.sample_time
    said = "" if h is None or "h" not in block.constants else f" It must be {h:g} s."
    return [
        *banner(block, f"{block.name}_sfun.c"),
        "",
        "S-function of level 2 in plain C. In MATLAB:",
        f"    mex {block.name}_sfun.c {name}.c",
        f"and in the block S-Function the name {block.name}_sfun with the arguments h, []. For a",
        f"build for a target (dSPACE, Speedgoat) add {name} to its S-function modules: sources are",
        "sufficient.",
        f"Arguments: sample time [s].{said}",
        f"    Parameters, [] for the defaults, tunable, in the order {order}.",
        f"Inputs: {', '.join(ports) or 'none'}.",
        f"Outputs: {', '.join(shown) or 'none'}. States are discrete states of the block.",
    ]


def _indented(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def cmake(block: Block, reals: Sequence[Real]) -> str:
    """Return the text of NAME_block.cmake: a static and a shared library, and unit tests."""
    stems = [prefix(block, real) for real in reals]
    tests = [f"{stem}_test" for stem in stems]
    return filled(
        TEMPLATES / "block.cmake",
        name=block.name,
        sources=" ".join(f'"${{CMAKE_CURRENT_LIST_DIR}}/{stem}.c"' for stem in stems),
        tests=f"unit test{'s' * (len(tests) > 1)} {', '.join(tests)}",
        each=" ".join(tests),
    )
