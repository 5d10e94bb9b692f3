"""Variables of a block: step size, run-time parameters, numbered joints, arrays of elements.

Names determine the candidates for arrays, and the graph of the step confirms them: only variables
that a loop reads or writes become an array, and a block without loops is unchanged.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from symfric.codegen.blocks.block import RESERVED, Block, ElementArray
from symfric.emitter.arrays import looped
from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.emitter.rolling import LEAST
from symfric.foundation import checks
from symfric.foundation.graph import graph
from symfric.foundation.parameters import (
    Parameter,
    Parametric,
    Variable,
    parameters,
    with_values,
)
from symfric.foundation.units import turned
from symfric.foundation.variable import stacked
from symfric.laws import Law
from symfric.model import Variables

Fold = bool | Sequence[str] | None
"""Parameters that become constants: True for all, or their names, or None for those whose values
select a cheaper form."""

STEP_SIZE = 1e-3
"""Default of the parameter h [s]."""


class StepSize(NamedTuple):
    """Step size of a block.

    Attributes:
        h: symbol or number [s].
        parameters: the parameter h; empty if h is a constant.
        constants: the constant h; empty if h is a parameter.
    """

    h: ca.SX | float
    parameters: Variables
    constants: dict[str, float]


def step_size(where: str, h: float | None, of: Block | None = None) -> StepSize:
    """Return the step size `h` [s] as a constant; if None, as a parameter, by default 1 ms.

    The parameter is that of the block `of`, if it has one.
    """
    if h is not None:
        h = checks.number(f"{where}: h", h, unit="s", above=0.0)
        return StepSize(h, (), {"h": h})
    size = Variable("h", "s", start=STEP_SIZE, lower=0.0, doc="step size")
    if of is not None:
        size = next((v for v in of.parameters if v.name == size.name), size)
    return StepSize(size.symbol, (size,), {})


def as_constants(
    gone: Iterable[Parameter], more: Mapping[str, float], turning: bool = False
) -> dict[str, Any]:
    """Return the fields `constants` and `about` of a block for the parameters `gone`."""
    listed = [*gone]
    return {
        "constants": {p.name: float(p.value) for p in listed} | dict(more),
        "about": {p.name: f"{p.doc} [{turned(p.unit) if turning else p.unit}]" for p in listed},
    }


def variable(
    obj: Parametric, free: Sequence[str] | None, fold: Fold
) -> tuple[tuple[str, ...], list[str]]:
    """Return the parameters of a law or a machine that remain variable at run time, and problems.

    Args:
        obj: a law, or a machine with a law in its field `law`.
        free: the only parameters that remain variable; None to use `fold`.
        fold: True for constants only; names of parameters that become constants in addition to
            those that select a cheaper form (`runtime_parameters`); None for the latter only.

    Returns:
        Names in the order of `parameters`, and a sentence for each problem.
    """
    problems: list[str] = []
    if "h" in parameters(obj):
        problems.append(
            "h: expected a parameter of another name, since h is the step size in generated code; "
            "rename it, for example to h_0"
        )
    if free is not None and fold is not None:
        problems.append(f"fold: expected none with free, which folds all others, got {fold!r}")
    if fold is False:
        problems.append("fold: expected True, names, or None for the default, got False")
    chosen: dict[str, tuple[str, ...]] = {}
    for what, names in (("free", free), ("fold", None if isinstance(fold, bool) else fold)):
        try:
            chosen[what] = () if names is None else checks.names(what, names, parameters(obj))
        except ValueError as error:
            problems.append(str(error))
    if problems or free is not None:
        return chosen.get("free", ()), problems
    kept = () if fold is True else _worth_it(obj)
    return tuple(name for name in kept if name not in chosen["fold"]), []


def _worth_it(obj: Parametric) -> tuple[str, ...]:
    """Return the parameters of `obj`, without those whose value selects a cheaper form."""
    if isinstance(obj, Law):
        return runtime_parameters(obj)
    names, law = tuple(parameters(obj)), getattr(obj, "law", None)
    if not isinstance(law, Law):
        return names
    kept, inner = runtime_parameters(law), tuple(parameters(law))
    of_law = zip(names[len(names) - len(inner) :], inner, strict=True)
    folded = {name for name, inside in of_law if inside not in kept}
    return tuple(name for name in names if name not in folded)


def runtime_parameters(law: Law) -> tuple[str, ...]:
    """Return the parameters of a law that are members of the parameter struct.

    These are all parameters except those whose present value selects a cheaper form of the law: a
    parameter is omitted if making it a constant saves a transcendental function of inputs or
    states. For example, delta = 2 of a Stribeck curve saves a `pow`, mu_v = 0 of Brown-McPhee a
    `tanh`, E = 0 of the self-tuning law an `atan`, n = 1 of Dahl's law a `pow` (and keeps the law
    affine in its state), v_eps = 0 the `tanh` of a smooth |v|. A factor of 1 or a summand of 0
    saves no function, and the parameter remains.

    Parameters with the same meaning and value, such as those of the two sides of an asymmetric law,
    are examined together.
    """
    groups: dict[tuple[str, str, str, float], list[str]] = {}
    for name, p in parameters(law).items():  # `field` is the name within the part of the law
        groups.setdefault((p.role, p.unit, p.field, float(p.value)), []).append(name)
    least = _calls(law, [*groups.values()])
    kept: set[str] = set()
    for group in groups.values():
        if _calls(law, [other for other in groups.values() if other is not group]) >= least:
            kept.update(group)
    return tuple(name for name in parameters(law) if name in kept)


def _calls(law: Law, groups: Sequence[Sequence[str]]) -> int:
    """Return the number of transcendental functions of the law with one symbol per group."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    p = ca.SX.sym("p", len(groups))
    symbols = zip(ca.vertsplit(p), groups, strict=True)
    symbolic = with_values(law, {name: symbol for symbol, group in symbols for name in group})
    given = {i.name: ca.SX.sym(i.name) for i in law.inputs}
    equations = ca.vertcat(symbolic.force(v, N, z, **given), symbolic.rate(v, N, z, **given))
    columns = [v, N, z, stacked(given.values()), p]
    source = graph(ca.Function("law", columns, [ca.densify(equations)]))
    of_inputs = source.depends((0, 1, 2, 3))
    nodes = zip(source.nodes, of_inputs, strict=True)
    return sum(node.op in TRANSCENDENTAL and depends for node, depends in nodes)


