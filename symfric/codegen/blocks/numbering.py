"""Variables of joints, numbered, and as arrays in C: q_1 ... q_6 are `float q[6]`."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from re import fullmatch

from symfric.codegen.blocks.block import Block, Elements
from symfric.foundation.parameters import Variable
from symfric.model import Variables


def numbered(groups: Sequence[Variables], labels: Sequence[str]) -> tuple[Variables, list[int]]:
    """Variables of several joints, those of one name together: mu_s_1, mu_s_2, ..., mu_d_1, ...

    Args:
        groups: the variables of each joint.
        labels: number of each joint, or another name.

    Returns:
        The variables, and the place of each among all of `groups`, one group behind the other.
    """
    every = [(v, label) for group, label in zip(groups, labels, strict=True) for v in group]
    found: list[Variable] = []
    order: list[int] = []
    for stem in dict.fromkeys(v.name for v, _ in every):
        alike = [(_rank(label), i) for i, (v, label) in enumerate(every) if v.name == stem]
        for _, i in sorted(alike):
            variable, label = every[i]
            found.append(replace(variable, name=f"{stem}_{label}"))
            order.append(i)
    return tuple(found), order


def _rank(label: str) -> tuple[bool, int]:
    """Numbers in their order, names behind them as they come."""
    return (False, int(label)) if label.isdecimal() else (True, 0)


def in_arrays(block: Block) -> Block:
    """The block with neighbours as arrays that count from 1 and have one unit and one range."""
    outputs = [(name, output.unit) for name, output in block.outputs.items()]
    groups = {
        "state": [(v.name, (v.unit, v.lower, v.upper)) for v in block.states],
        "param": [(v.name, (v.unit, v.lower, v.upper)) for v in block.parameters],
        "in": [(v.name, (v.unit, v.lower, v.upper)) for v in block.inputs],
        "out": outputs,
    }
    taken = {name for rows in groups.values() for name, _ in rows}
    arrays = [array for group, rows in groups.items() for array in _runs(group, rows)]
    return replace(block, arrays=tuple(array for array in arrays if array.name not in taken))


def _runs(group: str, rows: Sequence[tuple[str, object]]) -> Iterator[Elements]:
    """Two or more neighbours NAME_1, NAME_2, ... that are alike."""
    first = 0
    while first < len(rows):
        (name, kind), size = rows[first], 1
        counted = fullmatch(r"(\w+)_1", name)
        while (
            counted is not None
            and first + size < len(rows)
            and rows[first + size] == (f"{counted[1]}_{size + 1}", kind)
        ):
            size += 1
        if counted is not None and size > 1:
            yield Elements(group, counted[1], first, size)
        first += size
