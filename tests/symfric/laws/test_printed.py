"""Every static law computes the equation that it prints, and the digits of a catalogue.

The catalogue printed.toml has levels of 1 N and 1.5 N and a characteristic velocity of 1e-3 m/s.
"""

import tomllib
from dataclasses import replace
from itertools import product
from math import isfinite
from pathlib import Path

import numpy as np
import printed_laws
import pytest
from printed_laws import PRINTED

import symfric as sf

BOTH = {"mu_s": 1.5, "mu_d": 1.0}
V = (1e-4, 5e-4, 1e-3, 2e-3, 1e-2)
"""Velocities of the catalogue [m/s]."""
LAWS = {name: getattr(sf.laws, name) for name in sf.laws.__all__} | {"BOTH": BOTH}
CATALOGUE = [
    (eval(law, LAWS), row)
    for law, row in tomllib.loads(Path(__file__).with_name("printed.toml").read_text()).items()
]
MM_PER_MIN = np.array([100, 140, 210, 294, 390, 500]) / 60000
PUBLISHED = {
    "pilot": (3.2145, 3.1306, 3.3552, 3.6768, 4.0448, 4.4665),
    "main": (4.2237, 4.1312, 3.8051, 3.2418, 2.7793, 2.6550),
}
FINE = 0.0123e-3 * 1.17 ** np.arange(60)
"""Velocities from 1e-5 to 0.13 m/s, on no knot of any law."""


def test_force_has_the_printed_digits_and_is_that_of_plain_python() -> None:
    for law, row in CATALOGUE:
        assert law.force(np.array(V), 1.0) == pytest.approx(row, abs=5.1e-10), law
        v = np.concatenate([V, FINE])
        expected = [PRINTED[sf.law_name(law)](law, x, 1.0) for x in v]
        assert law.force(v, 1.0) == pytest.approx(expected, rel=1e-12, abs=1e-15), law
        assert (law.force(-v, 1.0) == -np.asarray(law.force(v, 1.0))).all(), law
        if isinstance(law, sf.Stribeck):
            narrow = replace(law, v_eps=1e-12).force(np.array(V), 1.0)
            assert narrow == pytest.approx(row, abs=1e-7 if law.delta < 1 else 1e-9)
            bristle = sf.LuGre(**BOTH, delta=law.delta, v_eps=0.0)
            for v, g in zip(V, row, strict=True):
                force = bristle.force(-v, 7.0, bristle.steady_state(-v, 7.0))
                assert force == pytest.approx(-7 * g, abs=7 * 5.1e-10)
    for name, row in PUBLISHED.items():
        law = getattr(sf.SteadyStateLuGre, name)()
        assert law.force(MM_PER_MIN, 99.0) == pytest.approx(row, abs=5.1e-5)


SHARP = {"hollars": {"u_eps": 0.0}, "exudyn": {"u_eps": 0.0}}
"""Laws whose equation is printed for the float 0 of a width."""


def drawn(law: sf.Law, rng: np.random.Generator) -> sf.Law:
    """Return the law with numbers over decades of their defaults, in the order that it asks for."""
    values: dict[str, float] = {}
    for name, p in sf.parameters(law).items():
        if name == "u_eps":
            continue
        default = float(p.value) or {"viscous": 0.3, "shape": 0.4}.get(p.role, 0.0)
        if p.role in ("shape", "temperature", "geometry") and isfinite(p.upper):
            low = max(p.lower, 0.0 if p.role == "temperature" else -1.0)
            values[name] = float(rng.uniform(low, p.upper))
        else:
            values[name] = abs(default) * 10 ** float(rng.uniform(-2, 2))
    for low, high in (*law.ordered, *law.strictly_ordered):
        if values[low] > values[high]:
            values[low], values[high] = values[high], values[low]
    return sf.with_values(law, values)


def differing(count: int, seed: int) -> list[str]:
    """Return the cases that differ by more than rounding.

    Where an equation holds |v|, the law may differ by 1e-4 of what falls.
    """
    rng, wrong = np.random.default_rng(seed), list[str]()
    for name, _ in product(PRINTED, range(count)):
        law = drawn(replace(sf.ALL_LAWS[name](), **SHARP.get(name, {})), rng)
        scales = [float(p.value) for p in sf.parameters(law).values() if p.unit == "m/s"]
        v = float((rng.choice(scales) if scales else 1e-3) * 10 ** rng.uniform(-5, 3))
        N = float(10 ** rng.uniform(-2, 3))
        expected, found = PRINTED[name](law, v, N), float(law.force(v, N))
        falls = abs(float(law.static_level(N)))
        if abs(found - expected) > 1e-9 * abs(expected) + 1e-4 * falls * (found != expected):
            wrong.append(f"{law} at v = {v:g}, N = {N:g}: {found:g}, printed {expected:g}")
    return wrong


