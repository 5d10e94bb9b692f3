"""Forces of every static law against plain Python, and against the digits of a catalogue.

Levels 1 N and 1.5 N, characteristic velocity 1e-3 m/s; the catalogue prints nine digits after the
point, computed there by a third program.
"""

from collections.abc import Callable
from dataclasses import replace

import plain_laws
import pytest

from symfric import BrownMcPhee, Coulomb, Law, LuGre, Stribeck
from symfric.laws import (
    BAM,
    Ambrosio,
    Andersson,
    Awrejcewicz,
    BengisuAkay,
    Benson,
    Bittencourt,
    Capstan,
    DuanSingh,
    Exudyn,
    Hollars,
    Karnopp,
    LeineSwitch,
    Lorentzian,
    MakkarDixon,
    ModifiedThrelfall,
    PoppStelter,
    QuarterCarGeneral,
    RuiWang,
    SimscapeBreakaway,
    Specker,
    SteadyStateLuGre,
    Step5,
    Threlfall,
    VelocityBased,
    Wojewoda,
)

V = (1e-4, 5e-4, 1e-3, 2e-3, 1e-2)
BOTH = {"mu_s": 1.5, "mu_d": 1.0}
PRINTED: dict[str, tuple[Law, tuple[float, ...]]] = {
    "coulomb_tanh": (
        Coulomb(1.0),
        (0.099667995, 0.462117157, 0.761594156, 0.964027580, 0.999999996),
    ),
    "coulomb_atan": (
        Coulomb(1.0, shape="atan"),
        (0.063451035, 0.295167235, 0.500000000, 0.704832765, 0.936548965),
    ),
    "coulomb_erf": (
        Coulomb(1.0, shape="erf"),
        (0.112462916, 0.520499878, 0.842700793, 0.995322265, 1.000000000),
    ),
    "coulomb_sqrt": (
        Coulomb(1.0, shape="sqrt"),
        (0.099503719, 0.447213595, 0.707106781, 0.894427191, 0.995037190),
    ),
    "coulomb_saturation": (Coulomb(1.0, shape="saturation"), (0.1, 0.5, 1.0, 1.0, 1.0)),
    "coulomb_quadratic": (Coulomb(1.0, shape="quadratic"), (0.19, 0.75, 1.0, 1.0, 1.0)),
    "threlfall": (
        Threlfall(1.0, form="original"),
        (0.259181779, 0.776869840, 0.950212932, 0.95, 0.95),
    ),
    "modified_threlfall": (
        ModifiedThrelfall(1.0, form="original"),
        (0.272761789, 0.817574476, 1.0, 1.0, 1.0),
    ),
    "ambrosio": (Ambrosio(1.0, form="original"), (0.0, 0.375, 1.0, 1.0, 1.0)),
    "bengisu_akay": (
        BengisuAkay(**BOTH, form="original"),
        (0.285, 1.125, 1.5, 1.183939721, 1.000061705),
    ),
    "velocity_based": (
        VelocityBased(**BOTH, form="original"),
        (0.22425, 1.03125, 1.5, 1.0, 1.0),
    ),
    "benson": (
        Benson(**BOTH, v_eps=0.0),
        (1.452418709, 1.303265330, 1.183939721, 1.067667642, 1.000022700),
    ),
    "andersson": (
        Andersson(**BOTH),
        (1.138602240, 1.389274240, 1.183939716, 1.009157819, 1.000000000),
    ),
    "hollars": (
        Hollars(**BOTH, v_t=1e-3, u_eps=0.0),
        (0.199009901, 0.9, 1.5, 1.2, 1.009900990),
    ),
    "exudyn": (
        Exudyn(**BOTH, u_eps=0.0),
        (0.15, 0.75, 1.5, 1.183939721, 1.000061705),
    ),
    "step5": (Step5(**BOTH), (0.01284, 0.75, 1.5, 1.25, 1.0)),
    "brown_mcphee": (
        BrownMcPhee(**BOTH),
        (0.468248208, 1.342725805, 1.499329300, 1.326530387, 1.007540767),
    ),
    "simscape_breakaway": (
        SimscapeBreakaway(**BOTH),
        (0.843619068, 1.363657058, 1.499999996, 1.223130160, 1.000000000),
    ),
    "specker": (
        Specker(**BOTH),
        (0.843619069, 1.363657061, 1.500000000, 1.223130162, 1.000000000),
    ),
    "makkar_dixon": (
        MakkarDixon(),
        (1.092557237, 1.268805228, 1.119202916, 1.017986210, 1.000000002),
    ),
    "leine_slip": (
        LeineSwitch(1.5, form="original"),
        (1.499550135, 1.497753370, 1.495513460, 1.491053678, 1.456310680),
    ),
    "leine_atan": (
        LeineSwitch(1.5, v_eps=1e-6),
        (1.490004020, 1.495846374, 1.494561387, 1.490579061, 1.456217968),
    ),
    "popp_stelter": (
        PoppStelter(1.5, d=1.0, kappa=0.1, v_eps=0.0),
        (1.499925008, 1.499625212, 1.499250849, 1.498503394, 1.492584257),
    ),
}
FORMULAS: dict[str, Callable[[float], float]] = {
    name: getattr(plain_laws, name) for name in PRINTED
}
UNPRINTED: dict[str, tuple[Law, Callable[[float], float]]] = {
    "lorentzian": (Lorentzian(**BOTH, v_eps=0.0), plain_laws.lorentzian),
    "duan_singh": (DuanSingh(**BOTH), plain_laws.duan_singh),
    "rui_wang": (RuiWang(E=0.5), plain_laws.rui_wang),
    "capstan": (Capstan(0.2, beta=1.5707963267948966, v_eps=0.0), plain_laws.capstan),
    "pilot": (SteadyStateLuGre(v_eps=0.0), plain_laws.steady_state_lugre_pilot),
    "main": (
        replace(SteadyStateLuGre.main(), v_eps=0.0),
        plain_laws.steady_state_lugre_main,
    ),
}
STRIBECK: dict[float, tuple[float, ...]] = {
    0.78: (1.423540613, 1.279287385, 1.183939721, 1.089790325, 1.001208056),
    1.0: (1.452418709, 1.303265330, 1.183939721, 1.067667642, 1.000022700),
    2.0: (1.495024917, 1.389400392, 1.183939721, 1.009157819, 1.000000000),
    3.2: (1.499684621, 1.448446451, 1.183939721, 1.000051049, 1.000000000),
}
FINE = [0.0123 * 1.17**k * 1e-3 for k in range(60)]
"""Velocities from 1e-5 to 0.13 m/s, on no knot of any law."""


