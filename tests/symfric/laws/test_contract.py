"""What every law promises, checked over all of them."""

import re
from dataclasses import fields
from functools import cache
from inspect import getdoc
from itertools import product
from math import isfinite

import casadi as ca
import numpy as np
import pytest
from dynamic_cases import SETTLED
from hypothesis import given
from hypothesis import strategies as st
from law_cases import (
    BRISTLE,
    CASES,
    STATIC,
    SYMMETRIC,
    compiled,
    given_inputs,
    state_symbols,
    symbolic,
)

from docs.machine.items import MADE_OF_LAWS
from symfric import (
    ALL_LAWS,
    BrownMcPhee,
    Law,
    LuGre,
    SelfTuning,
    Stribeck,
    parameters,
    symbolise,
    with_values,
)
from symfric.foundation.parameters import ROLES
from symfric.laws import (
    PHENOMENA,
    POPULATIONS,
    Asymmetric,
    Element,
    Lagged,
    LoadDependent,
    LoadNormalised,
    PlanarSlip,
    Slider,
    Table,
    TemperatureDependent,
)
from symfric.laws.base.law import CONFIDENCE
from symfric.scenes import ALL_SCENES, Robot

magnitudes = st.floats(-12.0, 3.0).map(lambda e: 10.0**e)
velocities = st.builds(lambda s, m: s * m, st.sampled_from([-1.0, 1.0]), magnitudes)
loads = st.floats(0.2, 1e3)
deflections = st.floats(-1.5, 1.5)

EXTREMES = [s * m for m in (0.0, 1e-300, 1e-12, 1e-6, 1e-3, 1.0, 1e3) for s in (1.0, -1.0)]

each_law = pytest.mark.parametrize("kind", ALL_LAWS.values(), ids=ALL_LAWS.keys())
each_case = pytest.mark.parametrize("name", CASES)
each_symmetric = pytest.mark.parametrize("name", SYMMETRIC)
each_static = pytest.mark.parametrize("name", STATIC)
each_bristle = pytest.mark.parametrize("name", BRISTLE)


def mirrored(law: Law, z: np.ndarray) -> np.ndarray:
    """The internal states of the mirrored motion."""
    signs = np.array([1.0 if state.even else -1.0 for state in law.states])
    return signs.reshape(-1, *[1] * (z.ndim - 1)) * z


def stretched(law: Law, N: float, share: float) -> np.ndarray:
    """Internal states at a share of what steady sliding gives."""
    return share * np.asarray(law.steady_state(1.0, N))


@cache
def derivatives(name: str) -> ca.Function:
    """Force and rate with gradients and Hessians in v, z and every parameter."""
    _, symbols, outputs, _ = symbolic(name)
    expressions = [outputs, ca.jacobian(outputs, symbols)]
    expressions += [ca.hessian(outputs[i], symbols)[0] for i in range(outputs.numel())]
    return ca.Function("derivatives", [symbols], expressions)


def level(law: Law, which: str) -> float:
    """Sum of the given friction coefficient over the terms of a law."""
    return sum(float(p.value) for n, p in parameters(law).items() if n.startswith(which))


@each_symmetric
@given(v=velocities, N=loads, share=deflections)
def test_force_and_rate_are_odd(name: str, v: float, N: float, share: float) -> None:
    law = SYMMETRIC[name]
    z = stretched(law, N, share)
    forward = compiled(name)(v, N, z, 1.0)
    backward = compiled(name)(-v, N, mirrored(law, z), -1.0)
    assert float(forward[0]) == -float(backward[0])
    np.testing.assert_array_equal(mirrored(law, forward[1].full()), backward[1].full())


@each_case
@given(v=velocities, N=loads)
def test_steady_sliding_takes_power(name: str, v: float, N: float) -> None:
    law = CASES[name]
    assert law.force(v, N, law.steady_state(v, N)) * v >= 0


LEVELS = [n for n in STATIC if {"mu_s", "mu_d"} & set(parameters(SYMMETRIC[n]))]


