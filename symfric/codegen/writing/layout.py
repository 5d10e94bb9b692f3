"""Names and structs of a block in one floating point type.

Names begin with block and type: struct types `NAME_f32_state_t` (likewise param, in, out), default
parameters `NAME_f32_default`, functions `NAME_f32_init`, `NAME_f32_step`; `f64` for double, so that
both types live in one program. Nothing is allocated and no data but the constant defaults exist,
so one block serves any number of joints.

Numbers of alike elements that stand next to each other, such as the states F_1 ... F_10, are one
array member, `float F[10]`. In memory a struct is the flat column of the block's variables.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import final

from symfric.codegen.blocks.block import GROUPS, Block
from symfric.emitter.arrays import Arrays
from symfric.emitter.c99 import Real
from symfric.emitter.rolling import Array


@final
@dataclass(frozen=True)
class Member:
    """One member of a struct.

    Attributes:
        name: C identifier.
        unit: of each number.
        doc: what it is, "" where nobody has said.
        first: row of its first number in the flat struct.
        size: 0 for a single number, else how many an array holds.
    """

    name: str
    unit: str
    doc: str
    first: int
    size: int = 0

    @property
    def declared(self) -> str:
        """As in a declaration: `F[10]`."""
        return f"{self.name}[{self.size}]" if self.size else self.name

    @property
    def count(self) -> int:
        """How many numbers it holds."""
        return max(self.size, 1)

    @property
    def places(self) -> tuple[str, ...]:
        """Its numbers as C writes them: `F[0]`, `F[1]`, ..."""
        if not self.size:
            return (self.name,)
        return tuple(f"{self.name}[{i}]" for i in range(self.size))


def prefix(block: Block, real: Real) -> str:
    """What all names of a block in one type begin with; also the name of its files."""
    return f"{block.name}_{real.suffix}"


def members(block: Block) -> dict[str, tuple[Member, ...]]:
    """Struct -> its members; empty structs are left out."""
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
    """The numbers of a struct in the block's order, as C writes them behind `state->`."""
    return tuple(place for member in members(block).get(group, ()) for place in member.places)


def indexed(block: Block, results: Sequence[str], guards: bool) -> Arrays:
    """What loops may index: the arrays of the structs in the order of `GROUPS`.

    Args:
        results: the structs that the results of the function are written to.
        guards: inputs are mended in locals, one by one; no loop may read them past these.
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
