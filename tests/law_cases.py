"""The laws that the contract tests run over, and their compiled derivatives."""

from functools import cache

import casadi as ca
from tables import Names, table

import symfric as sf

TABLE = table(__file__, "law_cases")


def made(section: str) -> dict[str, sf.Law]:
    """Return the laws of a section of law_cases.toml."""
    return {name: Names().value(text) for name, text in TABLE[section].items()}


SYMMETRIC: dict[str, sf.Law] = {
    **{name: kind() for name, kind in sf.ALL_LAWS.items() if kind.facts.odd},
    **made("options"),
    **made("dynamic"),
    **made("composed"),
}
"""Every odd law with default parameters, and those whose options lead to other expressions."""

CASES: dict[str, sf.Law] = {
    **SYMMETRIC,
    **{name: kind() for name, kind in sf.ALL_LAWS.items() if not kind.facts.odd},
    **made("asymmetric"),
}

STATIC = [name for name, law in SYMMETRIC.items() if not law.states]
BRISTLE = [name for name, law in SYMMETRIC.items() if law.states]


def state_symbols(law: sf.Law) -> ca.SX:
    """The internal states as a column of symbols."""
    return ca.vertcat(ca.SX(0, 1), *(ca.SX.sym(s.name) for s in law.states))


NO_STEP = {
    *("leuven", "gms", "armstrong"),
    *("exact_coulomb", "exact_coulomb, stribeck", "karnopp, event", "leine_switch, event"),
}
"""Cases that cannot be C, see the tests of `law_block`."""


EXAMPLE_INPUTS = {
    "F_e": 0.6,
    "dv": 0.3,
    "tau_m": 0.4,
    "tau_e": -0.3,
    "x_rel": 1e-3,
    "v_rel": 0.05,
    "v_r": 0.0,
}
"""A value for every further input that some law takes."""


def given_inputs(law: sf.Law) -> dict[str, float]:
    """Values of the further inputs of a law."""
    return {i.name: EXAMPLE_INPUTS[i.name] for i in law.inputs}


@cache
def compiled(name: str) -> ca.Function:
    """(v, N, z, w) -> force, rate of a case; w are its further inputs, here scaled examples."""
    law = CASES[name]
    v, N, z, w = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law), ca.SX.sym("w")
    given = {n: w * value for n, value in given_inputs(law).items()}
    outputs = [law.force(v, N, z, **given), law.rate(v, N, z, **given)]
    return ca.Function("law", [v, N, z, w], outputs, ["v", "N", "z", "w"], ["force", "rate"])


@cache
def symbolic(name: str) -> tuple[list[str], ca.SX, ca.SX, dict[str, float]]:
    """Names and symbols of v, z, further inputs and parameters, (force, rate), and their values.

    The normal force is 7.848 N, that of the block of the Rabinowicz scene.
    """
    law, variables = sf.symbolise(CASES[name], *sf.parameters(CASES[name]))
    v, z = ca.SX.sym("v"), state_symbols(law)
    values = given_inputs(law)
    inputs = {name: ca.SX.sym(name) for name in values}
    names = ["v", *(s.name for s in law.states), *inputs, *(p.name for p in variables)]
    symbols = ca.vertcat(v, z, *inputs.values(), *(p.symbol for p in variables))
    outputs = ca.vertcat(law.force(v, 7.848, z, **inputs), law.rate(v, 7.848, z, **inputs))
    return names, symbols, outputs, values | {p.name: float(p.start) for p in variables}
