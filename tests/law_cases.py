"""The laws that the contract tests run over, and their compiled derivatives."""

from functools import cache

import casadi as ca

import symfric as sf

DYNAMIC: dict[str, sf.Law] = {
    "bliman_sorine, order 1": sf.BlimanSorine(order="1"),
    "haessig_friedland, event": sf.HaessigFriedland(form="event"),
    "elasto_plastic, viscous": sf.ElastoPlastic(sigma_2=0.4),
    "maxwell_slip, n 2": sf.MaxwellSlip(n=2.0),
    "maxwell_slip, event": sf.MaxwellSlip(form="event"),
    "gms, event, viscous": sf.GMS(sigma_2=0.4, form="event"),
    "stick_slip, published": sf.StickSlip(branch="published"),
    "bristle_2d, kappa 0.2": sf.Bristle2D(kappa=0.2),
    "lagged(stribeck)": sf.Lagged(sf.Stribeck(sigma_2=0.4)),
    "temperature_dependent(lugre)": sf.TemperatureDependent(
        sf.LuGre(sigma_2=0.4), T=303.15, k_dry=0.01
    ),
    "karnopp, event": sf.Karnopp(sigma_2=0.4, form="event"),
    "exact_coulomb, stribeck": sf.ExactCoulomb(sigma_2=0.4, form="stribeck"),
    "leine_switch, event": sf.LeineSwitch(form="event"),
    "rate_and_state, slip": sf.RateAndState(evolution="slip"),
}
"""Laws with states whose options lead to other expressions than the defaults."""

SYMMETRIC: dict[str, sf.Law] = {
    **{name: kind() for name, kind in sf.ALL_LAWS.items() if kind.facts.odd},
    "stribeck, delta 0.78, viscous": sf.Stribeck(delta=0.78, sigma_2=0.4),
    "brown_mcphee, viscous": sf.BrownMcPhee(mu_v=0.4),
    "self_tuning, E 0.5": sf.SelfTuning(E=0.5),
    "coulomb, atan": sf.Coulomb(shape="atan"),
    "coulomb, erf": sf.Coulomb(shape="erf"),
    "coulomb, sqrt": sf.Coulomb(shape="sqrt"),
    "popp_stelter, quadratic": sf.PoppStelter(kappa=0.1),
    "hollars, viscous": sf.Hollars(mu_v=0.4),
    "specker, viscous": sf.Specker(sigma_2=0.4),
    "makkar_dixon, viscous": sf.MakkarDixon(gamma_6=0.4),
    "rui_wang, E 0.5": sf.RuiWang(E=0.5),
    "power_law_viscous, d 0.5": sf.PowerLawViscous(d=0.5),
    "steady_state_lugre, main": sf.SteadyStateLuGre.main(),
    "bam, m1": sf.BAM(K_s=0.0, K_e=0.0, K_m=0.0, K_es=0.0, K_ms=0.0),
    "bam, m6": sf.BAM(Q_e=0.01, Q_m=0.02),
    "dahl, n 2": sf.Dahl(n=2.0),
    "dahl, n 0.5": sf.Dahl(n=0.5),
    "lugre, delta 0.78, viscous": sf.LuGre(delta=0.78, sigma_2=0.4, v_eps=1e-6),
    "coulomb+viscous": sf.Sum((sf.Coulomb(), sf.Viscous())),
    **DYNAMIC,
    "lugre+dahl": sf.Sum((sf.LuGre(), sf.Dahl())),
    "load_dependent(lugre)": sf.LoadDependent(sf.LuGre(), N_0=2.0, c=0.5),
}
"""Every law with default parameters, and those whose options lead to other expressions."""

CASES: dict[str, sf.Law] = {
    **SYMMETRIC,
    **{name: kind() for name, kind in sf.ALL_LAWS.items() if not kind.facts.odd},
    "asymmetric(lugre)": sf.Asymmetric(sf.LuGre(), sf.LuGre(mu_s=0.3, sigma_2=0.4)),
    "asymmetric(stribeck)": sf.Asymmetric(sf.Stribeck(), sf.Stribeck(mu_d=0.12, v_s=2e-3)),
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


EXAMPLE_INPUTS = {"F_e": 0.6, "dv": 0.3, "tau_m": 0.4, "tau_e": -0.3, "x_rel": 1e-3, "v_rel": 0.05}
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
