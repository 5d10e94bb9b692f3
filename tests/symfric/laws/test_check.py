"""`check_law`: laws of the catalogue pass, and every fault of a law is found."""

from re import search
from typing import Any

import casadi as ca
import numpy as np
import pytest
from law_cases import CASES

import symfric as sf
from symfric.laws import smooth

OTHERS = [pytest.param(first, marks=pytest.mark.slow) for first in (1, 2, 3, 4)]


@pytest.mark.parametrize("first", [0, *OTHERS])
def test_laws_of_the_catalogue_pass(first: int) -> None:
    """LuGre states its lack of passivity, and the strut of the quarter car has a constant force."""
    for name, law in [*CASES.items()][first::5]:
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


def test_what_is_not_a_law_with_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match=r"check_law: expected a law .* got 'lugre'"):
        sf.check_law("lugre")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="got symbols for mu; use with_values"):
        sf.check_law(sf.symbolise(RIGHT, "mu")[0])
