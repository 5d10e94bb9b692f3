"""Every static law computes the equation that it prints, and the digits of a catalogue.

The catalogue printed.toml has levels of 1 N and 1.5 N and a characteristic velocity of 1e-3 m/s.

`check_law`: laws of the catalogue pass, and every fault of a law is found.
"""

import math
import re
import tomllib
from dataclasses import replace
from itertools import product
from math import isfinite
from pathlib import Path
from re import search
from typing import Any

import casadi as ca
import numpy as np
import printed_laws
import pytest
from law_cases import CASES
from printed_laws import PRINTED
from tables import table

import symfric as sf
from symfric.laws import smooth

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


OTHERS = [pytest.param(first, marks=pytest.mark.slow) for first in range(1, 20)]


@pytest.mark.parametrize("first", [0, *OTHERS])
def test_laws_of_the_catalogue_pass(first: int) -> None:
    """LuGre states its lack of passivity, and the strut of the quarter car has a constant force."""
    for name, law in [*CASES.items()][first::20]:
        report = sf.check_law(law)
        bad = {one.topic for one in report.remarks if one.result in ("error", "warning")}
        expected = {"passivity"} if law.warnings() else set[str]()
        expected |= {"sign"} if name == "quarter_car_general" else set()
        assert bad == expected, (name, report)
        assert report.passed == (not expected), name


@sf.parametric
class Falling(sf.StaticLaw):
    """A correct law, of which the laws below are wrong copies."""

    mu: float = sf.param(0.3, unit="1", doc="coefficient", role="level", lower=0.0)
    v_f: float = sf.param(0.5, unit="m/s", doc="decay", role="velocity scale", lower=1e-9)
    v_eps: float = sf.param(1e-3, unit="m/s", doc="smoothing", width=1, lower=1e-12)

    def outside(self, speed: Any, N: Any) -> Any:
        return self.mu * N / (1 + speed / self.v_f)

    def force(self, v: Any, N: Any, z: Any = ()) -> Any:
        speed = smooth.magnitude(v, self.v_eps)
        return self.outside(speed, N) * smooth.sign(v, self.v_eps)


@sf.parametric
class Bristle(sf.Law):
    """A correct law with a state, of which the laws below are wrong copies."""

    mu: float = sf.param(0.3, unit="1", doc="coefficient", role="level", lower=1e-9)
    k: float = sf.param(1e4, unit="N/m", doc="stiffness", role="stiffness", lower=1e-9)
    v_eps: float = sf.param(1e-9, unit="m/s", doc="smoothing", role="width", lower=1e-15)

    @property
    def states(self) -> tuple[sf.State, ...]:
        return (sf.State("z", "m", nominal=1e-5),)

    def outside(self, speed: Any, N: Any) -> Any:
        return self.mu * N

    def force(self, v: Any, N: Any, z: Any = ()) -> Any:
        return self.k * z[0]

    def rate(self, v: Any, N: Any, z: Any = ()) -> Any:
        return ca.vertcat(v - self.k * smooth.magnitude(v, self.v_eps) / (self.mu * N) * z[0])

    def steady_state(self, v: Any, N: Any) -> Any:
        return ca.vertcat(self.mu * N / self.k * smooth.sign(v, self.v_eps))


def with_force(formula: Any) -> sf.Law:
    """Return `Falling` with another force."""

    class Wrong(Falling):
        def force(self, v: Any, N: Any, z: Any = ()) -> Any:
            return formula(self, v, N)

    return Wrong()


def with_rate(formula: Any) -> sf.Law:
    """Return `Bristle` with another rate."""

    class Wrong(Bristle):
        def rate(self, v: Any, N: Any, z: Any = ()) -> Any:
            return formula(self, v, N, z)

    return Wrong()


def stepped(law: Any, v: Any, N: Any) -> Any:
    """Return a force that jumps at 0.01 m/s."""
    return Falling.force(law, v, N) * ca.if_else(v * v > 1e-4, 1.0, 0.5)


def uneven(law: Any, v: Any, N: Any) -> Any:
    """Return a force that is larger for positive velocities."""
    return Falling.force(law, v, N) * (1 + 0.1 * smooth.sign(v, 1e-3))


def root(law: Any, v: Any, N: Any) -> Any:
    """Return a force whose derivative at rest is NaN."""
    return law.mu * N * ca.sqrt(ca.fabs(v)) * smooth.sign(v, law.v_eps)


