"""An option that is switched off leaves no trace in the expressions."""

from collections.abc import Callable

import casadi as ca
import pytest
from law_cases import state_symbols

from symfric import (
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
    symbolise,
)
from symfric.laws import (
    Andersson,
    BrittleSelfTuning,
    Hollars,
    PoppStelter,
    PowerLawViscous,
    QuarterCarGeneral,
    RuiWang,
    Specker,
    SteadyStateLuGre,
    Tustin,
)


def instructions(law: Law) -> int:
    """Arithmetic of force and rate, with common parts counted once."""
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
    outputs = ca.cse(ca.vertcat(law.force(v, N, z), law.rate(v, N, z)))
    free = ca.symvar(ca.vertcat(outputs, v, N, z))
    f = ca.Function("f", [ca.vertcat(*free)], [outputs])
    idle = {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST}
    return sum(f.instruction_id(k) not in idle for k in range(f.n_instructions()))


OPTIONS: list[tuple[Callable[..., Law], str, float, float]] = [
    (BrownMcPhee, "mu_v", 0.0, 0.4),
    (Stribeck, "sigma_2", 0.0, 0.4),
    (Stribeck, "delta", 2.0, 1.5),
    (SelfTuning, "E", 0.0, 0.5),
    (Dahl, "n", 1.0, 2.0),
    (LuGre, "sigma_1", 0.0, 190.0),
    (LuGre, "sigma_2", 0.0, 0.4),
    (LuGre, "delta", 2.0, 1.5),
    (LuGre, "v_eps", 0.0, 1e-6),
    (PowerLawViscous, "d", 1.0, 1.5),
    (Tustin, "v_eps", 0.0, 1e-4),
    (Andersson, "p", 2.0, 1.5),
    (SteadyStateLuGre, "delta", 2.0, 3.2),
    (PoppStelter, "kappa", 0.0, 0.1),
    (Specker, "sigma_2", 0.0, 0.4),
    (RuiWang, "E", 0.0, 0.5),
    (BrittleSelfTuning, "E", 0.0, 0.5),
    (Hollars, "u_eps", 0.0, 0.2),
    (Hollars, "mu_v", 0.0, 0.4),
    (QuarterCarGeneral, "mu", 0.0, 0.1),
]


@pytest.mark.parametrize(
    ("kind", "name", "off", "on"), OPTIONS, ids=[f"{o[0].__name__}-{o[1]}" for o in OPTIONS]
)
def test_switched_off_option_costs_less_than_in_use_and_than_its_symbol(
    kind: Callable[..., Law], name: str, off: float, on: float
) -> None:
    without = instructions(kind(**{name: off}))
    assert without < instructions(kind(**{name: on}))
    assert without < instructions(symbolise(kind(), name)[0])


def test_equal_sides_cost_nothing() -> None:
    assert instructions(Asymmetric(LuGre(), LuGre())) == instructions(LuGre())


def test_each_parameter_that_differs_costs_two_products_and_a_sum() -> None:
    one = instructions(Asymmetric(LuGre(), LuGre(sigma_0=2e5)))
    two = instructions(Asymmetric(LuGre(), LuGre(sigma_0=2e5, sigma_1=200.0)))
    assert two - one == 3


def test_sum_costs_one_addition_per_further_term() -> None:
    parts = instructions(Stribeck()) + instructions(Viscous())
    assert instructions(Sum((Stribeck(), Viscous()))) == parts + 1


def test_load_wrapper_without_preload_and_share_costs_the_smooth_maximum_only() -> None:
    full = instructions(LoadDependent(Stribeck(), N_0=2.0, c=0.5))
    plain = instructions(LoadDependent(Stribeck()))
    assert full - plain == 2


@pytest.mark.parametrize(
    ("law", "count"),
    [
        (Viscous(), 1),
        (Coulomb(), 4),
        (SelfTuning(), 6),
        (Dahl(), 8),
        (Stribeck(), 10),
        (BrownMcPhee(), 12),
        (LuGre(), 17),
    ],
    ids=lambda value: type(value).__name__,
)
def test_arithmetic_of_a_default_law_is_as_stored(law: Law, count: int) -> None:
    assert instructions(law) == count