@pytest.mark.parametrize("name", PRINTED)
def test_force_has_the_printed_digits(name: str) -> None:
    law, row = PRINTED[name]
    for v, F in zip(V, row, strict=True):
        assert law.force(v, 1.0) == pytest.approx(F, abs=5.1e-10)
        assert law.force(-v, 1.0) == pytest.approx(-F, abs=5.1e-10)


@pytest.mark.parametrize("name", PRINTED)
def test_force_is_that_of_plain_python(name: str) -> None:
    law, formula = PRINTED[name][0], FORMULAS[name]
    for v in (*V, *FINE):
        assert law.force(v, 1.0) == pytest.approx(formula(v), rel=1e-12, abs=1e-15)
        assert law.force(-v, 1.0) == -law.force(v, 1.0)


@pytest.mark.parametrize("name", UNPRINTED)
def test_force_of_a_law_outside_the_table_is_that_of_plain_python(name: str) -> None:
    law, formula = UNPRINTED[name]
    for v in (*V, *FINE):
        assert law.force(v, 1.0) == pytest.approx(formula(v), rel=1e-12)


CURVE = [(d, v, g) for d, row in STRIBECK.items() for v, g in zip(V, row, strict=True)]


@pytest.mark.parametrize(("delta", "v", "g"), CURVE)
def test_stribeck_force_has_the_printed_digits(delta: float, v: float, g: float) -> None:
    law = Stribeck(**BOTH, delta=delta, v_eps=0.0)
    assert law.force(v, 1.0) == pytest.approx(g, abs=5.1e-10)
    assert law.force(v, 1.0) == pytest.approx(plain_laws.stribeck(v, delta), rel=1e-12)
    smooth = Stribeck(**BOTH, delta=delta, v_eps=1e-12)
    assert smooth.force(v, 1.0) == pytest.approx(g, abs=1e-7 if delta < 1 else 1e-9)


