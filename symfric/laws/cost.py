"""What a law costs, as a count that does not depend on the machine."""

from dataclasses import dataclass

import casadi as ca

from symfric.laws.composed.populations import AnyLaw, Population


@dataclass(frozen=True)
class Cost:
    """CasADi instructions, those of inputs and outputs included.

    Attributes:
        value: of force and rate together, or of one contact of a population.
        gradient: of their derivatives by v, N, the states and further inputs.
    """

    value: int
    gradient: int


def cost(law: AnyLaw) -> Cost:
    """The cost of `law` with the numbers it holds, common parts counted once."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), ca.SX.sym("z", len(law.states))
    if isinstance(law, Population):
        r, dt = ca.SX.sym("r"), ca.SX.sym("dt")
        arguments, results = ca.vertcat(v, N, z, r, dt), law.contact(z, r, v * dt, dt, N)
        return _cost(arguments, results)
    given = {i.name: ca.SX.sym(i.name) for i in law.inputs}
    arguments = ca.vertcat(v, N, z, *given.values())
    results = ca.vertcat(law.force(v, N, z, **given), law.rate(v, N, z, **given))
    return _cost(arguments, results)


def _cost(arguments: ca.SX, results: ca.SX) -> Cost:
    return Cost(
        _instructions(arguments, results), _instructions(arguments, ca.jacobian(results, arguments))
    )


def _instructions(arguments: ca.SX, results: ca.SX) -> int:
    return ca.Function("law", [arguments], [ca.cse(results)]).n_instructions()
