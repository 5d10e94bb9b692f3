"""Export package of a block: unit test, build files and wrappers for other tools.

A unit test in plain C verifies the code on its target machine, with test vectors as a header and as
CSV; CMake builds libraries and tests; a Python loader and a Simulink S-function call the C. The
folder `templates` contains the fixed text of these files.
"""

import csv
import io
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import GROUPS, TEMPLATES, CBlock, banner, head
from symfric.codegen.vectors import BASE, PARAMETER_SHARE, ROUNDINGS, Vectors, vectors
from symfric.emitter.c99 import Real, comment, filled, folded, indented


def kit_files(several: Sequence[CBlock]) -> dict[str, str]:
    """Return the texts of all files except header and source, by file name.

    Args:
        several: the block in each of its types.
    """
    texts, block = dict[str, str](), several[0].block
    for c in several:
        rows = vectors(c)
        texts[f"{c.name}_test.c"] = unit_test(c)
        texts[f"{c.name}_vectors.h"] = vector_header(rows)
        texts[f"{c.name}_vectors.csv"] = vector_table(rows)
    tests = [f"{c.name}_test" for c in several]
    texts[f"{block.name}_block.cmake"] = filled(
        TEMPLATES / "block.cmake",
        name=block.name,
        sources=" ".join(f'"${{CMAKE_CURRENT_LIST_DIR}}/{c.name}.c"' for c in several),
        tests=f"unit test{'s' * (len(tests) > 1)} {', '.join(tests)}",
        each=" ".join(tests),
    )
    texts["CMakeLists.txt"] = (TEMPLATES / "CMakeLists.txt").read_text(encoding="utf-8")
    texts[f"{block.name}_ctypes.py"] = loader(several)
    texts[f"{block.name}_sfun.c"] = wrapper(max(several, key=lambda c: c.real.size))
    return texts


def declarations(c: CBlock) -> list[str]:
    """Return the declarations of the variables `state`, `param`, `in`, `out`, `status`."""
    found = [f"{c.name}_{group}_t {group};" for group in GROUPS if group in c.block.members]
    if c.block.is_function:
        found += [f"{c.real.name} in[{len(c.block.inputs)}];"] * bool(c.block.inputs)
        found += [f"{c.real.name} out;"]
    return found + ["unsigned int status = 0u;"] * c.guards


def step(c: CBlock) -> list[str]:
    """Return the statements of one step on the variables of `declarations`."""
    call = c.call({group: f"&{group}" for group in GROUPS}, fields(c, "in"))
    if c.block.is_function:
        return [*["status = 0u;"] * c.guards, f"out = {call};"]
    return [f"{'status = ' * c.guards}{call};"]


def fields(c: CBlock, group: str) -> list[str]:
    """Return the members of a group as C expressions, such as `state.z` and `in.v`.

    Those of a function of scalars are `in[0]`, `in[1]`, ... and `out`.
    """
    if c.block.is_function and group == "in":
        return [f"in[{i}]" for i in range(len(c.block.inputs))]
    if c.block.is_function and group == "out":
        return ["out"]
    return [f"{group}.{place}" for place in c.block.places(group)]


def unit_test(c: CBlock) -> str:
    """Return the text of NAME_test.c.

    Its function returns the number of wrong results and uses neither stdio nor allocated memory.
    NAME_TEST_PRINT makes it print wrong results; NAME_TEST_NO_MAIN omits `main`.
    """
    return filled(
        TEMPLATES / "test.c",
        head=head(c.block, f"{c.name}_test.c"),
        name=c.name,
        macro=c.name.upper(),
        real=c.real.name,
        letter=c.real.letter,
        declarations=indented([*declarations(c), "int failures = 0;", "int row;"]),
        body=indented(_body(c), 2),
    )


