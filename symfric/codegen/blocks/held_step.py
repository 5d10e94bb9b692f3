"""Step of the states of a law with velocity and load held, and its case without load."""

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.foundation.graph import LEAVES, graph, rebuild
from symfric.foundation.numeric import Scalar, exp_phi1_phi2
from symfric.foundation.parameters import Variable
from symfric.foundation.variable import stacked
from symfric.laws import Law, Sum
from symfric.laws.base.law import chosen

EXACT, EVENT, SECOND = "exact", "event", "second order"
"""Types of steps: exponential of affine rates, exact with corners, linearised rates."""

FASTEST = 1.0
"""Limit of J h of a linearised rate; faster growth does not approximate the solution and may
overflow.
"""


class LawStep(NamedTuple):
    """States of a law after a step of h [s], columns.

    Attributes:
        end, mean: states at the end of the step, and their means over it.
        mean_rate, end_rate: mean rates over the step, and rates at its end.
        kinds: types of the step: EXACT, EVENT, SECOND, each at most once.
    """

    end: ca.SX
    mean: ca.SX
    mean_rate: ca.SX
    end_rate: ca.SX
    kinds: tuple[str, ...]


def advanced(
    law: Law,
    v: Scalar,
    N: Scalar,
    z: ca.SX,
    rate: ca.SX,
    given: Mapping[str, Scalar],
    h: ca.SX | float,
    where: str,
) -> LawStep:
    """Return the states of a law after a step of `h` [s], their means, and their rates.

    v, N and the further inputs `given` are held. A sum is advanced term by term. A law with a
    method `held_step` uses it, other laws use the function `held_step`.

    Raises:
        ValueError: modes that follow zero crossings within the step; errors of `held_step`.
    """
    if isinstance(law, Sum):
        terms = zip(law.laws, law.terms(z), law.terms(rate), strict=True)
        parts = [
            advanced(term, v, N, own, rates, given, h, where)
            for term, (_, own), (_, rates) in terms
            if term.states
        ]
        *columns, kinds = zip(*parts, strict=True)
        columns = (ca.vertcat(*column) for column in columns)
        return LawStep(*columns, kinds=tuple(dict.fromkeys(k for kind in kinds for k in kind)))
    known = law.held_step(v, N, z, h)
    if known is not None:
        end, mean = map(ca.SX, known)
        return LawStep(end, mean, (end - z) / h, ca.substitute(rate, z, end), (EVENT,))
    if law.switches(v, N, z, **chosen(law, given)):
        raise ValueError(
            f"{where}: expected a law without modes, or one with its own step, got one whose "
            "modes follow zero crossings within the step; karnopp and leine_switch with "
            "form = 'original' are functions of v, N and F_e"
        )
    rest = law.held_rest(v, N, z)
    steady = ca.SX(law.steady_state(v, N) if rest is None else rest)
    return held_step(rate, z, h, steady, where, each=rest is not None)


def held_step(
    rate: ca.SX, z: ca.SX, h: ca.SX | float, rest: ca.SX, where: str, *, each: bool = False
) -> LawStep:
    """Return states after a step of h [s], their means over it, and their rates, as columns.

    States are advanced one by one; a state follows those that its rate depends on, and uses their
    means. The step of a state is exact if its rate is affine in it and depends on no other state;
    otherwise

        dz = h phi1(J h) f,   m = h phi2(J h) f,   J = df_i/dz_i
        z+ = z + s dz,   mean z = z + s [(1 - s) dz + s m]

    of second order (Rosenbrock-Euler, exponential), with J h limited to `FASTEST`. s = min(1,
    (rest - z)/dz) ends the step at the equilibrium of the state, which the solution cannot pass but
    its linearisation may. The rate at the end is exp(J h) f, because evaluating it at z+ in fast
    sliding is a difference of large numbers; it is 0 if the state has reached its equilibrium.

    Args:
        rate: rates of the states `z`.
        rest: equilibrium of each state.
        each: True if `rest` is the equilibrium of each state for the others in `z`.

    Raises:
        ValueError: states with circular dependencies, or a rate that depends on other states and is
            not affine in its own, if `each` is False.
    """
    count = z.numel()
    means, rates, last = ([z[i] for i in range(count)] for _ in range(3))
    kinds = dict[str, None]()
    pattern = ca.DM(ca.jacobian(rate, z).sparsity(), 1).full() != 0
    for i in _order(pattern, where):
        alone = not np.delete(pattern[i], i).any()
        others = ca.vertcat(*(means[j] if j != i else z[i] for j in range(count)))
        f = ca.substitute(rate[i], z, others)
        slope = ca.densify(ca.jacobian(f, z[i]))
        affine = not ca.depends_on(slope, z[i])
        growth, phi1, phi2 = exp_phi1_phi2(h * slope if affine else ca.fmin(h * slope, FASTEST))
        rates[i], bend = phi1 * f, phi2 * f
        last[i], kind = growth * f, EXACT if alone and affine else SECOND
        if not affine:
            if not (alone or each):
                raise ValueError(f"{where}: {_expected('depend on others')}")
            s = _share(h * rates[i], ca.substitute(rest[i], z, others) - z[i])
            rates[i], bend = s * rates[i], s * ((1 - s) * rates[i] + s * bend)
            last[i] = ca.if_else(s < 1, 0, last[i])
        means[i] = z[i] + h * bend
        kinds[kind] = None
    columns = (ca.vertcat(*rows) for rows in (means, rates, last))
    return LawStep(z + h * ca.vertcat(*rates), *columns, kinds=tuple(kinds))


