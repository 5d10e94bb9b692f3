"""Laws with states whose options lead to other expressions than the defaults."""

from symfric import Law, LuGre, Stribeck
from symfric.laws import (
    GMS,
    BlimanSorine,
    Bristle2D,
    ElastoPlastic,
    ExactCoulomb,
    HaessigFriedland,
    Karnopp,
    Lagged,
    LeineSwitch,
    MaxwellSlip,
    RateAndState,
    StickSlip,
    TemperatureDependent,
)

DYNAMIC: dict[str, Law] = {
    "bliman_sorine, order 1": BlimanSorine(order="1"),
    "haessig_friedland, event": HaessigFriedland(form="event"),
    "elasto_plastic, viscous": ElastoPlastic(sigma_2=0.4),
    "maxwell_slip, n 2": MaxwellSlip(n=2.0),
    "maxwell_slip, event": MaxwellSlip(form="event"),
    "gms, event, viscous": GMS(sigma_2=0.4, form="event"),
    "stick_slip, published": StickSlip(branch="published"),
    "bristle_2d, kappa 0.2": Bristle2D(kappa=0.2),
    "lagged(stribeck)": Lagged(Stribeck(sigma_2=0.4)),
    "temperature_dependent(lugre)": TemperatureDependent(LuGre(sigma_2=0.4), T=303.15, k_dry=0.01),
    "karnopp, event": Karnopp(sigma_2=0.4, form="event"),
    "exact_coulomb, stribeck": ExactCoulomb(sigma_2=0.4, form="stribeck"),
    "leine_switch, event": LeineSwitch(form="event"),
    "rate_and_state, slip": RateAndState(evolution="slip"),
}

SETTLED = {"gonthier": 6e-3, "bristle_2d": 1e-6, "bristle_2d, kappa 0.2": 1e-6}
"""Speed [m/s] from which the steady state of a law is exact, as its docstring says."""