def _body(c: CBlock) -> list[str]:
    """Return the statements for one row: set the numbers, make a step, compare the results."""
    states = fields(c, "state")
    lines = [f"{place} = vector->state[{i}];" for i, place in enumerate(states)]
    lines += [f"{place} = vector->in[{i}];" for i, place in enumerate(fields(c, "in"))]
    if c.block.parameters:
        lines += [f"param = {c.name}_default;", "switch (vector->changed) {"]
        for i, place in enumerate(fields(c, "param")):
            lines += [f"case {i}:", f"    {place} = vector->value;", "    break;"]
        lines += ["default:", "    break;", "}"]
    lines += step(c) + _compared(c, "next", states) + _compared(c, "out", fields(c, "out"))
    lines += ["failures += status != vector->status;"] * c.guards
    given = ", ".join(f"&{group}" for group in GROUPS[:3] if group in c.block.members)
    later: list[str] = []
    for k, reset in enumerate(c.block.resets):
        later.append(f"{c.name}_{reset}({given});")
        later += _compared(c, "reset", states, k * len(states))
    if later and c.guards:
        later = ["if (vector->status == 0u) {", *(f"    {x}" for x in later), "}"]
    return lines + later


def _compared(c: CBlock, what: str, places: Sequence[str], first: int = 0) -> list[str]:
    """Return statements that compare the results at `places` with those of a row."""
    of, tolerance = f"vector->{what}", f"{c.name}_{what}_tolerance"
    return [
        f"failures += {c.name}_wrong({place}, {of}[{i}], {tolerance}[{i}]);"
        for i, place in enumerate(places, start=first)
    ]


def number(value: float, real: Real) -> str:
    """Return `value` rounded to the type as C: a literal, or a macro of math.h if not finite."""
    rounded = float(real.rounded(value))
    if math.isnan(rounded):
        return "NAN"
    if math.isinf(rounded):
        return "-INFINITY" if rounded < 0 else "INFINITY"
    return real.literal(rounded)


def braces(values: Iterable[float], real: Real) -> str:
    """Return numbers as the initialiser of an array."""
    return "{" + ", ".join(number(float(value), real) for value in values) + "}"


def vector_header(found: Vectors) -> str:
    """Return the text of NAME_vectors.h: the rows as constant arrays."""
    c, block, real, steps = found.c, found.c.block, found.c.real, found.steps
    columns: list[tuple[str, list[str]]] = []  # declaration of each member, and its rows

    def add(name: str, rows: NDArray[np.float64]) -> None:
        if rows.shape[1]:
            declared = f"{real.name} {name}[{rows.shape[1]}];"
            columns.append((declared, [braces(row, real) for row in rows]))

    add("state", steps.states)
    add("in", steps.inputs)
    if block.parameters:
        values = [number(float(value), real) for value in steps.values]
        columns.append((f"{real.name} value; /* of the parameter that is changed */", values))
        about = "int changed; /* number of that parameter, -1 for none */"
        columns.append((about, [*map(str, steps.changed)]))
    ends, tolerances = np.cumsum([len(block.states), len(block.outputs)]), list[str]()
    parts = zip(np.split(found.results, ends, axis=1), np.split(found.tolerance, ends), strict=True)
    for name, (rows, tolerance) in zip(("next", "out", "reset"), parts, strict=True):
        add(name, rows)
        array = f"{real.name} {c.name}_{name}_tolerance[{tolerance.size}]"
        line = folded(f"static const {array} = {braces(tolerance, real)};", "")
        tolerances += [line] * bool(tolerance.size)
    columns += [("unsigned int status;", [f"{bits}u" for bits in found.status])] * c.guards
    members, texts = zip(*columns, strict=True)
    lines = [folded(f"{{{', '.join(row)}}},", "    ") for row in zip(*texts, strict=True)]
    return filled(
        TEMPLATES / "vectors.h",
        head=head(block, f"{c.name}_vectors.h"),
        share=f"{PARAMETER_SHARE:.0%}",
        states=comment(", ".join(v.name for v in block.states) or "none"),
        base=f"{BASE[real.size]:g}",
        roundings=f"{ROUNDINGS:g}",
        name=c.name,
        macro=c.name.upper(),
        count=len(lines),
        members=indented(members),
        tolerances="\n".join(tolerances),
        rows="\n".join(lines),
    )


