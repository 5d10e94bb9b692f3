"""Variables of alike elements, such as k_1 ... k_10, as arrays.

Names tell what may belong together, the graph of the step what does: only what a loop reads or
writes becomes an array, and a block without loops stays as it is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import final

from symfric.codegen.blocks.block import GROUPS, RESERVED, Block, Elements
from symfric.emitter.arrays import Arrays
from symfric.emitter.rolling import LEAST, Array
from symfric.foundation.graph import graph
from symfric.model import Variables


@final
@dataclass(frozen=True)
class Family:
    """Variables of one group whose names differ in a number that counts from 1.

    Attributes:
        name: of the array: that of the variables without the number.
        rows: of the variables, in the order of their numbers.
    """

    name: str
    rows: tuple[int, ...]

    @property
    def contiguous(self) -> bool:
        """Whether the rows follow each other."""
        return self.rows == tuple(range(self.rows[0], self.rows[0] + len(self.rows)))


def arranged(block: Block) -> Block:
    """The block with its alike elements as arrays, and the parameters of an array side by side.

    Their names differ in one number (F_1, F_2, ... or k_1_pos, k_2_pos, ...); units and ranges are
    the same. States keep their order, which an array must follow; inputs, which are guarded one by
    one, have no arrays.
    """
    found = {
        "state": [f for f in families(block.states) if f.contiguous],
        "param": families(block.parameters),
    }
    if not any(found.values()):
        return block
    used = _used(_with(block, found))
    return _with(
        block,
        {
            group: [f for f in several if (group, f.name) in used]
            for group, several in found.items()
        },
    )


def families(variables: Variables) -> list[Family]:
    """All families of `LEAST` and more, each variable in one at most: that of nearest rows."""
    numbered: dict[tuple[int, tuple[str, ...]], dict[int, int]] = {}
    for row, variable in enumerate(variables):
        parts = variable.name.split("_")
        for place, part in enumerate(parts):
            if place and part.isdecimal() and part == str(int(part)):
                key = place, (*parts[:place], *parts[place + 1 :])
                numbered.setdefault(key, {})[int(part)] = row
    possible: list[Family] = []
    for (_, parts), rows in numbered.items():
        alike = {(v.unit, v.lower, v.upper) for v in (variables[row] for row in rows.values())}
        if len(rows) >= LEAST and sorted(rows) == [*range(1, len(rows) + 1)] and len(alike) == 1:
            possible.append(Family("_".join(parts), tuple(rows[n] for n in sorted(rows))))
    taken: set[int] = set()
    names = {v.name for v in variables} | RESERVED
    found: list[Family] = []
    for family in sorted(possible, key=lambda f: f.rows[-1] - f.rows[0]):
        if taken.isdisjoint(family.rows):
            taken.update(family.rows)
            name = family.name
            while name in names:
                name += "s"
            names.add(name)
            found.append(Family(name, family.rows))
    return sorted(found, key=lambda f: f.rows)


def _with(block: Block, found: Mapping[str, Sequence[Family]]) -> Block:
    """The block with these arrays."""
    arrays = [Elements("state", f.name, f.rows[0], len(f.rows)) for f in found["state"]]
    first = {family.rows[0]: family for family in found["param"]}
    members = {row for family in found["param"] for row in family.rows}
    order: list[int] = []
    for row in range(len(block.parameters)):
        if row in first:
            family = first[row]
            arrays.append(Elements("param", family.name, len(order), len(family.rows)))
            order += family.rows
        elif row not in members:
            order.append(row)
    parameters = tuple(block.parameters[row] for row in order)
    return replace(block, parameters=parameters, arrays=tuple(arrays))


def _used(block: Block) -> set[tuple[str, str]]:
    """(group, name) of the arrays that loops of the step read or write."""

    def of(groups: Sequence[str]) -> tuple[Array, ...]:
        return tuple(
            Array(groups.index(a.group), a.first, a.size, f"{a.group}->{a.name}")
            for a in block.arrays
            if a.group in groups
        )

    used = Arrays(of(GROUPS[:3]), of(("state",))).used(graph(block.step))
    texts = {array.text for array in (*used.read, *used.written)}
    return {(a.group, a.name) for a in block.arrays if f"{a.group}->{a.name}" in texts}
