"""Properties of every law of the catalogue."""

import re
from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from inspect import getdoc
from itertools import product
from math import isfinite
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import settings
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
from refusing import not_refused

import symfric as sf
from docs.machine.items import MADE_OF_LAWS
from symfric.foundation.parameters import ROLES
from symfric.laws.base.phenomena import CONFIDENCE
from symfric.laws.catalogue import WRAPPERS
from symfric.scenes import ALL_SCENES, Robot

COUNT = 4 * settings().max_examples
RNG = np.random.default_rng(1)
V = RNG.choice([-1.0, 1.0], COUNT) * 10 ** RNG.uniform(-12, 3, COUNT)
LOADS, SHARES = RNG.uniform(0.2, 1e3, COUNT), RNG.uniform(-1.5, 1.5, COUNT)
"""Random velocities [m/s], normal forces [N] and shares of the states of steady sliding."""
EXTREMES = np.array([s * m for m in (0.0, 1e-300, 1e-12, 1e-6, 1e-3, 1.0, 1e3) for s in (1, -1)])
BLOCK = 7.848
"""Normal force of `symbolic` [N]."""


def mirrored(law: sf.Law, z: np.ndarray) -> np.ndarray:
    """Return the internal states of the mirrored motion."""
    return np.array([[1.0 if state.even else -1.0] for state in law.states]).reshape(-1, 1) * z


def stretched(law: sf.Law, N: float, shares: Iterable[float]) -> np.ndarray:
    """Return internal states at shares of what steady sliding gives, one column each."""
    return np.asarray(law.steady_state(1.0, N)).reshape(-1, 1) * np.array([*shares])


def level(law: sf.Law, which: str) -> float:
    """Return the sum of the given friction coefficient over the terms of a law."""
    return sum(float(p.value) for n, p in sf.parameters(law).items() if n.startswith(which))