@pytest.mark.parametrize("name", LEVELS)
@given(v=velocities, N=loads, mu_s=st.floats(1e-3, 2.0), ratio=st.floats(0.5, 1.0))
def test_static_force_stays_below_static_level_plus_viscous(
    name: str, v: float, N: float, mu_s: float, ratio: float
) -> None:
    known = parameters(SYMMETRIC[name])
    chosen = {"mu_s": mu_s, "mu_d": mu_s * ratio if "mu_s" in known else mu_s}
    law = with_values(SYMMETRIC[name], {n: x for n, x in chosen.items() if n in known})
    top = level(law, "mu_s") or level(law, "mu_d")
    viscous = level(law, "sigma_2") + level(law, "mu_v") * max(N, 1.0)
    bound = top * N + (viscous + level(law, "kappa") * N * abs(v)) * abs(v)
    # the peaks of two laws overshoot by what tanh(10) lacks of 1
    excess = 1e-8 if name.startswith(("specker", "simscape")) else 1e-15
    assert abs(law.force(v, N)) <= bound * (1 + excess)


@pytest.mark.parametrize("name", ["dahl", "dahl, n 2", "dahl, n 0.5", "lugre"])
@given(v=velocities, N=loads)
def test_bristle_never_grows_beyond_its_limit(name: str, v: float, N: float) -> None:
    law = with_values(CASES[name], {"v_eps": 0.0})
    limit = (level(law, "mu_s") or level(law, "mu_d")) * N / level(law, "sigma_0")
    inward = -float(law.rate(v, N, np.array([np.sign(v) * limit]))[0]) * np.sign(v)
    assert inward >= -1e-12 * abs(v)


@each_bristle
@given(v=velocities, N=loads)
def test_rate_vanishes_in_steady_sliding(name: str, v: float, N: float) -> None:
    law = SYMMETRIC[name]
    smoothing = [float(p.value) for n, p in parameters(law).items() if n.startswith("v_eps")]
    v += np.sign(v) * (SETTLED.get(name, 0.0) + 20 * max(smoothing, default=0.0))
    z = law.steady_state(v, N)
    rate, near = np.abs(law.rate(v, N, z)), np.abs(law.rate(v, N, 0.9 * z))
    assert (rate <= 1e-11 * np.maximum(near, abs(v))).all()


STATIC_KINDS = [n for n, kind in ALL_LAWS.items() if not kind().states]
PROPORTIONAL = [n for n in STATIC_KINDS if ALL_LAWS[n].facts.load == "proportional"]
INDEPENDENT = [n for n in STATIC_KINDS if ALL_LAWS[n].facts.load == "independent"]


@pytest.mark.parametrize("name", PROPORTIONAL)
@given(v=velocities, N=loads, factor=st.floats(0.01, 100.0))
def test_dry_force_is_proportional_to_the_load(
    name: str, v: float, N: float, factor: float
) -> None:
    law = CASES[name]
    assert law.force(v, factor * N) == pytest.approx(factor * law.force(v, N), rel=1e-14)


@pytest.mark.parametrize("name", INDEPENDENT)
@given(v=velocities, N=loads)
def test_force_without_load_is_the_same_where_the_law_says_so(
    name: str, v: float, N: float
) -> None:
    law, w = CASES[name], given_inputs(CASES[name])
    assert law.force(v, N, **w) == law.force(v, 0.0, **w)


@pytest.mark.parametrize("name", ["dahl", "lugre"])
@given(v=velocities, N=loads, factor=st.floats(0.01, 100.0))
def test_steady_bristle_force_is_proportional_to_the_load(
    name: str, v: float, N: float, factor: float
) -> None:
    law = with_values(CASES[name], {"v_eps": 0.0})
    one, other = (law.force(v, load, law.steady_state(v, load)) for load in (N, factor * N))
    assert other == pytest.approx(factor * one, rel=1e-9)