@pytest.mark.parametrize(("delta", "v", "g"), CURVE)
def test_lugre_slides_at_the_printed_level(delta: float, v: float, g: float) -> None:
    law = LuGre(**BOTH, delta=delta, v_eps=0.0)
    for N, direction in ((1.0, 1.0), (7.0, -1.0)):
        force = law.force(direction * v, N, law.steady_state(direction * v, N))
        assert force == pytest.approx(direction * N * g, abs=N * 5.1e-10)


MM_PER_MIN = (100, 140, 210, 294, 390, 500)


@pytest.mark.parametrize(
    ("law", "row"),
    [
        (SteadyStateLuGre.pilot(), (3.2145, 3.1306, 3.3552, 3.6768, 4.0448, 4.4665)),
        (SteadyStateLuGre.main(), (4.2237, 4.1312, 3.8051, 3.2418, 2.7793, 2.6550)),
    ],
)
def test_published_sets_give_the_printed_forces(law: Law, row: tuple[float, ...]) -> None:
    for speed, F in zip(MM_PER_MIN, row, strict=True):
        assert law.force(speed / 60000, 99.0) == pytest.approx(F, abs=5.1e-5)


SLOW = (-3e-3, -1e-3, -7e-4, -1e-5, 0.0, 1e-5, 5e-4, 9.99e-4, 1e-3, 2e-3, 0.05)
LOADS = (-3.0, -1.5, -0.4, 0.0, 0.2, 1.2, 1.5, 1.7)


@pytest.mark.parametrize("F_e", LOADS)
@pytest.mark.parametrize("v", SLOW)
def test_one_expression_equals_the_four_branches(v: float, F_e: float) -> None:
    law = Awrejcewicz(**BOTH, form="original")
    expected = plain_laws.awrejcewicz(v, F_e)
    assert law.force(v, 1.0, F_e=F_e) == pytest.approx(expected, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("F_e", LOADS)
@pytest.mark.parametrize("v", SLOW)
def test_karnopp_is_the_switch_as_printed(v: float, F_e: float) -> None:
    law = Karnopp(**BOTH, form="original")
    assert law.force(v, 1.0, F_e=F_e) == pytest.approx(plain_laws.karnopp(v, F_e), rel=1e-12)


@pytest.mark.parametrize(
    ("v", "printed"),
    [(0.0, True), *((v, form) for v in (-0.3, -0.01, 2e-3, 0.1) for form in (True, False))],
)
@pytest.mark.parametrize(("x_rel", "v_rel"), [(5e-3, 0.0), (-6.9e-3, 0.02), (0.0, -0.3)])
def test_quarter_car_is_the_equation_of_the_paper(
    v: float, printed: bool, x_rel: float, v_rel: float
) -> None:
    law = QuarterCarGeneral(form="as_printed" if printed else "smooth", sigma_v=50.0)
    expected = plain_laws.quarter_car(v, x_rel, v_rel, printed)
    assert law.force(v, 1.0, x_rel=x_rel, v_rel=v_rel) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("dv", [-3.0, -0.5, 0.5, 3.0])
@pytest.mark.parametrize("v", [5e-3, 0.1])
def test_wojewoda_has_a_branch_for_each_sign_of_the_acceleration(v: float, dv: float) -> None:
    law = Wojewoda(**BOTH, v_eps=1e-6, a_eps=1e-4)
    assert law.force(v, 1.0, dv=dv) == pytest.approx(plain_laws.wojewoda(v, dv), rel=1e-12)


@pytest.mark.parametrize("tau_m", [-1.0, -0.3, 0.2, 0.9])
@pytest.mark.parametrize("tau_e", [-0.7, 0.4])
@pytest.mark.parametrize("v", [0.1, 3.0])
def test_bam_is_the_budget_of_its_largest_model(v: float, tau_m: float, tau_e: float) -> None:
    law = BAM(K_s=0.03, K_e=0.04, K_m=0.06, K_es=0.02, K_ms=0.05, Q_e=0.01, Q_m=0.02, v_eps=1e-9,
              tau_eps=1e-6)  # fmt: skip
    expected = plain_laws.bam(v, tau_m, tau_e)
    assert law.force(v, 1.0, tau_m=tau_m, tau_e=tau_e) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("N", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("v", [0.5, 10.0, 200.0])
def test_bittencourt_is_the_sum_of_its_parts(v: float, N: float) -> None:
    law = Bittencourt(v_eps=1e-9, F_eps=0.0)
    assert law.force(v, N) == pytest.approx(plain_laws.bittencourt(v, N), rel=1e-10)
