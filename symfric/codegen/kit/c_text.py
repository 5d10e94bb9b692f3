"""Pieces of C that several files of a kit share."""

import math
from collections.abc import Iterable

import numpy as np

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.codegen.writing.layout import members, places, prefix
from symfric.emitter.c99 import Real


def number(value: float, real: Real) -> str:
    """`value` rounded to the type as C: a literal, or a macro of math.h for what is not finite."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = float(np.float32(value)) if real.size == 4 else value
    if math.isnan(rounded):
        return "NAN"
    if math.isinf(rounded):
        return "-INFINITY" if rounded < 0 else "INFINITY"
    return real.literal(rounded)


def braces(values: Iterable[float], real: Real) -> str:
    """Numbers as the initialiser of an array."""
    return "{" + ", ".join(number(float(value), real) for value in values) + "}"


def declarations(block: Block, real: Real) -> list[str]:
    """Variables `state`, `param`, `in`, `out` of a step, those that there are."""
    name = prefix(block, real)
    found = [f"{name}_{group}_t {group};" for group in GROUPS if group in members(block)]
    if block.is_function:
        found += [f"{real.name} in[{len(block.inputs)}];"] if block.inputs else []
        found += [f"{real.name} out;"]
    return found


def step(block: Block, real: Real, guards: bool) -> str:
    """The statement of one step on the variables of `declarations`; with guards sets `status`."""
    name = prefix(block, real)
    present = [f"&{group}" for group in GROUPS if group in members(block)]
    if block.is_function:
        arguments = [f"in[{i}]" for i in range(len(block.inputs))] + present
        arguments += ["&status"] if guards else []
        start = "status = 0u;\n" if guards else ""
        return f"{start}out = {name}({', '.join(arguments)});"
    return f"{'status = ' if guards else ''}{name}_step({', '.join(present)});"


def fields(block: Block, group: str) -> list[str]:
    """The numbers of a group as C writes them: `state.z`, `in.v`, of a function `in[0]`, `out`."""
    if block.is_function and group == "in":
        return [f"in[{i}]" for i in range(len(block.inputs))]
    if block.is_function and group == "out":
        return ["out"]
    return [f"{group}.{place}" for place in places(block, group)]
