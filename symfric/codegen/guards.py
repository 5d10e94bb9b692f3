"""Guards in generated C: invalid inputs never crash a step, and always set a bit of its status.

    inputs       outside their range: clamped to it; not finite: replaced by their start value
    step size    outside its range: clamped to it; not finite: replaced by its default
    states       beyond `HUGE` times their nominal value, or not finite: all states restart
    parameters   outside their ranges: replaced by the default set
    outputs      still not finite: replaced by 0, and all states restart

Each change sets a bit of the status that a step returns (`Status`). Numbers within their range are
not changed, even if a state is too large for the present load, such as a bristle deflection after
the load has fallen. The C compares the bits of numbers as integers. This is as fast as comparing
floats, and also works under -ffast-math, where compilers assume that NaN does not exist.

`symfric.codegen.runner.GuardModel` implements the guards in NumPy, for comparison with CasADi.
"""

from collections.abc import Sequence
from enum import IntFlag
from math import isfinite
from typing import NamedTuple

import numpy as np

from symfric.codegen.blocks.block import SHEET, TEMPLATES, CBlock
from symfric.emitter.c99 import filled, needed
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
    """Bits of the status of a step, one for each kind of repair; 0 if there was no repair."""

    CLAMPED = 1
    NOT_FINITE = 2
    STATE = 4
    PARAMETER = 8
    OUTPUT = 16


MEANING = {Status[name]: text for name, text in SHEET["status"].items()}


class Range(NamedTuple):
    """Closed range of a number, and the value that replaces one that is not finite."""

    low: float
    high: float
    safe: float


def range_of(variable: Variable) -> Range:
    """Return the range of an input: its bounds, by default `WIDE` times its nominal value.

    The safe value is its start value, by default 0.
    """
    wide = WIDE * variable.nominal
    return _range(variable, wide, min(max(float(variable.start), variable.lower), variable.upper))


def parameter_range(variable: Variable) -> Range:
    """Return the range of a parameter: its bounds, by default `WIDE` times its default.

    The range of the step size h is `SHORTEST` ... `LONGEST`. Each range contains the default.
    """
    start = float(variable.start)
    if variable.name == STEP_SIZE:
        return Range(min(SHORTEST, start), max(LONGEST, start), start)
    return _range(variable, WIDE * max(variable.nominal, 1.0), start)


def _range(variable: Variable, wide: float, safe: float) -> Range:
    low, high = variable.lower, variable.upper
    least = low if isfinite(low) else min(-wide, high, safe)
    most = high if isfinite(high) else max(wide, low, safe)
    return Range(0.0 if abs(least) < 1 / TOP else max(least, -TOP), min(most, TOP), safe)


def state_limit(variable: Variable) -> float:
    """Return the magnitude beyond which a state is invalid."""
    return min(HUGE * max(variable.nominal, abs(float(variable.start))), TOP)


def constants(c: CBlock) -> str:
    """Return the macros of the status bits, for the header."""
    absent = {Status.STATE: not c.block.states, Status.PARAMETER: not c.block.parameters}
    kinds = [s for s in Status if not absent.get(s)]
    meaning = dict(MEANING)
    if not c.block.states:
        meaning[Status.OUTPUT] = "a result was not finite; outputs are 0"
    width = max(len(bit(c, s)) for s in kinds)
    return "".join(f"#define {bit(c, s):<{width}} {s.value}u /* {meaning[s]} */\n" for s in kinds)


def bit(c: CBlock, status: Status) -> str:
    """Return the name of the macro of one status bit."""
    return f"{c.name.upper()}_{status.name}"


def comparisons(c: CBlock) -> dict[str, str]:
    """Return the static functions that examine single numbers, by the end of their name."""
    general = filled(
        TEMPLATES / "guards.c",
        name=c.name,
        real=c.real.name,
        whole=f"uint{8 * c.real.size}_t",
        magnitude="UINT32_C(0x7FFFFFFF)" if c.real.size == 4 else "UINT64_C(0x7FFFFFFFFFFFFFFF)",
        largest=_largest(c),
    )
    names = ("bits", "beyond", "outside", "mended")
    return dict(zip(names, general.rstrip().split("\n\n"), strict=True))


def _largest(c: CBlock) -> str:
    return c.real.literal(float(np.finfo(c.real.kind).max))


