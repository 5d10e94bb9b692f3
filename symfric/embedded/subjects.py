"""What is measured: our C of a block, or CasADi's own C of the same step, and how to call it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

import casadi as ca
import numpy as np

from symfric.codegen.blocks.block import Block
from symfric.codegen.header import header
from symfric.codegen.layout import called, prefix
from symfric.codegen.routines import source
from symfric.emitter.c99 import REALS
from symfric.foundation.files import write_text

BY = ("symfric", "casadi", "casadi, functions of float")
"""Who writes the C: we; CasADi, whose code of float calls tanh, exp, fmax of double; CasADi with a
header before it that maps them to those of float."""

_MATH = (
    *("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos"),
    *("cosh", "erf", "exp", "expm1", "fabs", "floor", "fmax", "fmin", "fmod", "hypot", "log"),
    *("log1p", "pow", "sin", "sinh", "sqrt", "tan", "tanh"),
)


@final
@dataclass(frozen=True, eq=False)
class Subject:
    """Code with one step of a block in it.

    Attributes:
        source: the file to compile.
        parts: of the main program, the places of `sources/measured.c`.
    """

    source: Path
    parts: Mapping[str, str]


def own(block: Block, real: str, folder: Path, *, guards: bool) -> Subject:
    """Our C, written into `folder`, and its call."""
    name, kind = prefix(block, REALS[real]), REALS[real]
    write_text(folder / f"{name}.h", header(block, kind, guards))
    write_text(folder / f"{name}.c", source(block, kind, guards))
    pointers = {
        "state": "&state",
        "param": f"&{name}_default",
        "in": f"(const {name}_in_t *)U[k]",
        "out": f"({name}_out_t *)(Y[k] + {len(block.states)})",
    }
    inputs = [f"U[k][{i}]" for i in range(len(block.inputs))]
    step = called(block, kind, guards, pointers, inputs)
    declarations, start, keep = ["unsigned int status;"], "status = 0u;", "(void)k;"
    if block.states:
        declarations.append(f"{name}_state_t state;")
        start += f" {name}_init(&state, &{name}_start);"
        keep = "memcpy(Y[k], &state, sizeof state);"
    sizes = [f"sizeof({name}_state_t)"] * bool(block.states)
    sizes += [f"sizeof({name}_param_t)"] * bool(block.parameters)
    return Subject(
        folder / f"{name}.c",
        {
            "include": f'#include "{name}.h"',
            "declarations": "\n".join(f"static {line}" for line in declarations),
            "start": start,
            "step": f"{'Y[k][0] = ' if block.is_function else 'status |= ' * guards}{step};",
            "keep": keep,
            "data": " + ".join(sizes) or "0u",
        },
    )


def by_casadi(block: Block, real: str, folder: Path, *, functions_of_float: bool) -> Subject:
    """CasADi's C of the same step, written into `folder`."""
    options = {
        "casadi_real": real,
        "casadi_int": "int",
        "static_aux": True,
        "include_math": not functions_of_float,
    }
    generator = ca.CodeGenerator("casadi_step", options)
    generator.add(block.step)
    text = generator.dump()
    if functions_of_float:
        renamed = "".join(f"#define {name} {name}f\n" for name in _MATH)
        text = f"#include <math.h>\n{renamed}\n{text}"
    write_text(folder / "casadi_step.c", text)
    return Subject(folder / "casadi_step.c", _casadi_parts(block, real))


def _casadi_parts(block: Block, real: str) -> dict[str, str]:
    f, n = block.step, len(block.states)
    p, x = (
        literals(np.array([v.start for v in group] or [0.0], dtype=float), real)
        for group in (block.parameters, block.states)
    )
    static = [
        f"const {real} X0[] = {{{x}}}, P[] = {{{p}}};",
        f"{real} X[{n + 1}], XN[{n + 1}], W[{f.sz_w() + 1}];",
        f"int IW[{f.sz_iw() + 1}];",
        f"const {real} *ARG[{f.sz_arg()}];",
        f"{real} *RES[{f.sz_res()}];",
    ]
    prototype = f"int step(const {real} **arg, {real} **res, int *iw, {real} *w, int mem);\n"
    return {
        "include": "",
        "declarations": prototype + "\n".join(f"static {line}" for line in static),
        "start": "memcpy(X, X0, sizeof X0);",
        "step": f"ARG[0] = X; ARG[1] = P; ARG[2] = U[k]; RES[0] = XN; RES[1] = Y[k] + {n}; "
        f"step(ARG, RES, IW, W, 0); memcpy(X, XN, {n} * sizeof X[0]);",
        "keep": f"memcpy(Y[k], X, {n} * sizeof X[0]);",
        "data": "sizeof X + sizeof XN + sizeof W + sizeof IW + sizeof ARG + sizeof RES + sizeof P",
    }


def literals(values: np.ndarray, real: str) -> str:
    """Numbers as constants of C."""
    form = "{:.9e}f" if real == "float" else "{:.17e}"
    return ", ".join(form.format(float(value)) for value in values)
