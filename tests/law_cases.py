"""The laws that the contract tests run over, and their compiled derivatives."""

from functools import cache

import casadi as ca
from dynamic_cases import DYNAMIC

from symfric import (
    ALL_LAWS,
    Asymmetric,
    BrownMcPhee,
    Coulomb,
    Dahl,
    Law,
    LoadDependent,
    LuGre,
    SelfTuning,
    Stribeck,
    Sum,
    Viscous,
    parameters,
    symbolise,
)

SYMMETRIC: dict[str, Law] = {
    **{name: kind() for name, kind in ALL_LAWS.items()},
    "stribeck, delta 0.78, viscous": Stribeck(delta=0.78, sigma_2=0.4),
    "brown_mcphee, viscous": BrownMcPhee(mu_v=0.4),
    "self_tuning, E 0.5": SelfTuning(E=0.5),
    "dahl, n 2": Dahl(n=2.0),
    "dahl, n 0.5": Dahl(n=0.5),
    "lugre, delta 0.78, viscous": LuGre(delta=0.78, sigma_2=0.4, v_eps=1e-6),
    "coulomb+viscous": Sum((Coulomb(), Viscous())),
    **DYNAMIC,
    "lugre+dahl": Sum((LuGre(), Dahl())),
    "load_dependent(lugre)": LoadDependent(LuGre(), N_0=2.0, c=0.5),
}
"""Every law with default parameters, and those whose options lead to other expressions."""

CASES: dict[str, Law] = {
    **SYMMETRIC,
    "asymmetric(lugre)": Asymmetric(LuGre(), LuGre(mu_s=0.3, sigma_2=0.4)),
    "asymmetric(stribeck)": Asymmetric(Stribeck(), Stribeck(mu_d=0.12, v_s=2e-3)),
}

STATIC = [name for name, law in SYMMETRIC.items() if not law.states]
BRISTLE = [name for name, law in SYMMETRIC.items() if law.states]


def state_symbols(law: Law) -> ca.SX:
    """The internal states as a column of symbols."""
    return ca.vertcat(ca.SX(0, 1), *(ca.SX.sym(s.name) for s in law.states))


def has_exact_step(law: Law) -> bool:
    """Whether no state acts on another's rate and each enters its own linearly, without modes."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
    slope = ca.jacobian(ca.SX(law.rate(v, N, z)), z)
    affine = not ca.depends_on(slope, z) and slope.sparsity().is_diag()
    return affine and not law.switches(v, N, z)


@cache
def compiled(name: str) -> ca.Function:
    """(v, N, z) -> force, rate of a case."""
    law = CASES[name]
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
    outputs = [law.force(v, N, z), law.rate(v, N, z)]
    return ca.Function("law", [v, N, z], outputs, ["v", "N", "z"], ["force", "rate"])


@cache
def symbolic(name: str) -> tuple[list[str], ca.SX, ca.SX, dict[str, float]]:
    """Names and symbols of v, z and every parameter, (force, rate) stacked, and their values.

    The normal force is 7.848 N, that of the block of the Rabinowicz scene.
    """
    law, variables = symbolise(CASES[name], *parameters(CASES[name]))
    v, z = ca.SX.sym("v"), state_symbols(law)
    names = ["v", *(s.name for s in law.states), *(p.name for p in variables)]
    symbols = ca.vertcat(v, z, *(p.symbol for p in variables))
    outputs = ca.vertcat(law.force(v, 7.848, z), law.rate(v, 7.848, z))
    return names, symbols, outputs, {p.name: float(p.start) for p in variables}