def _share(way: ca.SX, gap: ca.SX) -> ca.SX:
    """Return the fraction of `way` up to the equilibrium at the distance `gap`, at most 1."""
    ratio = gap / ca.if_else(way == 0, 1, way)
    return ca.if_else(ca.logic_and(ratio > 0, ratio < 1), ratio, 1)


def _order(pattern: NDArray[np.bool_], where: str) -> list[int]:
    """Return the indices of the states, each after those that its rate depends on."""
    needs = {i: set(row.nonzero()[0].tolist()) - {i} for i, row in enumerate(pattern)}
    found: list[int] = []
    while len(found) < len(needs):
        ready = [i for i, others in needs.items() if i not in found and others <= set(found)]
        if not ready:
            raise ValueError(f"{where}: {_expected('have circular dependencies')}")
        found += ready
    return found


def _expected(what: str) -> str:
    return (
        "expected a rate that is affine in its own state or depends on no other, so that a step "
        f"of any length is accurate, got states that {what}; gms with form = 'event' has a step"
    )


def force_of_rate(force: ca.SX, rate: ca.SX, z: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the force with symbols r for the rates that occur in it, and r.

    The mean force then uses the mean rates instead of the rates of the mean state. Both are equal
    in an affine law, but the latter are differences of large numbers in float at high velocities.
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


LEAST_LOAD = 1e-9
"""Load, relative to the nominal load, below which a contact carries no force."""


def forces_at(force: ca.SX, own: ca.SX, at: Mapping[str, ca.SX]) -> dict[str, ca.SX]:
    """Return the force, by name, with the column `own` (states and rates) set to values `at`."""
    return {name: ca.substitute(force, own, values) for name, values in at.items()}


def with_unloaded_case(
    following: ca.SX, force: ca.SX, own: ca.SX, at: Mapping[str, ca.SX], N: Variable
) -> tuple[ca.SX, dict[str, ca.SX]]:
    """Return states and forces of a step with a separate case for a contact without load.

    A state whose step depends on the load becomes 0, as in a contact that has just closed; the
    other states (a lag, a temperature) continue. The force reduces to viscous friction.

    Args:
        following: states after the step.
        force, own, at: arguments of `forces_at`.
        N: normal force.
    """
    least = LEAST_LOAD * N.nominal
    loaded = N.symbol > least
    rows = [(row, ca.depends_on(row, N.symbol)) for row in ca.vertsplit(following)]
    kept = ca.vertcat(*(ca.SX(float(not loads)) for _, loads in rows))
    ends = [ca.if_else(loaded, row, 0.0) if loads else row for row, loads in rows]
    found: dict[str, ca.SX] = {}
    for name, normal in forces_at(force, own, at).items():
        values, left = ca.vertcat(kept, kept) * at[name], ca.SX()
        for load in (0.0, least):  # not 0 if a width relative to N gives 0/0
            given = ca.densify(ca.vertcat(values, load))
            left = ca.substitute(force, ca.vertcat(own, N.symbol), given)
            symbols = stacked(ca.symvar(left))  # at numbers without special cases in formulas
            value = ca.evalf(ca.substitute(left, symbols, 0.7 * ca.SX.ones(symbols.numel())))
            if np.isfinite(float(value)):
                break
        found[name] = ca.if_else(loaded, normal, left)
    return ca.vertcat(*ends), found


def needs_unloaded_case(law: Law, own: ca.Function, cases: ca.Function) -> bool:
    """Return True if the formulas of `law` are not finite at N = 0, or give a force at rest there.

    Elements of event forms release at once. A law with a friction level at N = 0, such as from a
    preload, keeps its formulas.

    Args:
        law: the law with numbers as parameters.
        own, cases: functions (v, N, z, further inputs) -> states, outputs; of the law itself, and
            with the results of `with_unloaded_case`.
    """
    try:
        level = max(abs(float(law.static_level(0.0, side))) for side in (1, -1))
    except ValueError:  # the law does not define a level
        level = 0.0
    if level:
        return False
    nominal = np.array([s.nominal for s in law.states])
    for share in (0.0, 1.0, -1.0):
        for v in (0.0, 1e-3, -1.0):
            given = v, 0.0, share * nominal, np.zeros(len(law.inputs))
            (states, outputs), (_, expected) = own(*given), cases(*given)
            if not (states.is_regular() and outputs.is_regular()):
                return True
            if v == 0.0 and float(ca.norm_inf(outputs - expected)) > 1e-9:
                return True
    return False
