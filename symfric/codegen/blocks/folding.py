"""Which parameters of a law stay variable at run time, and which become constants of the code."""

from collections.abc import Sequence

import casadi as ca

from symfric.emitter.c99 import TRANSCENDENTAL
from symfric.foundation.graph import graph
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import Law


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
