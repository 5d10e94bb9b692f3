"""Variables of a block: run-time parameters, numbered joints, arrays of identical elements.

Candidates for arrays are found by names, and confirmed by the graph of the step: only variables
that a loop reads or writes become an array, and a block without loops is unchanged.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from re import fullmatch
from typing import final

import casadi as ca

from symfric.codegen.blocks.block import RESERVED, Block, Elements
from symfric.emitter.arrays import looped
from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.emitter.rolling import LEAST
from symfric.foundation import checks
from symfric.foundation.graph import graph
from symfric.foundation.parameters import Parametric, Variable, parameters, with_values
from symfric.laws import Law
from symfric.model import Variables

Fold = bool | Sequence[str] | None
"""Parameters that become constants: True for all, names, or None for those that select a cheaper
form."""


def variable(
    obj: Parametric, free: Sequence[str] | None, fold: Fold
) -> tuple[tuple[str, ...], list[str]]:
    """Return the parameters of a law or a machine that stay variable at run time, and problems.

    Args:
        obj: a law, or a machine with one in its field `law`.
        free: these stay variable and no others; None to use `fold`.
        fold: True for constants only, names that become constants in addition to those that select
            a cheaper form (`runtime_parameters`), None for the latter only.

    Returns:
        Names in the order of `parameters`, and a sentence for each problem.
    """
    problems: list[str] = []
    if free is not None and fold is not None:
        problems.append(f"fold: expected none with free, which folds all others, got {fold!r}")
    if fold is False:
        problems.append("fold: expected True, names, or None for the default, got False")
    known, given = parameters(obj), {"free": free, "fold": None if fold in (True, False) else fold}
    chosen: dict[str, tuple[str, ...]] = {}
    for what, names in given.items():
        try:
            chosen[what] = () if names is None else checks.names(what, names, known)
        except ValueError as error:
            problems.append(str(error))
    if problems or free is not None:
        return chosen.get("free", ()), problems
    kept = () if fold is True else _worth_it(obj)
    return tuple(name for name in kept if name not in chosen["fold"]), []


def _worth_it(obj: Parametric) -> tuple[str, ...]:
    """Return `runtime_parameters` of a law; of a machine its own parameters and those of its
    law.
    """
    if isinstance(obj, Law):
        return runtime_parameters(obj)
    names, law = tuple(parameters(obj)), getattr(obj, "law", None)
    if not isinstance(law, Law):
        return names
    kept, inner = runtime_parameters(law), tuple(parameters(law))
    own = len(names) - len(inner)
    folded = {name for name, of_law in zip(names[own:], inner, strict=True) if of_law not in kept}
    return tuple(name for name in names if name not in folded)


def runtime_parameters(law: Law) -> tuple[str, ...]:
    """Return the parameters of a law that belong into the parameter struct.

    These are all except those whose present value selects a cheaper form of the law. This is
    measured: a parameter is left out if making it a constant saves a transcendental function of
    inputs or states. So delta = 2 of a Stribeck curve saves a `pow`, mu_v = 0 of Brown-McPhee a
    `tanh`, E = 0 of the self-tuning law an `atan`, n = 1 of Dahl's law a `pow` (and keeps the law
    affine in its state), v_eps = 0 the `tanh` of a smooth |v|. A factor of 1 or a summand of 0
    saves none and stays.

    Parameters with the same meaning and value, such as those of the two sides of an asymmetric law,
    are measured as one.
    """
    groups = _alike(law)
    least = _calls(law, groups)
    kept = [
        name
        for group in groups
        if _calls(law, [g for g in groups if g is not group]) >= least
        for name in group
    ]
    return tuple(name for name in parameters(law) if name in kept)


def _alike(law: Law) -> list[list[str]]:
    """Return groups of parameters with equal meaning (role, unit, name in their own part) and
    value.
    """
    groups: dict[tuple[str, str, str, float], list[str]] = {}
    for name, p in parameters(law).items():
        groups.setdefault((p.role, p.unit, p.field, float(p.value)), []).append(name)
    return list(groups.values())


def _calls(law: Law, groups: Sequence[Sequence[str]]) -> int:
    """Return the number of transcendental functions in the law with one symbol per group."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    p = ca.SX.sym("p", len(groups))
    symbols = [p[i] for i in range(len(groups))]
    values = {name: s for s, group in zip(symbols, groups, strict=True) for name in group}
    symbolic = with_values(law, values)
    given = {i.name: ca.SX.sym(i.name) for i in law.inputs}
    w = ca.vertcat(ca.SX(0, 1), *given.values())
    equations = ca.vertcat(symbolic.force(v, N, z, **given), symbolic.rate(v, N, z, **given))
    source = graph(ca.Function("law", [v, N, z, w, p], [ca.densify(equations)]))
    of_inputs = source.depends((0, 1, 2, 3))
    return sum(
        node.op in TRANSCENDENTAL and depends
        for node, depends in zip(source.nodes, of_inputs, strict=True)
    )


def without_idle(block: Block, free: Sequence[str] | None, where: str) -> Block:
    """Return the block without parameters that have no effect.

    Raises:
        ValueError: one of them was requested in `free`.
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
"""Lower limit of a parameter that must not be 0, relative to its default."""


def above_zero(block: Block, names: Collection[str]) -> Block:
    """Return the block whose parameters `names`, valid from 0 on, keep a distance from 0.

    A law treats a width of the number 0 as its original form; the C of a variable width has no such
    case, and divides by it.
    """
    changed = tuple(
        replace(p, lower=SMALLEST * float(p.start))
        if p.name in names and p.lower == 0.0 and float(p.start) > 0.0
        else p
        for p in block.parameters
    )
    return replace(block, parameters=changed)


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
        """True if the rows follow each other."""
        return self.rows == tuple(range(self.rows[0], self.rows[0] + len(self.rows)))


def arranged(block: Block) -> Block:
    """Return the block with identical elements as arrays, and the parameters of an array in
    sequence.

    Their names differ in one number (F_1, F_2, ... or k_1_pos, k_2_pos, ...); units and ranges are
    equal. States keep their order, which an array must match; inputs, which are guarded one by one,
    have no arrays.
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
    """Return all families of at least `LEAST`, each variable in the one of nearest rows."""
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
    """Return the block with these arrays."""
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
    """Return (group, name) of the arrays that loops of the step read or write."""
    texts = looped(graph(block.step), block.indexed(("state",), guards=False))
    return {(a.group, a.name) for a in block.arrays if f"{a.group}->{a.name}" in texts}


def numbered(groups: Sequence[Variables], labels: Sequence[str]) -> tuple[Variables, list[int]]:
    """Return variables of several joints, grouped by name: mu_s_1, mu_s_2, ..., mu_d_1, ...

    Args:
        groups: the variables of each joint.
        labels: number of each joint, or another name.

    Returns:
        The variables, and the place of each among all of `groups`, one group after the other.
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
    """Return the sort key of a label: numbers in their order, then names as given."""
    return (False, int(label)) if label.isdecimal() else (True, 0)


def in_arrays(block: Block) -> Block:
    """Return the block with arrays of neighbours that count from 1 with equal unit and range."""
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
    """Yield runs of two or more identical neighbours NAME_1, NAME_2, ..."""
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