def helpers(c: CBlock, text: str) -> str:
    """Return the static functions that `text`, the guarded functions of a block, calls."""
    parts = comparisons(c)
    limits = [parameter_range(v)[:2] for v in c.block.parameters]
    parts["unfit"] = _any(c, "unfit", "a parameter is outside its range", "param", limits)
    limits = [(-state_limit(v), state_limit(v)) for v in c.block.states]
    parts["lost"] = _any(c, "lost", "a state is beyond its limit or not finite", "state", limits)
    return needed({f"{c.name}_{what}": part for what, part in parts.items()}, text)


def _outside(c: CBlock, place: str, low: float, high: float) -> str:
    """Return the C condition that the number at `place` is outside its range or NaN."""
    least, most = c.real.literal(low), c.real.literal(high)
    if low >= 0.0:
        return f"{c.name}_outside({place}, {least}, {most})"
    if low == -high:
        return f"{c.name}_beyond({place}, {most})"
    widest = c.real.literal(max(-low, abs(high)))
    return f"{c.name}_beyond({place}, {widest}) || {place} < {least} || {place} > {most}"


def _any(c: CBlock, what: str, doc: str, group: str, limits: Sequence[tuple[float, ...]]) -> str:
    """Return the C function that is true if a member of a struct is outside its range."""
    single, loops = list[str](), list[str]()
    for member in c.block.members.get(group, ()):
        ranges = limits[member.first : member.first + member.length]
        if group == "param" and member.name == STEP_SIZE:
            continue
        if member.size and len(set(ranges)) == 1:
            loops += [
                f"    for (i = 0; i < {member.size}; i++) {{",
                f"        if ({_outside(c, f'{group}->{member.name}[i]', *ranges[0])}) {{",
                "            return true;",
                "        }",
                "    }",
            ]
        else:
            places = zip(member.places, ranges, strict=True)
            single += [_outside(c, f"{group}->{place}", *within) for place, within in places]
    return "\n".join([
        f"/* Returns true if {doc}. */",
        f"static bool {c.name}_{what}(const {c.name}_{group}_t *{group})",
        "{",
        *["    int i;"] * bool(loops),
        *loops,
        "    return " + ("\n        || ".join(single) or "false") + ";",
        "}",
    ])  # fmt: skip


def mended(c: CBlock, variable: Variable, group: str) -> list[str]:
    """Return statements that bring a local variable (input or step size) into its range.

    Args:
        group: "in" or "param".
    """
    within = range_of(variable) if group == "in" else parameter_range(variable)
    kinds = (Status.CLAMPED, Status.NOT_FINITE) if group == "in" else (Status.PARAMETER,) * 2
    arguments = [*map(c.real.literal, within), *(bit(c, kind) for kind in kinds)]
    arguments.append("status" if c.block.is_function else "&status")
    local = variable.name
    return [
        f"if ({_outside(c, local, within.low, within.high)}) {{",
        f"    {local} = {c.name}_mended({local}, {', '.join(arguments)});",
        "}",
    ]


def _if(
    c: CBlock, condition: str, kind: Status, *statements: str, then: Sequence[str] = ()
) -> list[str]:
    """Return a branch with `statements`, one that sets a bit of the status, and those of `then`."""
    set_bit = f"{'*' * c.block.is_function}status |= {bit(c, kind)};"
    inside = (*statements, set_bit, *then)
    return [f"if ({condition}) {{", *(f"    {line}" for line in inside), "}"]


def fit_parameters(c: CBlock) -> list[str]:
    """Return statements that use the default parameters if one is out of range."""
    if all(v.name == STEP_SIZE for v in c.block.parameters):
        return []
    unfit = f"param != &{c.name}_default && {c.name}_unfit(param)"
    return _if(c, unfit, Status.PARAMETER, f"param = &{c.name}_default;")


def found_states(c: CBlock) -> list[str]:
    """Return statements that restart all states if one of them is invalid."""
    if not c.block.states:
        return []
    return _if(c, f"{c.name}_lost(state)", Status.STATE, f"*state = {c.name}_start;")


def finite_outputs(c: CBlock) -> list[str]:
    """Return statements that replace outputs that are not finite by 0."""
    zero, most = c.real.literal(0.0), _largest(c)
    if c.block.is_function:
        (shown,) = c.block.outputs
        bad = _if(c, f"{c.name}_beyond({shown}, {most})", Status.OUTPUT, then=[f"return {zero};"])
        return [*bad, f"return {shown};"]
    places = c.block.places("out")
    if not places:
        return []
    bad = " || ".join(f"{c.name}_beyond(out->{place}, {most})" for place in places)
    repaired = [f"out->{place} = {zero};" for place in places]
    repaired += [f"*state = {c.name}_start;"] * bool(c.block.states)
    return _if(c, bad, Status.OUTPUT, *repaired)
