"""Names and structs of a block in one floating point type, and shared pieces of C.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types may be used in one program. Nothing is allocated and the only data are the constant
defaults, so one block serves any number of joints.

Numbers of identical elements that are next to each other, such as the states F_1 ... F_10, are one
array member, `float F[10]`. In memory a struct is the flat column of the block's variables.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from string import Template
from textwrap import wrap
from typing import final

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.emitter.c99 import Real
from symfric.emitter.rolling import Array, Arrays


@final
@dataclass(frozen=True)
class Member:
    """Member of a struct.

    Attributes:
        name: C identifier.
        unit: of each number.
        doc: description, may be "".
        first: row of its first number in the flat struct.
        size: 0 for a single number, else the length of the array.
    """

    name: str
    unit: str
    doc: str
    first: int
    size: int = 0

    @property
    def declared(self) -> str:
        """Declaration, such as `F[10]`."""
        return f"{self.name}[{self.size}]" if self.size else self.name

    @property
    def count(self) -> int:
        """Number of its values."""
        return max(self.size, 1)

    @property
    def places(self) -> tuple[str, ...]:
        """C expressions of its numbers: `F[0]`, `F[1]`, ..."""
        if not self.size:
            return (self.name,)
        return tuple(f"{self.name}[{i}]" for i in range(self.size))


def prefix(block: Block, real: Real) -> str:
    """Return the prefix of all names of a block in one type, and of its files."""
    return f"{block.name}_{real.suffix}"


def members(block: Block) -> dict[str, tuple[Member, ...]]:
    """Return struct -> its members; empty structs are left out."""
    variables = {"state": block.states, "param": block.parameters, "in": block.inputs}
    flat = {group: [(v.name, v.unit, v.doc) for v in of] for group, of in variables.items()}
    flat["out"] = [(name, output.unit, output.doc) for name, output in block.outputs.items()]
    if block.is_function:
        del flat["in"], flat["out"]
    return {group: tuple(_members(block, group, rows)) for group, rows in flat.items() if rows}


def _members(block: Block, group: str, rows: Sequence[tuple[str, str, str]]) -> Iterator[Member]:
    first = {a.first: a for a in block.arrays if a.group == group}
    i = 0
    while i < len(rows):
        name, unit, doc = rows[i]
        if i in first:
            name, size = first[i].name, first[i].size
            same = all(row[2] == doc for row in rows[i : i + size])
            doc = f"{doc}, of each element".removeprefix(", ") if same else "of each element"
            yield Member(name, unit, doc, i, size)
            i += size
        else:
            yield Member(name, unit, doc, i)
            i += 1


def places(block: Block, group: str) -> tuple[str, ...]:
    """Return the numbers of a struct in the block's order, as C writes them behind `state->`."""
    return tuple(place for member in members(block).get(group, ()) for place in member.places)


def indexed(block: Block, results: Sequence[str], guards: bool) -> Arrays:
    """Return arrays that loops may index: those of the structs in the order of `GROUPS`.

    Args:
        results: the structs that the results of the function are written to.
        guards: True if inputs are repaired in locals, one by one; no loop may read the originals.
    """
    mended = {"in"} if guards else set[str]()

    def of(groups: Sequence[str]) -> tuple[Array, ...]:
        return tuple(
            Array(number, member.first, member.size, f"{group}->{member.name}")
            for number, group in enumerate(groups)
            for member in members(block).get(group, ())
            if member.size and group not in mended
        )

    return Arrays(of(GROUPS[:3]), of(results))


WIDTH = 100

TEMPLATES = Path(__file__).with_name("templates")
"""Folder of the fixed text of generated files."""


class _AtTemplate(Template):
    """Template with placeholders @name, since $ has a meaning in CMake."""

    delimiter = "@"


def filled(template: Path, **values: object) -> str:
    """Return the text of a template file with a value in each placeholder @name."""
    return _AtTemplate(template.read_text(encoding="utf-8")).substitute(values)


def banner(block: Block, file: str) -> list[str]:
    """Return the first lines of a file: generator and licence."""
    return [
        f"{file}: C99 made by symfric {version('symfric')} with CasADi {version('casadi')}, "
        f"model {block.fingerprint}.",
        "This generated code is yours. SPDX-License-Identifier: MIT-0",
    ]


def block_comment(lines: Sequence[str]) -> str:
    """Return lines of text as one comment."""
    return "/* " + "\n".join(f" * {comment(line)}".rstrip() for line in lines)[3:] + "\n */"


def comment(text: str) -> str:
    """Return text that cannot end the comment that contains it."""
    return text.replace("*/", "* /").replace("/*", "/ *")


def folded(line: str, margin: str) -> str:
    """Return a long line broken at blanks, with deeper indentation."""
    margin += " " * (len(line) - len(line.lstrip(" ")))
    return "\n".join(
        wrap(
            line.lstrip(" "),
            WIDTH,
            initial_indent=margin,
            subsequent_indent=margin + "    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    )


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


def declarations(block: Block, real: Real) -> list[str]:
    """Return the declared variables `state`, `param`, `in`, `out` of a step."""
    name = prefix(block, real)
    found = [f"{name}_{group}_t {group};" for group in GROUPS if group in members(block)]
    if block.is_function:
        found += [f"{real.name} in[{len(block.inputs)}];"] if block.inputs else []
        found += [f"{real.name} out;"]
    return found


def called(
    block: Block,
    real: Real,
    guards: bool,
    pointers: Mapping[str, str],
    inputs: Sequence[str],
    status: str = "&status",
) -> str:
    """Return the call of one step.

    Args:
        pointers: to each struct, by group.
        inputs: arguments of a function of scalars.
        status: pointer to the status, to which a guarded function of scalars adds its bits.
    """
    structs = [pointers[group] for group in GROUPS if group in members(block)]
    if block.is_function:
        arguments = [*inputs, *structs, *([status] if guards else [])]
        return f"{prefix(block, real)}({', '.join(arguments)})"
    return f"{prefix(block, real)}_step({', '.join(structs)})"


def step(block: Block, real: Real, guards: bool) -> list[str]:
    """Return the statements of one step on the variables of `declarations`; guards set `status`."""
    call = called(
        block, real, guards, {group: f"&{group}" for group in GROUPS}, fields(block, "in")
    )
    if block.is_function:
        return [*["status = 0u;"] * guards, f"out = {call};"]
    return [f"{'status = ' * guards}{call};"]


def fields(block: Block, group: str) -> list[str]:
    """Return the numbers of a group as C expressions: `state.z`, `in.v`, of a function `in[0]`,
    `out`.
    """
    if block.is_function and group == "in":
        return [f"in[{i}]" for i in range(len(block.inputs))]
    if block.is_function and group == "out":
        return ["out"]
    return [f"{group}.{place}" for place in places(block, group)]
