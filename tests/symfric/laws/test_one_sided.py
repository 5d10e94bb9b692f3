"""One side of v = 0: what laws tend to as their widths vanish, and what rest then holds."""

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES, given_inputs

from symfric import (
    Asymmetric,
    BrownMcPhee,
    Coulomb,
    Karnopp,
    Law,
    SelfTuning,
    Stribeck,
    Sum,
    Viscous,
    parameters,
    with_values,
)
from symfric.laws import Capstan, Exudyn, Hollars, MakkarDixon, QuarterCarGeneral
from symfric.laws.base.law import FORCE

N = 7.848
REFUSED = ("wojewoda", "rate_and_state", "rate_and_state, slip")
TOLD = [name for name in CASES if name not in REFUSED]
LAYERED = [name for name in TOLD if CASES[name].widths]
HELD = {
    "lugre+dahl": 0.25 * N, "load_dependent(lugre)": 0.15 * (2.0 + 0.5 * N),
    "asymmetric(lugre)": 0.15 * N, "armstrong": 0.15 * N, "bliman_sorine, order 1": 0.3 * N,
    "temperature_dependent(lugre)": 0.15 * N * np.exp(-0.1), "lagged(stribeck)": 0.15 * N,
}  # fmt: skip
"""Static levels of dynamic laws that are not mu_s N, or mu_d N where there is no mu_s."""

each_told = pytest.mark.parametrize("name", TOLD)
each_layered = pytest.mark.parametrize("name", LAYERED)


def narrowed(law: Law, share: float) -> Law:
    """The law with a layer that is `share` of what it was."""
    known = parameters(law)
    return with_values(law, {n: known[n].value * share**e for n, e in law.widths.items()})


def further(law: Law) -> dict[str, float]:
    """Further inputs but the applied force."""
    return {n: x for n, x in given_inputs(law).items() if n != FORCE}


@each_layered
@pytest.mark.parametrize("side", [1, -1])
def test_sliding_is_the_force_outside_of_a_thin_layer(name: str, side: int) -> None:
    thin = narrowed(CASES[name], 1e-7)
    for v in side * np.array([1e-3, 2e-2, 0.7]):
        z = thin.steady_state(v, N)
        told = float(thin.sliding(v, N, side, **further(thin)))
        assert told == pytest.approx(float(thin.force(v, N, z, **given_inputs(thin))), rel=1e-4)
        assert told == pytest.approx(CASES[name].sliding(v, N, side, **further(thin)), rel=1e-12)


@pytest.mark.parametrize("name", [n for n in TOLD if not CASES[n].widths])
@pytest.mark.parametrize("side", [1, -1])
def test_sliding_of_a_law_without_layer_is_that_of_steady_sliding(name: str, side: int) -> None:
    law = CASES[name]
    for v in side * np.array([1e-2, 0.7]):
        steady = float(law.force(v, N, law.steady_state(v, N), **given_inputs(law)))
        assert float(law.sliding(v, N, side)) == pytest.approx(steady, rel=1e-4)


@each_told
@pytest.mark.parametrize("side", [1, -1])
def test_derivatives_at_rest_are_those_of_the_side(name: str, side: int) -> None:
    """All orders up to two are finite at v = 0, and the slope is the one-sided quotient."""
    law = CASES[name]
    v = ca.SX.sym("v")
    F = ca.SX(law.sliding(v, N, side, **further(law)))
    slope = ca.gradient(F, v)
    at = ca.Function("at", [v], [F, slope, ca.gradient(slope, v)])
    here = [float(x) for x in at(0.0)]
    assert np.isfinite(here).all()
    if "delta 0.78" in name:  # infinite as it stands: its power is rounded over 1e-6 v_s
        return
    h = side * 1e-8
    quotient = (4 * float(at(h)[0]) - float(at(2 * h)[0]) - 3 * here[0]) / (2 * h)
    assert here[1] == pytest.approx(quotient, rel=2e-3, abs=2e-3 * abs(here[0]))
    beyond = [float(x) for x in at(-side * 10.0)]
    assert np.isfinite(beyond).all()