def sliding(law: sf.Law, v: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Return the force of steady sliding at pairs of velocity and load."""
    pairs = zip(v, N, strict=True)
    return np.array([float(law.force(x, L, law.steady_state(x, L))) for x, L in pairs])


def test_force_and_rate_are_odd() -> None:
    for name, law in SYMMETRIC.items():
        z = np.asarray(law.steady_state(1.0, 1.0)).reshape(-1, 1) * SHARES * LOADS
        forwards = compiled(name)(V[None, :], LOADS[None, :], z, 1.0)
        backwards = compiled(name)(-V[None, :], LOADS[None, :], mirrored(law, z), -1.0)
        assert (forwards[0].full() == -backwards[0].full()).all(), name
        assert (mirrored(law, forwards[1].full()) == backwards[1].full()).all(), name
        v = np.array([-1e-2, -3e-4, 3e-4, 1e-2])
        found = sf.steady_force(law, v, BLOCK)
        assert found == pytest.approx(-found[::-1], rel=1e-12), name


def test_steady_sliding_takes_power() -> None:
    for name, law in CASES.items():
        assert (sliding(law, V, LOADS) * V >= 0).all(), name
        if not (law.inputs or law.states) and law.facts.odd:
            v = np.concatenate([[0.0], np.geomspace(1e-12, 10.0, 400)])
            assert (np.asarray(law.force(v, 5.0)) * v >= 0).all(), name


LEVELS = [n for n in STATIC if {"mu_s", "mu_d"} & set(sf.parameters(SYMMETRIC[n]))]


def test_static_force_stays_below_static_level_plus_viscous() -> None:
    for name, (mu_s, ratio) in product(LEVELS, [(1e-3, 0.7), (0.4, 0.5), (2.0, 1.0), (0.9, 0.98)]):
        known = sf.parameters(SYMMETRIC[name])
        chosen = {"mu_s": mu_s, "mu_d": mu_s * ratio if "mu_s" in known else mu_s}
        law = sf.with_values(SYMMETRIC[name], {n: x for n, x in chosen.items() if n in known})
        top = level(law, "mu_s") or level(law, "mu_d")
        viscous = level(law, "sigma_2") + level(law, "mu_v") * np.maximum(LOADS, 1.0)
        bound = top * LOADS + (viscous + level(law, "kappa") * LOADS * np.abs(V)) * np.abs(V)
        # the peaks of two laws overshoot by what tanh(10) lacks of 1
        excess = 1e-8 if name.startswith(("specker", "simscape")) else 1e-15
        assert (np.abs(law.force(V, LOADS)) <= bound * (1 + excess)).all(), law


def test_bristle_never_grows_beyond_its_limit() -> None:
    for name in ("dahl", "dahl, n 2", "dahl, n 0.5", "lugre"):
        law = sf.with_values(CASES[name], {"v_eps": 0.0})
        limit = (level(law, "mu_s") or level(law, "mu_d")) * LOADS / level(law, "sigma_0")
        rate = np.asarray(law.rate(V, LOADS, (np.sign(V) * limit)[None, :]))[0]
        assert (-rate * np.sign(V) >= -1e-12 * np.abs(V)).all(), name


SETTLED = {"gonthier": 6e-3, "bristle_2d": 1e-6, "bristle_2d, kappa 0.2": 1e-6}
"""Speed [m/s] from which the steady state of a law is exact, as its docstring says."""


def test_rate_vanishes_in_steady_sliding() -> None:
    for name in BRISTLE:
        law = SYMMETRIC[name]
        smoothing = [float(p.value) for n, p in sf.parameters(law).items() if n.startswith("v_eps")]
        slowest = SETTLED.get(name, 0.0) + 20 * max(smoothing, default=0.0)
        for v, N in zip(V + np.sign(V) * slowest, LOADS, strict=True):
            z = law.steady_state(v, N)
            rate, near = np.abs(law.rate(v, N, z)), np.abs(law.rate(v, N, 0.9 * z))
            assert (rate <= 1e-11 * np.maximum(near, abs(v))).all(), (name, v, N)


def test_the_force_depends_on_the_load_as_declared() -> None:
    factor = 10 ** (2 * SHARES / 1.5)
    for name, kind in sf.ALL_LAWS.items():
        law, w = kind(), given_inputs(kind())
        if law.states:
            continue
        F = np.asarray(law.force(V, LOADS, **w))
        if law.facts.load == "independent":
            assert (law.force(V, 0.0, **w) == F).all(), name
        elif law.facts.load == "proportional":
            plain = np.asarray(law.force(V, LOADS))
            assert law.force(V, factor * LOADS) == pytest.approx(factor * plain, rel=1e-14), name
    for name in ("dahl", "lugre"):
        law = sf.with_values(CASES[name], {"v_eps": 0.0})
        expected = factor * sliding(law, V, LOADS)
        assert sliding(law, V, factor * LOADS) == pytest.approx(expected, rel=1e-9), name
    for name in STATIC:
        law = SYMMETRIC[name]
        if law.facts.load == "proportional" and name != "popp_stelter, quadratic":
            viscous = level(law, "sigma_2") * EXTREMES
            if name == "specker, viscous":
                viscous -= 0.4 * EXTREMES * np.exp((1 - (EXTREMES / 1e-3) ** 2) / 2)
            unloaded = law.force(EXTREMES, 0.0)
            assert unloaded == pytest.approx(viscous, rel=1e-12, abs=1e-300), name


@cache
def gradients(name: str) -> ca.Function:
    """Return force and rate with their gradients in v, z, inputs and every parameter."""
    _, symbols, outputs, _ = symbolic(name)
    return ca.Function("f", [symbols], [outputs, ca.jacobian(outputs, symbols)])


def test_value_gradient_and_hessian_are_finite() -> None:
    for name, law in CASES.items():
        names, symbols, outputs, values = symbolic(name)
        shares = np.repeat([0.0, 1.0, -1.0], EXTREMES.size)
        z = stretched(law, BLOCK, shares)
        rest = [[values[n]] * shares.size for n in names[1 + len(z) :]]
        points = np.vstack([np.tile(EXTREMES, 3), z, *rest])
        # a sum is finite only if every term is; the weights keep infinities from cancelling
        total = ca.dot(outputs, np.arange(1.0, 1.0 + outputs.numel()))
        hessian, gradient = ca.hessian(total, symbols)
        second = ca.Function("second", [symbols], [ca.vertcat(gradient, ca.vec(hessian))])
        assert second(points).is_regular(), name
        assert all(result.is_regular() for result in gradients(name)(points)), name


def expansion_point(name: str) -> np.ndarray:
    """Return sliding near the Stribeck velocity with bent states and every parameter off zero."""
    names, _, _, values = symbolic(name)
    z = 0.6 * np.asarray(CASES[name].steady_state(1.0, BLOCK)).ravel()
    nominal = np.array([state.nominal for state in CASES[name].states])
    z = np.where(np.abs(z) > 1e-6 * nominal, z, 0.3 * nominal)
    off_zero = {n: x if x else 0.3 for n, x in values.items()}
    # at 1e-9 m/s the smoothing has long saturated: compare where it bends
    smoothing = {n: 5e-4 for n in values if n.startswith("v_e")}
    return np.array([7e-4, *z, *((off_zero | smoothing)[n] for n in names[1 + z.size :])])


def test_difference_quotients_approach_the_gradient_with_order_two() -> None:
    seen: list[bool] = []
    for name in CASES:
        f, x = gradients(name), expansion_point(name)
        steps = 0.04 * np.abs(x) * np.array([[1.0], [0.5], [0.25]])
        F, slopes = (result.full() for result in f(x))
        for i, h in enumerate(steps.T):
            apart = np.tile(x, (6, 1)).T
            apart[i] += np.concatenate([h, -h])
            beyond = f(apart)[0].full()
            errors = (beyond[:, :3] - beyond[:, 3:]) / (2 * h) - slopes[:, [i]]
            bent = np.abs(errors[:, 0]) > 1e-9 * np.abs(F[:, 0]) / abs(x[i])
            ratios = errors[bent, :2] / errors[bent, 1:]
            assert ratios == pytest.approx(4.0, abs=0.3), (name, symbolic(name)[0][i])
            seen.append(bool(bent.any()))
    assert np.mean(seen) > 0.4, "parameters that enter linearly leave nothing to compare"


def test_all_number_types_give_the_same() -> None:
    for name, v in product(CASES, (0.0, 3e-4)):
        law, N, w = CASES[name], 5.0, given_inputs(CASES[name])
        z = stretched(law, N, [0.7]).ravel()
        F, rate = float(law.force(v, N, z, **w)), np.asarray(law.rate(v, N, z, **w))
        assert rate.shape == z.shape
        many = np.full(3, v), N, np.tile(z[:, None], (1, 3))
        forces, rates = law.force(*many, **w), law.rate(*many, **w)
        assert (forces.shape, rates.shape) == ((3,), (z.size, 3)), name
        dm = ca.DM(v), ca.DM(N), ca.DM(z) if z.size else ca.DM(0, 1)
        of_dm = law.force(*dm, **w), law.rate(*dm, **w)
        assert (of_dm[0].shape, of_dm[1].shape) == ((1, 1), (z.size, 1)), name
        x, L, s = ca.MX.sym("v"), ca.MX.sym("N"), ca.MX.sym("z", z.size)
        of_mx = ca.Function("law", [x, L, s], [law.force(x, L, s, **w), law.rate(x, L, s, **w)])
        casadi = (of_dm, of_mx(v, N, z), compiled(name)(v, N, z, 1.0))
        numbers = [(result[0].full(), result[1].full().ravel()) for result in casadi]
        for one, other in [(forces[1], rates[:, 1]), *numbers]:
            np.testing.assert_allclose(one, F, rtol=1e-14, atol=1e-300, err_msg=name)
            np.testing.assert_allclose(other, rate, rtol=1e-12, atol=1e-18, err_msg=name)


def test_symbolised_law_equals_the_numeric_one() -> None:
    for name, law in CASES.items():
        names, _, _, values = symbolic(name)
        z = stretched(law, BLOCK, SHARES)
        rest = [[values[n]] * COUNT for n in names[1 + len(z) :]]
        of_symbols = gradients(name)(np.vstack([V, z, *rest]))[0].full()
        expected = np.vstack([r.full() for r in compiled(name)(V[None, :], BLOCK, z, 1.0)])
        scale = np.vstack([np.ones(COUNT), *len(z) * [np.abs(V)]])
        np.testing.assert_allclose(
            of_symbols / scale, expected / scale, rtol=1e-12, atol=1e-12, err_msg=name
        )


def test_default_expressions_use_no_nonsmooth_primitive() -> None:
    for name, law in CASES.items():
        v, N, z = ca.SX.sym("v"), ca.SX.sym("N"), state_symbols(law)
        if law.switches(v, N, z):
            continue  # has modes
        w = {key: ca.SX.sym(key) for key in given_inputs(law)}
        outputs = [law.force(v, N, z, **w), law.rate(v, N, z, **w)]
        function = ca.Function("law", [v, N, z, ca.vertcat(*w.values())], outputs)
        used = {function.instruction_id(k) for k in range(function.n_instructions())}
        forbidden = {ca.OP_IF_ELSE_ZERO, ca.OP_LT, ca.OP_LE}
        if law.facts.smoothness.startswith("C∞"):
            forbidden |= {ca.OP_SIGN, ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX}
        assert not used & forbidden, name


def test_steady_force_takes_the_states_and_the_inputs_of_steady_sliding() -> None:
    v = np.array([-1e-2, -3e-4, 3e-4, 1e-2])
    expected = sf.Stribeck(v_eps=1e-9).force(v, BLOCK)
    assert sf.steady_force(sf.LuGre(), v, BLOCK) == pytest.approx(expected, rel=1e-12)
    found = sf.steady_force(sf.Karnopp(), np.array([-1e-9, 1e-9]), BLOCK)
    assert found == pytest.approx([-1.0, 1.0])
    titles = [
        sf.steady_inputs(law) for law in (sf.Karnopp(), sf.BAM(), sf.LuGre(), sf.GenericAsperity())
    ]
    assert titles == [", F_e = 1 N", ", tau_m = 1 N m, tau_e = 0.5 N m", "", ""]


def test_docstring_states_equation_limits_and_source() -> None:
    for name, kind in sf.ALL_LAWS.items():
        text = getdoc(kind) or ""
        assert "Limits:" in text, name
        assert re.search(r"\n {4,}F ", text), "the equation of the force, indented"
        facts = kind.facts
        assert facts.phenomena, name
        assert set(facts.phenomena) <= set(sf.PHENOMENA), name
        assert facts.smoothness, name
        assert facts.source, name
        assert f"Source: {facts.source}" in " ".join(text.split()), name
        assert getattr(sf, kind.__name__) is kind


def test_facts_name_what_the_formula_was_compared_with() -> None:
    for kind in (sf.ALL_LAWS | sf.POPULATIONS | MADE_OF_LAWS).values():
        facts: sf.Facts | None = getattr(kind, "facts", None)
        if facts is None:
            continue
        assert CONFIDENCE[facts.confidence] in facts.formula, kind
        assert facts.checked in facts.formula, kind
        if facts.confidence.endswith(("source", "sources")):
            assert facts.checked, kind
            several = re.search("; | and |two |four ", facts.checked)
            assert "sources" not in facts.confidence or several, kind
        if facts.confidence == "unverified":
            assert "written from memory" in facts.formula, kind


def test_every_parameter_carries_unit_text_bounds_and_refuses_values_beyond_them() -> None:
    for kind in sf.ALL_LAWS.values():
        found = sf.parameters(kind())
        own = [item.name for item in fields(kind) if "unit" in item.metadata]
        assert [name for name in found if name in own] == own
        _, variables = sf.symbolise(kind(), *found)
        for p, variable in zip(found.values(), variables, strict=True):
            assert p.unit, (kind, p.name)
            assert p.doc, (kind, p.name)
            assert p.lower <= p.value <= p.upper
            assert p.value == p.default or p.name not in own
            assert (variable.name, variable.lower, variable.upper) == (p.name, p.lower, p.upper)
            assert (variable.unit, variable.start) == (p.unit, p.value)
            where = f"{kind.__name__}: {p.name}" if p.name in own else p.name.rpartition("_")[0]
            for value in filter(isfinite, (p.lower - 1, p.upper + 1)):
                with pytest.raises(ValueError, match=rf"{where}: expected .* got {value:g}"):
                    sf.with_values(kind(), {p.name: value})
    for kind in (sf.Stribeck, sf.BrownMcPhee, sf.SelfTuning, sf.LuGre):
        with pytest.raises(ValueError, match=r"mu_d <= mu_s, got mu_d = 0.3 and mu_s = 0.2"):
            kind(mu_s=0.2, mu_d=0.3)


def test_wrong_parameters_states_and_texts_are_refused() -> None:
    assert not_refused(Path(__file__).with_name("refusals.toml"), sf.laws) == []


def test_every_parameter_of_every_law_and_scene_has_a_description() -> None:
    """Roles are data: identification, temperature and code generation read them, not texts."""
    wrappers = (
        *WRAPPERS.values(), sf.PlanarSlip, sf.Table, sf.Element, sf.Slider,
    )  # fmt: skip
    parts = (*sf.ALL_LAWS.values(), *sf.POPULATIONS.values(), *wrappers)
    for kind in (*parts, *ALL_SCENES.values(), Robot):
        for item in fields(kind):
            if "unit" in item.metadata:
                assert item.metadata["role"] in ROLES, f"{kind.__name__}.{item.name}"