def vector_table(found: Vectors) -> str:
    """Return the text of NAME_vectors.csv: the same rows, with names and units of the columns."""
    c, block = found.c, found.c.block
    names = [v.name for v in block.parameters]
    head = [f"{v.name} before [{v.unit}]" for v in block.states]
    head += [f"{v.name} [{v.unit}]" for v in block.inputs]
    head += ["changed parameter", "its value"] if names else []
    empty = [""] * (len(head) - 1)
    head += [f"{v.name} after [{v.unit}]" for v in block.states]
    head += [f"{n} [{o.unit}]" for n, o in block.outputs.items()]
    head += [f"{v.name} by {reset} [{v.unit}]" for reset in block.resets for v in block.states]
    head += ["status"] * c.guards
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerow(["tolerance", *empty, *found.tolerance.tolist(), *["0"] * c.guards])
    columns = zip(*found.steps, found.results, found.status, strict=True)
    for states, inputs, i, value, results, status in columns:
        changed = [names[i], value] if i >= 0 else ["", ""]
        numbers = [*states.tolist(), *inputs.tolist(), *(changed if names else [])]
        writer.writerow([*numbers, *results.tolist(), *[status] * c.guards])
    return text.getvalue()


def loader(several: Sequence[CBlock]) -> str:
    """Return the text of NAME_ctypes.py, whose class has `step`, `run` (on arrays) and `reset`."""
    block = several[0].block
    types = {c.real.name: c.name for c in several}
    layout = {group: [(m.name, m.size) for m in rows] for group, rows in block.members.items()}
    given = ", ".join(f"{v.name}={v.nominal:g}" for v in block.inputs)
    shown = next(iter(block.outputs), None)
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
        example=f"    block.step({given})" + (f'["{shown}"]' if shown else ""),
        types=types,
        members="".join(f"    {group!r}: {rows!r},\n" for group, rows in layout.items()),
        inputs=tuple(v.name for v in block.inputs),
        outputs=tuple(block.outputs),
        is_function=block.is_function,
        guards=several[0].guards,
        resets=tuple(block.resets),
        groups=GROUPS,
    )


def wrapper(c: CBlock) -> str:
    """Return the text of NAME_sfun.c, the Simulink S-function."""
    block, states, cast = c.block, fields(c, "state"), f"({c.real.name})" * (c.real.size == 4)
    body = [f"{place} = {cast}ssGetRealDiscStates(S)[{i}];" for i, place in enumerate(states)]
    if block.parameters:
        body += [
            f"param = {c.name}_default;",
            "if (mxGetNumberOfElements(ssGetSFcnParam(S, 1)) == PARAMETERS) {",
            "    given = mxGetPr(ssGetSFcnParam(S, 1));",
            *(f"    {p} = {cast}given[{i}];" for i, p in enumerate(fields(c, "param"))),
            "}",
        ]
        if any(v.name == "h" for v in block.parameters):
            body.append(f"param.h = {cast}mxGetScalar(ssGetSFcnParam(S, 0));")
    for i, place in enumerate(fields(c, "in")):
        body.append(f"{place} = {cast}ssGetInputPortRealSignal(S, {i})[0];")
    body += step(c)
    for i, place in enumerate([*fields(c, "out"), *["status"] * c.guards]):
        body.append(f"ssGetOutputPortRealSignal(S, {i})[0] = (real_T){place};")
    body += [f"ssGetRWork(S)[{i}] = (real_T){place};" for i, place in enumerate(states)]
    count, h = len(block.states), block.constants.get("h")
    later = [f"ssGetRealDiscStates(S)[{i}] = ssGetRWork(S)[{i}];" for i in range(count)]
    start = [
        f"ssGetRealDiscStates(S)[{i}] = (real_T){c.name}_start.{place};"
        for i, place in enumerate(block.places("state"))
    ]
    ports = ", ".join(f"{v.name} [{v.unit}]" for v in block.inputs)
    shown = [f"{n} [{o.unit}]" for n, o in block.outputs.items()] + ["status"] * c.guards
    return filled(
        TEMPLATES / "simulink.c",
        head=head(block, f"{block.name}_sfun.c"),
        fixed="" if h is None else f" It must be {h:g} s.",
        order=", ".join(v.name for v in block.parameters) or "none",
        ports=comment(ports or "none"),
        shown=comment(", ".join(shown) or "none"),
        name=block.name,
        stem=c.name,
        parameters=len(block.parameters),
        states=count,
        inputs=len(block.inputs),
        outputs=len(shown),
        start=indented(start or ["(void)S;"]),
        declarations=indented(declarations(c) + ["const real_T *given;"] * bool(block.parameters)),
        outputs_body=indented(body),
        update=indented(later or ["(void)S;"]),
    )