def without_idle(block: Block, free: Sequence[str] | None, where: str) -> Block:
    """Return the block without parameters that have no effect.

    Raises:
        ValueError: `free` contains a parameter without effect.
    """
    everything = block.everything
    idle = [p.name for p in block.parameters if not ca.depends_on(everything, p.symbol)]
    wrong = [name for name in idle if name in (free or ())]
    if wrong:
        raise ValueError(
            f"{where}: free: expected parameters that have an effect, got {', '.join(wrong)}; "
            "the values of the other parameters switch them off"
        )
    return replace(block, parameters=tuple(p for p in block.parameters if p.name not in idle))


SMALLEST = 1e-6
"""Lower bound of a parameter that must not be 0, relative to its default."""


def above_zero(block: Block, names: Collection[str]) -> Block:
    """Return the block with lower bounds above 0 for the parameters `names`.

    A law with a width of 0 (a number) has its original form; the C with a variable width lacks this
    case and divides by the width.
    """
    changed = tuple(
        replace(p, lower=SMALLEST * float(p.start))
        if p.name in names and p.lower == 0.0 and float(p.start) > 0.0
        else p
        for p in block.parameters
    )
    return replace(block, parameters=changed)


class Family(NamedTuple):
    """Variables of one group whose names differ in a number that counts from 1.

    Attributes:
        name: name of the array: that of the variables without the number.
        rows: rows of the variables, in the order of their numbers.
    """

    name: str
    rows: tuple[int, ...]