@each_case
def test_value_gradient_and_hessian_are_finite(name: str) -> None:
    names, _, _, values = symbolic(name)
    for v, share in product(EXTREMES, [0.0, 1.0, -1.0]):
        z = stretched(CASES[name], 7.848, share).ravel()
        results = derivatives(name)([v, *z, *(values[n] for n in names[1 + z.size :])])
        assert all(result.is_regular() for result in results), (v, share)


UNLOADED = [
    name
    for name in STATIC
    if SYMMETRIC[name].facts.load == "proportional" and name != "popp_stelter, quadratic"
]


@pytest.mark.parametrize("name", UNLOADED)
def test_without_load_only_viscous_friction_remains(name: str) -> None:
    law, v = SYMMETRIC[name], np.array(EXTREMES)
    viscous = level(law, "sigma_2") * v
    if name == "specker, viscous":
        viscous -= 0.4 * v * np.exp((1 - (v / 1e-3) ** 2) / 2)
    assert law.force(v, 0.0) == pytest.approx(viscous, rel=1e-12, abs=1e-300)


@each_case
def test_all_number_types_give_the_same(name: str) -> None:
    for v in (0.0, 3e-4, -0.2):
        every_number_type_gives_the_same(name, v)


def every_number_type_gives_the_same(name: str, v: float) -> None:
    law, N, w = CASES[name], 5.0, given_inputs(CASES[name])
    z = stretched(law, N, 0.7).ravel()
    n = z.size
    F, rate = float(law.force(v, N, z, **w)), np.asarray(law.rate(v, N, z, **w))
    assert rate.shape == (n,)
    many = law.force(np.full(3, v), N, np.tile(z[:, None], (1, 3)), **w)
    rates = law.rate(np.full(3, v), N, np.tile(z[:, None], (1, 3)), **w)
    assert many.shape == (3,)
    assert rates.shape == (n, 3)
    results = [(many[1], rates[:, 1]), tuple(r.full() for r in compiled(name)(v, N, z, 1.0))]
    x, L, s = ca.MX.sym("v"), ca.MX.sym("N"), ca.MX.sym("z", n)
    of_mx = ca.Function("law", [x, L, s], [law.force(x, L, s, **w), law.rate(x, L, s, **w)])
    results.append(tuple(r.full() for r in of_mx(v, N, z)))
    dm = ca.DM(v), ca.DM(N), ca.DM(z) if n else ca.DM(0, 1)
    assert law.force(*dm, **w).shape == (1, 1)
    assert law.rate(*dm, **w).shape == (n, 1)
    results.append((law.force(*dm, **w).full(), law.rate(*dm, **w).full()))
    for one, other in results:
        np.testing.assert_allclose(np.ravel(one), F, rtol=1e-14, atol=1e-300)
        np.testing.assert_allclose(np.ravel(other), rate, rtol=1e-12, atol=1e-18)


@each_case
@given(v=velocities, share=deflections)
def test_symbolised_law_equals_the_numeric_one(name: str, v: float, share: float) -> None:
    names, symbols, outputs, values = symbolic(name)
    z = stretched(CASES[name], 7.848, share).ravel()
    point = [v, *z, *(values[n] for n in names[1 + z.size :])]
    of_symbols = ca.Function("outputs", [symbols], [outputs])(point).full().ravel()
    expected = np.concatenate([np.ravel(r.full()) for r in compiled(name)(v, 7.848, z, 1.0)])
    scale = np.array([1.0, *np.full(z.size, abs(v))])
    np.testing.assert_allclose(of_symbols / scale, expected / scale, rtol=1e-12, atol=1e-12)


@each_case
def test_default_expressions_use_no_nonsmooth_primitive(name: str) -> None:
    law = CASES[name]
    v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
    if law.switches(v, N, z):
        pytest.skip("has modes")
    w = {name: ca.SX.sym(name) for name in given_inputs(law)}
    outputs = [law.force(v, N, z, **w), law.rate(v, N, z, **w)]
    function = ca.Function("law", [v, N, z, ca.vertcat(*w.values())], outputs)
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    forbidden = {ca.OP_IF_ELSE_ZERO, ca.OP_LT, ca.OP_LE}
    if law.facts.smoothness.startswith("C∞"):
        forbidden |= {ca.OP_SIGN, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX}
    assert not used & forbidden


