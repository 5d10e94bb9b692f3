"""Guards in generated C: invalid inputs never crash a step, and always set a bit of its status.

    inputs       outside their range: clamped to it; not finite: their start value, a safe one
    step size    as inputs, the default in place of values that are not finite
    states       beyond `HUGE` times their nominal value, or not finite: all restart
    parameters   outside their ranges: the default set is used
    outputs      still not finite: 0, and all states restart

A bit of the status that a step returns (`Status`) reports each change; a number within its range is
not changed, nor is a state that is too large for the present load, such as a bristle after the load
fell. Numbers are compared by their bits, as integers: that is as cheap as floats, and works under
-ffast-math, too, where a compiler assumes that NaN does not exist.

`symfric.codegen.runner.GuardModel` does the same in NumPy, for the comparison with CasADi.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag
from math import isfinite
from typing import final

import numpy as np

from symfric.codegen.blocks.block import Block
from symfric.codegen.layout import TEMPLATES, Member, filled, members, places, prefix
from symfric.emitter.c99 import Real
from symfric.foundation.parameters import Variable

WIDE = 1e6
"""Limit of an input without bounds, relative to its nominal value."""

HUGE = 1e10
"""Limit of a state, relative to its nominal value, beyond which it is invalid."""

SHORTEST, LONGEST = 1e-9, 1e3
"""Range of a step size that is a parameter [s]."""

TOP = 1e30
"""Largest bound of a range: squares of half of it are finite in float."""

STEP_SIZE = "h"


class Status(IntFlag):
    """Status bits for repairs by a step; 0 if there are none."""

    CLAMPED = 1
    NOT_FINITE = 2
    STATE = 4
    PARAMETER = 8
    OUTPUT = 16


MEANING = {
    Status.CLAMPED: "an input was outside its range and has been clamped",
    Status.NOT_FINITE: "an input was not finite and has been replaced, see above",
    Status.STATE: "a state was not finite or absurd; all have restarted",
    Status.PARAMETER: "step size clamped, or the default parameters used",
    Status.OUTPUT: "a result was not finite; outputs are 0, states have restarted",
}


@final
@dataclass(frozen=True)
class Range:
    """Closed range of a number, and the value that replaces one that is not finite."""

    low: float
    high: float
    safe: float


def range_of(variable: Variable) -> Range:
    """Return the range of an input: its bounds, by default `WIDE` times its nominal value.

    The safe value is its start value, by default 0.
    """
    wide = WIDE * variable.nominal
    start = float(variable.start)
    return _range(variable, -wide, wide, min(max(start, variable.lower), variable.upper))


def parameter_range(variable: Variable) -> Range:
    """Return the range of a parameter: its bounds, by default `WIDE` times its default.

    The step size h has `SHORTEST` ... `LONGEST`. A default is always within its range.
    """
    start = float(variable.start)
    if variable.name == STEP_SIZE:
        return Range(min(SHORTEST, start), max(LONGEST, start), start)
    wide = WIDE * max(variable.nominal, 1.0)
    return _range(variable, -wide, wide, start)


def _range(variable: Variable, low: float, high: float, safe: float) -> Range:
    low = variable.lower if isfinite(variable.lower) else min(low, variable.upper, safe)
    high = variable.upper if isfinite(variable.upper) else max(high, variable.lower, safe)
    low = 0.0 if abs(low) < 1 / TOP else max(low, -TOP)
    return Range(low, min(high, TOP), safe)


def state_limit(variable: Variable) -> float:
    """Return the magnitude beyond which a state is invalid."""
    return min(HUGE * max(variable.nominal, abs(float(variable.start))), TOP)


def constants(block: Block, real: Real) -> str:
    """Return the bits of the status as macros for the header."""
    stem = prefix(block, real).upper()
    kinds = [s for s in Status if block.states or s != Status.STATE]
    kinds = [s for s in kinds if block.parameters or s != Status.PARAMETER]
    width = max(len(s.name or "") for s in kinds)
    meaning = dict(MEANING)
    if not block.states:
        meaning[Status.OUTPUT] = "a result was not finite; outputs are 0"
    return "".join(
        f"#define {stem}_{s.name:<{width}} {s.value}u /* {meaning[s]} */\n" for s in kinds
    )


def bit(block: Block, real: Real, status: Status) -> str:
    """Return the macro of one bit."""
    return f"{prefix(block, real).upper()}_{status.name}"


def helpers(block: Block, real: Real, text: str) -> str:
    """Return the static functions that `text`, the guarded functions of a block, calls."""
    name = prefix(block, real)
    own = {"unfit": _unfit(block, real), "lost": _lost(block, real)}
    general = filled(
        TEMPLATES / "guards.c",
        name=name,
        real=real.name,
        whole=f"uint{8 * real.size}_t",
        magnitude="UINT32_C(0x7FFFFFFF)" if real.size == 4 else "UINT64_C(0x7FFFFFFFFFFFFFFF)",
        infinite="UINT32_C(0x7F800000)" if real.size == 4 else "UINT64_C(0x7FF0000000000000)",
    )
    general_parts = dict(
        zip(("bits", "beyond", "outside", "mended"), general.rstrip().split("\n\n"), strict=True)
    )
    needed: list[str] = []
    for what, body in reversed((general_parts | own).items()):
        if f"{name}_{what}(" in text + "".join(needed):
            needed.insert(0, body + "\n\n")
    return "".join(needed)


def _outside(name: str, real: Real, place: str, low: float, high: float) -> str:
    """Return the condition that the number at `place` is outside its range, or NaN."""
    least, most = real.literal(low), real.literal(high)
    if low >= 0.0:
        return f"{name}_outside({place}, {least}, {most})"
    if low == -high:
        return f"{name}_beyond({place}, {most})"
    widest = real.literal(max(-low, abs(high)))
    return f"{name}_beyond({place}, {widest}) || {place} < {least} || {place} > {most}"


def mended(block: Block, real: Real, variable: Variable, group: str, status: str) -> list[str]:
    """Return statements that bring a local, an input or the step size, into its range.

    Args:
        group: "in" or "param".
        status: the pointer to the status.
    """
    name, local = prefix(block, real), variable.name
    if group == "in":
        within, kinds = range_of(variable), (Status.CLAMPED, Status.NOT_FINITE)
    else:
        within, kinds = parameter_range(variable), (Status.PARAMETER, Status.PARAMETER)
    numbers = ", ".join(real.literal(x) for x in (within.low, within.high, within.safe))
    said = ", ".join(bit(block, real, kind) for kind in kinds)
    return [
        f"if ({_outside(name, real, local, within.low, within.high)}) {{",
        f"    {local} = {name}_mended({local}, {numbers}, {said}, {status});",
        "}",
    ]


def fit_parameters(block: Block, real: Real, status: str) -> list[str]:
    """Return statements that use the default parameters if one is out of range."""
    name = prefix(block, real)
    if all(v.name == STEP_SIZE for v in block.parameters):
        return []
    return [
        f"if (param != &{name}_default && {name}_unfit(param)) {{",
        f"    param = &{name}_default;",
        f"    {_said(block, real, Status.PARAMETER, status)}",
        "}",
    ]


def found_states(block: Block, real: Real, status: str) -> list[str]:
    """Return statements that restart all states if one of them is invalid."""
    if not block.states:
        return []
    name = prefix(block, real)
    return [
        f"if ({name}_lost(state)) {{",
        f"    *state = {name}_start;",
        f"    {_said(block, real, Status.STATE, status)}",
        "}",
    ]


def finite_outputs(block: Block, real: Real, status: str) -> list[str]:
    """Return statements that replace outputs that are not finite by 0."""
    name, said = prefix(block, real), _said(block, real, Status.OUTPUT, status)
    most = real.literal(float(np.finfo(real.kind).max))
    if block.is_function:
        (shown,) = block.outputs
        bad = f"if ({name}_beyond({shown}, {most})) {{"
        return [bad, f"    {said}", f"    return {real.literal(0.0)};", "}", f"return {shown};"]
    shown = places(block, "out")
    if not shown:
        return []
    restart = [f"    *state = {name}_start;"] if block.states else []
    return [
        f"if ({' || '.join(f'{name}_beyond(out->{place}, {most})' for place in shown)}) {{",
        *(f"    out->{place} = {real.literal(0.0)};" for place in shown),
        *restart,
        f"    {said}",
        "}",
    ]


def _said(block: Block, real: Real, kind: Status, status: str) -> str:
    """Return the statement that adds a bit to the status that a pointer shows."""
    place = status.removeprefix("&") if status.startswith("&") else f"*{status}"
    return f"{place} |= {bit(block, real, kind)};"


def _unfit(block: Block, real: Real) -> str:
    """Return the function that is true if a parameter is out of its range."""
    name = prefix(block, real)
    ranges = {v.name: parameter_range(v) for v in block.parameters}
    limits = [ranges[v.name] for v in block.parameters]
    rows = [m for m in members(block).get("param", ()) if m.name != STEP_SIZE]
    conditions = [(m, [(r.low, r.high) for r in limits[m.first : m.first + m.count]]) for m in rows]
    return _any(
        f"/* Returns true if a parameter is outside its range. */\n"
        f"static bool {name}_unfit(const {name}_param_t *param)",
        name, real, "param", conditions,
    )  # fmt: skip


def _lost(block: Block, real: Real) -> str:
    """Return the function that is true if a state is invalid."""
    name = prefix(block, real)
    limits = [state_limit(v) for v in block.states]
    rows = members(block).get("state", ())
    conditions = [(m, [(-x, x) for x in limits[m.first : m.first + m.count]]) for m in rows]
    return _any(
        f"/* Returns true if a state is absurd or not finite. */\n"
        f"static bool {name}_lost(const {name}_state_t *state)",
        name, real, "state", conditions,
    )  # fmt: skip


def _any(
    head: str,
    name: str,
    real: Real,
    group: str,
    rows: Sequence[tuple[Member, Sequence[tuple[float, float]]]],
) -> str:
    """Return a function that is true if one of the members is outside its range; loops for
    arrays.
    """
    single: list[str] = []
    loops: list[str] = []
    for member, ranges in rows:
        if member.size and len(set(ranges)) == 1:
            place = f"{group}->{member.name}[i]"
            loops += [
                f"    for (i = 0; i < {member.size}; i++) {{",
                f"        if ({_outside(name, real, place, *ranges[0])}) {{",
                "            return true;",
                "        }",
                "    }",
            ]
            continue
        single += [
            _outside(name, real, f"{group}->{place}", *limits)
            for place, limits in zip(member.places, ranges, strict=True)
        ]
    joined = "\n        || ".join(single) if single else "false"
    count = ["    int i;"] if loops else []
    return "\n".join([head, "{", *count, *loops, f"    return {joined};", "}"])