def arranged(block: Block) -> Block:
    """Return the block with identical elements as arrays; parameters are reordered for them.

    The names of elements differ in one number (F_1, F_2, ... or k_1_pos, k_2_pos, ...); units and
    ranges are equal. States keep their order, which an array must match. Inputs form no arrays,
    because each is guarded separately.
    """
    found = {"state": families(block.states), "param": families(block.parameters)}
    found["state"] = [f for f in found["state"] if np.all(np.diff(f.rows) == 1)]
    if not any(found.values()):
        return block
    whole = _with(block, found)
    texts = looped(graph(whole.step), whole.indexed(("state",), guards=False))
    return _with(
        block,
        {g: [f for f in several if f"{g}->{f.name}" in texts] for g, several in found.items()},
    )


def families(variables: Variables) -> list[Family]:
    """Return all families of at least `LEAST` variables; each variable is in at most one.

    If a variable belongs to several, the family with the smallest range of rows is chosen.
    """
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
    """Return the block with the families `found` as arrays."""
    arrays = [ElementArray("state", f.name, f.rows[0], len(f.rows)) for f in found["state"]]
    first = {family.rows[0]: family for family in found["param"]}
    members = {row for family in found["param"] for row in family.rows}
    order: list[int] = []
    for row in range(len(block.parameters)):
        if row in first:
            family = first[row]
            arrays.append(ElementArray("param", family.name, len(order), len(family.rows)))
            order += family.rows
        elif row not in members:
            order.append(row)
    parameters = tuple(block.parameters[row] for row in order)
    return replace(block, parameters=parameters, arrays=tuple(arrays))


def numbered(groups: Sequence[Variables], labels: Sequence[str]) -> tuple[Variables, list[int]]:
    """Return variables of several joints, grouped by name: mu_s_1, mu_s_2, ..., mu_d_1, ...

    Args:
        groups: variables of each joint.
        labels: number, or another name, of each joint.

    Returns:
        The variables, and the index of each in the concatenated `groups`.
    """
    every = [(v, label) for group, label in zip(groups, labels, strict=True) for v in group]
    stems = list(dict.fromkeys(v.name for v, _ in every))

    def rank(i: int) -> tuple[int, bool, int]:  # ascending numbers, then names as given
        variable, label = every[i]
        stem, digits = stems.index(variable.name), label.isdecimal()
        return stem, not digits, int(label) if digits else 0

    order = sorted(range(len(every)), key=rank)
    renamed = ((v, f"{v.name}_{label}") for v, label in (every[i] for i in order))
    return tuple(replace(v, name=name) for v, name in renamed), order


def in_arrays(block: Block) -> Block:
    """Return the block with arrays of neighbours numbered from 1 with equal units and ranges."""
    groups: dict[str, list[tuple[str, object]]] = {
        group: [(v.name, (v.unit, v.lower, v.upper)) for v in of]
        for group, of in block.groups.items()
    }
    groups["out"] = [(name, output.unit) for name, output in block.outputs.items()]
    taken = {name for rows in groups.values() for name, _ in rows}
    arrays = (array for group, rows in groups.items() for array in _runs(group, rows))
    return replace(block, arrays=tuple(array for array in arrays if array.name not in taken))


def _runs(group: str, rows: Sequence[tuple[str, object]]) -> Iterator[ElementArray]:
    """Yield sequences of two or more identical neighbours NAME_1, NAME_2, ..."""
    first = 0
    while first < len(rows):
        (name, kind), size = rows[first], 1
        stem = name.removesuffix("_1")
        if stem and stem != name:
            while rows[first + size : first + size + 1] == [(f"{stem}_{size + 1}", kind)]:
                size += 1
            if size > 1:
                yield ElementArray(group, stem, first, size)
        first += size