@pytest.mark.parametrize("name", [n for n in LAYERED if not CASES[n].states])
@pytest.mark.parametrize("side", [1, -1])
def test_static_level_is_the_top_of_a_thin_layer(name: str, side: int) -> None:
    law = CASES[name]
    rounded = {n: 0.0 for n in ("u_eps",) if n in parameters(law)}
    thin = narrowed(with_values(law, rounded), 1e-7)
    v = side * np.concatenate([np.geomspace(1e-16, 1e-6, 20001), [0.0]])
    z = thin.steady_state(v, N)
    pull = {FORCE: side * 1e3} if FORCE in given_inputs(law) else {}
    top = np.max(side * np.asarray(thin.force(v, N, z, **{**given_inputs(law), **pull})))
    wanted = law.static_level(N, side, **further(law))
    if name == "quarter_car_general":  # what it carries at rest, unless that is beyond F_brk
        wanted = 0.001 * 28900.0 + 0.05 * 260.0
        top = thin.force(0.0, N, **further(law))
    assert float(wanted) == pytest.approx(top, rel=2e-3)


@pytest.mark.parametrize("name", [n for n in TOLD if CASES[n].states])
def test_static_level_of_a_law_with_states(name: str) -> None:
    law, known = CASES[name], parameters(CASES[name])
    level = next((known[n].value for n in ("mu_s", "mu_s_pos", "mu_d") if n in known), 0.0)
    wanted = HELD.get(name, level * N)
    if name == "bliman_sorine":  # the top of its force along a slow slide from rest
        path = np.linspace(0.0, 1e-4, 200001) / 1e-5
        fast, slow = 0.3 * (1 - np.exp(-path / 0.4)), 0.2 * (1 - np.exp(-path))
        wanted = N * np.max(fast - slow)
    if name.startswith("maxwell_slip"):
        wanted = 0.1 * N
    if name == "bouc_wen":
        assert law.static_level(N) == law.sliding(1.0, N, 1)
    assert float(law.static_level(N)) == pytest.approx(float(wanted), rel=1e-8)


@pytest.mark.parametrize("name", REFUSED)
def test_laws_without_the_limit_say_why(name: str) -> None:
    law = CASES[name]
    for ask in (lambda: law.sliding(0.1, N, 1), lambda: law.static_level(N)):
        with pytest.raises(ValueError, match=f"{type(law).__name__}: expected .* got one without"):
            ask()
    with pytest.raises(ValueError, match="as printed"):
        QuarterCarGeneral(form="as_printed").sliding(0.1, N, 1)


def test_laws_of_ones_own_are_asked_to_say_it() -> None:
    class Own(Viscous):  # pyright: ignore[reportGeneralTypeIssues]
        outside = Law.outside

    with pytest.raises(ValueError, match="write its method `outside"):
        Own().sliding(0.1, N, -1)


def test_widths_have_flat_names_and_no_zeros() -> None:
    assert BrownMcPhee().widths == {"v_t": 1}
    assert SelfTuning().widths == {"B": -1}
    assert Stribeck(v_eps=0.0).widths == {}
    assert Karnopp().widths == {"D_v": 1}
    law = Sum((Coulomb(), Stribeck(), Viscous()))
    assert law.widths == {"v_eps_1": 1, "v_eps_2": 1}
    pair = Asymmetric(Stribeck(), Stribeck(mu_s=0.3))
    assert pair.widths == {"v_blend": 1, "v_eps_pos": 1, "v_eps_neg": 1}


def test_levels_of_both_sides_are_told_apart() -> None:
    pair = Asymmetric(Stribeck(), Stribeck(mu_s=0.3))
    assert (pair.static_level(10.0), pair.static_level(10.0, -1)) == (1.5, 3.0)
    assert pair.sliding(0.0, 10.0, -1) == -3.0
    belt = Capstan(mu_d=0.1, beta=1.0)
    assert belt.static_level(1.0) == pytest.approx(np.exp(0.1) - 1)
    assert belt.static_level(1.0, -1) == pytest.approx(1 - np.exp(-0.1))
    assert belt.sliding(-1.0, 1.0, -1) == pytest.approx(np.exp(-0.1) - 1)


def test_curves_with_a_velocity_of_their_own_stay() -> None:
    law = Stribeck(v_s=0.1)
    assert law.sliding(0.1, 1.0, 1) == pytest.approx(0.1 + 0.05 * np.exp(-1))
    assert MakkarDixon(gamma_3=10.0).sliding(-0.1, 1.0, -1) == pytest.approx(
        -(0.5 * (1 - np.tanh(1.0)) + 1.0)
    )


@pytest.mark.parametrize("kind", [Hollars, Exudyn])
def test_rounding_a_peak_takes_what_the_docstring_says(kind: type[Law]) -> None:
    v = np.geomspace(1e-4, 1e-1, 20001)
    lost = 1 - np.max(kind().force(v, 1.0)) / kind().static_level(1.0)
    assert 0.02 < lost < 0.06
