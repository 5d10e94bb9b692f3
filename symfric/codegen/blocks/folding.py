"""Which parameters stay variable at run time, and which become constants of the code."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import casadi as ca

from symfric.codegen.blocks.block import Block
from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.foundation import checks
from symfric.foundation.graph import graph
from symfric.foundation.parameters import Parametric, parameters, with_values
from symfric.laws import Law

Fold = bool | Sequence[str] | None
"""What becomes a constant: True for all, names, or None for what selects a cheaper form only."""


def variable(
    obj: Parametric, free: Sequence[str] | None, fold: Fold
) -> tuple[tuple[str, ...], list[str]]:
    """The parameters of a law or a machine that stay variable at run time, and what is wrong.

    Args:
        obj: a law, or a machine with one in its field `law`.
        free: these stay variable and no others; None where `fold` says.
        fold: True for constants only, names that become constants beside those that select a
            cheaper form (`runtime_parameters`), None for the latter alone.

    Returns:
        Names in the order of `parameters`, and a sentence for each problem.
    """
    problems: list[str] = []
    if free is not None and fold is not None:
        problems.append(f"fold: expected none beside free, which folds all others, got {fold!r}")
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
    """`runtime_parameters` of a law; of a machine its own parameters and those of its law."""
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
    """The parameters that are worth a place in the parameter struct.

    All of them, except those whose present value selects a cheaper form of the law. This is
    measured: a parameter is left out if making it a constant spares a transcendental function of
    inputs or states. So delta = 2 of a Stribeck curve spares a `pow`, mu_v = 0 of Brown-McPhee a
    `tanh`, E = 0 of the self-tuning law an `atan`, n = 1 of Dahl's law a `pow` (and keeps the law
    affine in its state), v_eps = 0 the `tanh` of a smooth |v|. A factor of 1 or a summand of 0
    spares none and stays.

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
    """Parameters by meaning (role, unit and the name in their own part) and value."""
    groups: dict[tuple[str, str, str, float], list[str]] = {}
    for name, p in parameters(law).items():
        groups.setdefault((p.role, p.unit, p.field, float(p.value)), []).append(name)
    return list(groups.values())


def _calls(law: Law, groups: Sequence[Sequence[str]]) -> int:
    """Transcendental functions of v, N, z, w in the law with one symbol for every group."""
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
    """The block without parameters that have no effect.

    Raises:
        ValueError: one of them was asked for in `free`.
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


LEAST = 1e-6
"""Times its default: the least that a parameter may become which must not be 0."""


def above_zero(block: Block, names: Collection[str]) -> Block:
    """The block whose parameters `names`, which are valid from 0 on, keep a distance from it.

    A law takes a width of the number 0 for its original form; of a parameter that becomes 0 at run
    time the C knows nothing, and divides by it.
    """
    changed = tuple(
        replace(p, lower=LEAST * float(p.start))
        if p.name in names and p.lower == 0.0 and float(p.start) > 0.0
        else p
        for p in block.parameters
    )
    return replace(block, parameters=changed)