@each_law
def test_docstring_states_equation_limits_and_source(kind: type[Law]) -> None:
    text = getdoc(kind) or ""
    assert "Limits:" in text
    assert "Source:" in text
    assert re.search(r"\n {4,}F ", text), "the equation of the force, indented"


@each_law
def test_facts_are_complete(kind: type[Law]) -> None:
    facts = kind.facts
    assert facts.phenomena
    assert set(facts.phenomena) <= set(PHENOMENA)
    assert facts.smoothness
    assert facts.source


WITH_FACTS = [k for k in (ALL_LAWS | POPULATIONS | MADE_OF_LAWS).values() if hasattr(k, "facts")]


@pytest.mark.parametrize("kind", WITH_FACTS)
def test_a_law_says_what_its_formula_was_compared_with(kind: type[Law]) -> None:
    facts = kind.facts
    assert facts.confidence in CONFIDENCE
    assert CONFIDENCE[facts.confidence] in facts.formula
    assert facts.checked in facts.formula
    if facts.confidence.endswith(("source", "sources")):
        assert facts.checked
        assert ("sources" not in facts.confidence) or re.search(
            "; | and |two |four ", facts.checked
        )
    if facts.confidence == "unverified":
        assert "written from memory" in facts.formula


@each_law
def test_every_parameter_carries_unit_text_and_bounds(kind: type[Law]) -> None:
    found = parameters(kind())
    own = [item.name for item in fields(kind) if "unit" in item.metadata]
    assert [name for name in found if name in own] == own
    for p in found.values():
        assert p.unit
        assert p.doc
        assert p.lower <= p.value <= p.upper
        assert p.value == p.default or p.name not in own


@each_law
def test_value_beyond_a_bound_is_refused_by_name(kind: type[Law]) -> None:
    for name, p in parameters(kind()).items():
        own = name in {item.name for item in fields(kind)}
        where = f"{kind.__name__}: {name}" if own else name.rpartition("_")[0]
        for value in (p.lower - 1, p.upper + 1):
            if isfinite(value):
                with pytest.raises(ValueError, match=rf"{where}: expected .* got {value:g}"):
                    with_values(kind(), {name: value})


@pytest.mark.parametrize("kind", [Stribeck, BrownMcPhee, SelfTuning, LuGre])
def test_dynamic_coefficient_above_the_static_one_is_refused(kind: type[Law]) -> None:
    with pytest.raises(ValueError, match=r"mu_d <= mu_s, got mu_d = 0.3 and mu_s = 0.2"):
        kind(mu_s=0.2, mu_d=0.3)


@each_law
def test_symbols_take_the_bounds_of_their_parameters(kind: type[Law]) -> None:
    known = parameters(kind())
    _, variables = symbolise(kind(), *known)
    for variable in variables:
        p = known[variable.name]
        assert (variable.lower, variable.upper) == (p.lower, p.upper)
        assert (variable.unit, variable.start) == (p.unit, p.value)


def test_every_parameter_of_every_law_and_scene_says_what_it_is_for() -> None:
    """Roles are data: identification, temperature and code generation read them, not texts."""
    wrappers = (
        Asymmetric, LoadDependent, LoadNormalised, Lagged, TemperatureDependent, PlanarSlip, Table,
    )  # fmt: skip
    parts = (*ALL_LAWS.values(), *POPULATIONS.values(), *wrappers, Element, Slider)
    for kind in (*parts, *ALL_SCENES.values(), Robot):
        for item in fields(kind):
            if "unit" in item.metadata:
                assert item.metadata["role"] in ROLES, f"{kind.__name__}.{item.name}"