def test_force_is_the_printed_equation_at_any_numbers() -> None:
    assert differing(40, seed=1) == []
    static = {name for name, kind in sf.ALL_LAWS.items() if not kind().states}
    assert static - set(PRINTED) == {sf.law_name(law) for law, *_ in WITH_INPUTS}


@pytest.mark.slow
def test_force_is_the_printed_equation_at_many_numbers() -> None:
    assert differing(4000, seed=2) == []


SLOW = (-3e-3, -1e-3, -7e-4, -1e-5, 0.0, 1e-5, 5e-4, 9.99e-4, 1e-3, 2e-3, 0.05)
LOADS = (-3.0, -1.5, -0.4, 0.0, 0.2, 1.2, 1.5, 1.7)
CAR = sf.QuarterCarGeneral(sigma_v=50.0)
STRUT = {"x_rel": (5e-3, -6.9e-3, 0.0), "v_rel": (0.0, 0.02, -0.3)}
SERVO = sf.BAM(K_s=0.03, K_e=0.04, K_m=0.06, K_es=0.02, K_ms=0.05, Q_e=0.01, Q_m=0.02, v_eps=1e-9,
            tau_eps=1e-6)  # fmt: skip
WITH_INPUTS: list[tuple[sf.Law, tuple[float, ...], dict[str, tuple[float, ...]], float]] = [
    (sf.Awrejcewicz(**BOTH, form="original"), SLOW, {"F_e": LOADS}, 1e-12),
    (sf.Karnopp(**BOTH, form="original", sigma_2=0.4), SLOW, {"F_e": LOADS}, 1e-12),
    (CAR, (-0.3, -0.01, 2e-3, 0.1), STRUT, 1e-12),
    (replace(CAR, form="as_printed"), (-0.3, -0.01, 0.0, 2e-3, 0.1), STRUT, 1e-12),
    (
        sf.Wojewoda(**BOTH, v_eps=1e-6, a_eps=1e-4),
        (5e-3, 0.1),
        {"dv": (-3.0, -0.5, 0.5, 3.0)},
        1e-12,
    ),
    (SERVO, (0.1, 3.0), {"tau_m": (-1.0, -0.3, 0.2, 0.9), "tau_e": (-0.7, 0.4)}, 1e-10),
]
"""Laws that need more than v and N: law, velocities, values of its inputs, relative rounding."""


def test_force_of_a_law_with_further_inputs_is_the_printed_equation() -> None:
    for law, speeds, inputs, rounding in WITH_INPUTS:
        formula = getattr(printed_laws, sf.law_name(law))
        for v, *values in product(speeds, *inputs.values()):
            given = dict(zip(inputs, values, strict=True))
            expected = formula(law, v, 1.0, **given)
            found = law.force(v, 1.0, **given)
            assert found == pytest.approx(expected, rel=rounding, abs=1e-15), (law, v, given)


DELTAS = (0.1, 0.2, 0.35, 0.5, 0.7, 0.78, 1.0, 1.3, 1.7, 2.0, 2.5, 3.2, 5.0, 10.0)


def test_stribeck_differs_from_its_equation_by_less_than_the_stated_bound() -> None:
    """At every speed, for v_eps from far below to far above v_s."""
    for delta, v_s, ratio in product(
        DELTAS, (1e-9, 1e-3, 20.0), (1e-8, 1e-4, 1e-2, 0.09, 0.5, 3.0, 1e4)
    ):
        law = sf.Stribeck(mu_s=0.4, mu_d=0.1, v_s=v_s, delta=delta, v_eps=ratio * v_s)
        v = v_s * np.concatenate(
            [np.geomspace(1e-14, 1e3, 500), ratio * np.geomspace(1e-7, 9, 250)]
        )
        with np.errstate(over="ignore"):
            printed = (0.1 + 0.3 * np.exp(-((v / v_s) ** delta))) * np.tanh(v / law.v_eps)
        error = np.abs(law.force(v, 5.0) - 5.0 * printed)
        assert error.max() < 1e-4 * 0.3 * 5.0, law
        assert delta < 0.7 or ratio >= 1 or (error / (5.0 * printed)).max() < 1e-3, law