RIGHT, SLIDING = Falling(), Bristle()
F, rate = Falling.force, Bristle.rate
WRONG: dict[str, tuple[sf.Law, str, str]] = {
    "backwards": (with_force(lambda s, v, N: -F(s, v, N)), "sign", "drives steady sliding"),
    "uneven": (with_force(uneven), "symmetry", r"different in both directions; .* odd=False"),
    "hidden unit": (with_force(lambda s, v, N: N * v / (1 + v * v)), "units", "with a unit"),
    "jump": (with_force(lambda s, v, N: 0.3 * N * ca.sign(v)), "smoothness", "jumps by 0.6 N"),
    "root": (with_force(root), "smoothness", "nan"),
    "step": (with_force(stepped), "smoothness", r"jumps at 0\.01 m/s"),
    "outside": (with_force(lambda s, v, N: 2 * F(s, v, N)), "limit", "`outside` is"),
    "condition": (with_force(lambda s, v, N: N if v > 0 else -N), "values", "smooth.choose"),
    "nothing": (with_force(lambda s, v, N: None), "values", "expected a force.* got None"),
    "list": (with_rate(lambda s, v, N, z: [v - z[0]]), "values", "ca.vertcat"),
    "active": (
        with_rate(lambda s, v, N, z: rate(s, v, N, z) + 500 * z[0]), "passivity", "not passive",
    ),
    "rows": (with_rate(lambda s, v, N, z: ca.vertcat(v, v)), "values", "as states, 1, got 2"),
    "index": (with_rate(lambda s, v, N, z: ca.vertcat(v - z[1])), "values", r"z\[k\] of the st"),
    "moving": (with_rate(lambda s, v, N, z: rate(s, v, 2 * N, z)), "states", "still changes"),
}  # fmt: skip
"""Wrong law, and topic and pattern of the sentence about it."""


@pytest.mark.parametrize("name", WRONG)
def test_every_fault_is_found(name: str) -> None:
    law, topic, pattern = WRONG[name]
    texts = [one.text for one in sf.check_law(law).remarks if one.topic == topic]
    assert any(search(pattern, text) for text in texts), texts


def test_correct_laws_pass() -> None:
    for law in (RIGHT, SLIDING):
        assert all(one.result == "ok" for one in sf.check_law(law).remarks), sf.check_law(law)
    assert str(sf.check_law(RIGHT)).startswith("Falling: no errors, no warnings")


def test_parameters_off_by_decades_cause_no_false_verdict() -> None:
    for law, values in (
        (sf.LuGrePassive(), {"sigma_0": 1e14}), (sf.GMS(), {"mu_d": 1e-10}),
        (sf.Stribeck(), {"v_s": 1e-12}), (sf.Dahl(), {"n": 1e-9}),
        (sf.ElastoPlastic(), {"sigma_1": 1e9}), (sf.BrownMcPhee(), {"mu_s": 1e8, "mu_d": 1e8}),
    ):  # fmt: skip
        report = sf.check_law(sf.with_values(law, values))
        topics = {one.topic for one in report.remarks if one.result in ("error", "warning")}
        assert topics <= {"states"} | ({"passivity"} if law.warnings() else set()), report


def test_functions_of_casadi_may_be_used_for_numbers_and_arrays() -> None:
    law = with_force(lambda s, v, N: 0.3 * N * ca.tanh(v / 1e-3))
    v = np.array([-1.0, 0.0, 2e-3])
    assert law.force(v, 2.0) == pytest.approx(0.6 * np.tanh(v / 1e-3))
    assert law.force(2e-3, 2.0) == pytest.approx(0.6 * np.tanh(2.0))
    rate = SLIDING.rate(v, 2.0, np.zeros((1, 3)))
    assert rate.shape == (1, 3)
    assert rate[0] == pytest.approx(v)
    several = np.array([[-1.0, 0.0, 2e-3], [1.0, 1e-4, -2e-3]])
    assert law.force(several, 2.0) == pytest.approx(0.6 * np.tanh(several / 1e-3))
    with pytest.raises(ValueError, match=r"force: expected a force, .* got the expression"):
        with_force(lambda s, v, N: ca.SX(0.3) * N * v).force(0.1, 2.0)
    assert SLIDING.rate(0.1, 2.0, [1e-5]) == pytest.approx([0.1 - 1e4 * 0.1 / 0.6 * 1e-5])


def test_a_class_without_its_decorator_is_refused() -> None:
    bare = type(
        "Bare", (sf.StaticLaw,), {"mu": sf.param(0.3, unit="1", doc=""), "force": Falling.force}
    )
    with pytest.raises(ValueError, match=r"Bare: expected the decorator @parametric .* for mu"):
        bare()


def test_mistakes_in_laws_of_users_get_one_sentence() -> None:
    for body, message in table(__file__, "own_mistakes").items():
        known = {name: getattr(sf, name) for name in ("State", "StaticLaw", "param")}
        known |= {"ca": ca, "math": math, "np": np, "smooth": smooth}
        force = "def force(self, v, N, z=()): return N * smooth.sign(v, 1e-3)"
        with pytest.raises(ValueError, match=re.escape(message)):
            exec(f"class Own(StaticLaw):\n    {force}\n    {body}", known)
            sf.rabinowicz(known["Own"]())
            sf.rabinowicz(sf.Exact(known["Own"]()))


def test_a_force_that_is_constant_or_not_finite_is_found() -> None:
    for force, topic, pattern in ((3.0, "sign", "drives steady"), (np.nan, "values", "got nan")):
        remarks = sf.check_law(with_force(lambda s, v, N, force=force: force)).remarks
        (text,) = (one.text for one in remarks if one.topic == topic)
        assert search(pattern, text)


def test_what_is_not_a_law_with_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match=r"check_law: expected a law .* got 'lugre'"):
        sf.check_law("lugre")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="got symbols for mu; use with_values"):
        sf.check_law(sf.symbolise(RIGHT, "mu")[0])
