"""The states of a law over a step in which velocity and load are held."""

from collections.abc import Mapping

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.graph import LEAVES, graph, rebuild
from symfric.foundation.numeric import Scalar
from symfric.integrator.methods.exponential import phi1_phi2
from symfric.laws import Law, Sum
from symfric.laws.base.law import chosen


def advanced(
    law: Law,
    v: Scalar,
    N: Scalar,
    z: ca.SX,
    rate: ca.SX,
    given: Mapping[str, Scalar],
    h: ca.SX | float,
    where: str,
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """States of a law after a step of `h` [s], their means, and their mean rates.

    With v, N and the further inputs `given` held; of a sum term by term, by what the law knows of
    its step, else by `held_step`.

    Raises:
        ValueError: modes that follow zero crossings within the step; as `held_step`.
    """
    if isinstance(law, Sum):
        terms = zip(law.laws, law.terms(z), law.terms(rate), strict=True)
        parts = [
            advanced(term, v, N, own, rates, given, h, where)
            for term, (_, own), (_, rates) in terms
            if term.states
        ]
        end, mean, mean_rate = (ca.vertcat(*column) for column in zip(*parts, strict=True))
        return end, mean, mean_rate
    known = law.held_step(v, N, z, h)
    if known is not None:
        end, mean = map(ca.SX, known)
        return end, mean, (end - z) / h
    if law.switches(v, N, z, **chosen(law, given)):
        raise ValueError(
            f"{where}: expected a law without modes, or one that knows its step, got one whose "
            "modes follow zero crossings within the step; karnopp and leine_switch with "
            "form = 'original' are functions of v, N and F_e"
        )
    rest = ca.SX(law.steady_state(v, N))
    end, mean, mean_rate = held_step(rate, z, h, rest, where)
    return end, mean, mean_rate


def held_step(rate: ca.SX, z: ca.SX, h: ca.SX | float, rest: ca.SX, where: str) -> list[ca.SX]:
    """States after a step of h [s], their means and mean rates over it, columns.

    Each state by itself, those that others need first, with the means of these: exact where the
    rate is affine in its own state and does not depend on others; otherwise

        dz = h phi1(J h) f,   m = h phi2(J h) f,   J = df_i/dz_i
        z+ = z + s dz,   mean z = z + s [(1 - s) dz + s m]

    of second order (Rosenbrock-Euler, exponential). s = min(1, (rest - z)/dz) ends the way where
    the state comes to rest, which the solution cannot pass and the linearised one may.

    Args:
        rate: of the states `z`.
        rest: where each state comes to rest.

    Raises:
        ValueError: states that act on each other in a circle, or a rate that depends on others and
            is not affine in its own state, whose place of rest is then not known.
    """
    count = z.numel()
    means, rates = [z[i] for i in range(count)], [z[i] for i in range(count)]
    pattern = ca.DM(ca.jacobian(rate, z).sparsity(), 1).full() != 0
    for i in _order(pattern, where):
        others = [means[j] if j != i else z[i] for j in range(count)]
        f = ca.substitute(rate[i], z, ca.vertcat(*others))
        slope = ca.jacobian(f, z[i])
        phi1, phi2 = phi1_phi2(h * ca.densify(slope))
        rates[i], bend = phi1 * f, phi2 * f
        if ca.depends_on(slope, z[i]):
            if pattern[i].sum() > 1:
                raise ValueError(f"{where}: {_expected('depend on others')}")
            s = _share(h * rates[i], rest[i] - z[i])
            rates[i], bend = s * rates[i], s * ((1 - s) * rates[i] + s * bend)
        means[i] = z[i] + h * bend
    return [z + h * ca.vertcat(*rates), ca.vertcat(*means), ca.vertcat(*rates)]


def _share(way: ca.SX, gap: ca.SX) -> ca.SX:
    """The share of `way` up to the place of rest that is `gap` away; 1 where it lies beyond."""
    ratio = gap / ca.if_else(way == 0, 1, way)
    return ca.if_else(ca.logic_and(ratio > 0, ratio < 1), ratio, 1)


def _order(pattern: NDArray[np.bool_], where: str) -> list[int]:
    """The states, each after those that its rate depends on."""
    needs = {i: set(row.nonzero()[0].tolist()) - {i} for i, row in enumerate(pattern)}
    found: list[int] = []
    while needs:
        ready = [i for i, others in needs.items() if others <= set(found)]
        if not ready:
            raise ValueError(f"{where}: {_expected('act on each other in a circle')}")
        found += ready
        needs = {i: others for i, others in needs.items() if i not in ready}
    return found


def _expected(what: str) -> str:
    return (
        "expected a rate that is affine in its own state or depends on no other, so that a step "
        f"of any length is right, got states that {what}; gms with form = 'event' has a step"
    )


def force_of_rate(force: ca.SX, rate: ca.SX, z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The force with symbols r for the rates that occur in it, and r.

    Its mean is then taken at the mean rates and not at the rates of the mean state, which are equal
    in an affine law but, in float at high velocities, the difference of two large numbers.
    """
    r = ca.SX.sym("r", rate.numel())
    others = ca.veccat(*(s for s in ca.symvar(ca.vertcat(force, rate)) if not ca.depends_on(z, s)))
    source = graph(ca.Function("law", [z, others], [ca.densify(rate), ca.densify(force)]))
    rates = {
        number: r[i]
        for i, number in enumerate(source.results[0])
        if source.nodes[number].op not in LEAVES
    }
    return rebuild(source, [z, others], rates)[1], r
