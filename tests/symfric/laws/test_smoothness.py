"""Every law is as smooth as it says, where it says, and no smoother."""

from functools import cache
from re import findall

import casadi as ca
import pytest
from law_cases import given_inputs

from symfric import ALL_LAWS, Coulomb, Law, Stribeck
from symfric.laws import (
    Ambrosio,
    Awrejcewicz,
    BengisuAkay,
    Exudyn,
    Hollars,
    Karnopp,
    LeineSwitch,
    ModifiedThrelfall,
    QuarterCarGeneral,
    Step5,
    Threlfall,
    VelocityBased,
)

Knot = tuple[float, int]
"""Velocity [m/s], and the number of continuous derivatives there: -1 for a jump."""

FORMS: dict[str, tuple[Law, list[Knot]]] = {
    "coulomb, saturation": (Coulomb(shape="saturation"), [(1e-3, 0)]),
    "coulomb, quadratic": (Coulomb(shape="quadratic"), [(0.0, 1), (1e-3, 1)]),
    "coulomb, sign": (Coulomb(v_eps=0.0), [(0.0, -1)]),
    "stribeck, sign": (Stribeck(v_eps=0.0), [(0.0, -1)]),
    "threlfall, original": (Threlfall(form="original"), [(0.0, 1), (1e-3, -1)]),
    "modified_threlfall, original": (ModifiedThrelfall(form="original"), [(0.0, 1), (1e-3, 0)]),
    "bengisu_akay": (BengisuAkay(), [(0.0, 1), (1e-3, 1)]),
    "bengisu_akay, original": (BengisuAkay(form="original"), [(0.0, 1), (1e-3, 0)]),
    "velocity_based": (VelocityBased(), [(1e-3, 2), (1.5e-3, 2)]),
    "velocity_based, original": (VelocityBased(form="original"), [(1e-3, 1), (1.5e-3, 1)]),
    "ambrosio": (Ambrosio(), [(2e-4, 2), (1e-3, 2)]),
    "ambrosio, original": (Ambrosio(form="original"), [(2e-4, 0), (1e-3, 0)]),
    "hollars": (Hollars(), [(8e-3, 2), (1.2e-2, 2)]),
    "hollars, original": (Hollars(u_eps=0.0), [(1e-2, 0)]),
    "exudyn": (Exudyn(mu_v=0.4), [(8e-4, 2), (1.2e-3, 2)]),
    "exudyn, original": (Exudyn(u_eps=0.0), [(1e-3, 0)]),
    "step5": (Step5(), [(0.0, 3), (1e-3, 2), (3e-3, 2)]),
    "karnopp": (Karnopp(), [(0.0, 2), (1e-3, 2)]),
    "karnopp, original": (Karnopp(form="original"), [(1e-3, -1)]),
    "awrejcewicz": (Awrejcewicz(), [(0.0, 2), (1e-3, 1)]),
    "awrejcewicz, original": (Awrejcewicz(form="original"), [(0.0, 1), (1e-3, 1)]),
    "leine_switch, original": (LeineSwitch(form="original"), [(1e-6, -1)]),
    "quarter_car_general": (QuarterCarGeneral(), [(0.0, 2), (1e-3, 2)]),
    "quarter_car_general, as printed": (QuarterCarGeneral(form="as_printed"), [(0.0, -1)]),
}
POINTS = [
    (name, sign * v, k)
    for name, (_, knots) in FORMS.items()
    for v, k in knots
    for sign in ((1, -1) if v else (1,))
]
EVERYWHERE = [
    name
    for name, kind in ALL_LAWS.items()
    if not kind().states and kind.facts.smoothness.startswith("C∞")
]


@cache
def derivatives(name: str, order: int) -> ca.Function:
    """Force and its derivatives up to `order` in the scaled velocity."""
    law = FORMS[name][0]
    x, scale = ca.SX.sym("x"), scale_of(name)
    rows = [ca.SX(law.force(scale * x, 5.0, **given_inputs(law)))]
    for _ in range(order):
        rows.append(ca.gradient(rows[-1], x))
    return ca.Function("derivatives", [x], [ca.vertcat(*rows)])


def scale_of(name: str) -> float:
    return max(v for v, _ in FORMS[name][1]) or 1e-3


@pytest.mark.parametrize(("name", "v", "k"), POINTS)
def test_law_has_as_many_continuous_derivatives_at_a_knot_as_it_claims(
    name: str, v: float, k: int
) -> None:
    f, x, step = derivatives(name, k + 1), v / scale_of(name), 1e-9
    left, at, right = (f(x + s).full().ravel() for s in (-step, 0.0, step))
    size = max(abs(left).max(), abs(right).max(), 1e-2)
    assert left[: k + 1] == pytest.approx(right[: k + 1], abs=1e-6 * size)
    assert at[: k + 1] == pytest.approx(right[: k + 1], abs=1e-6 * size), "derivative at the knot"
    assert abs(left[k + 1] - right[k + 1]) > 1e-5 * size


@pytest.mark.parametrize("name", FORMS)
def test_claim_names_the_weakest_knot(name: str) -> None:
    law, knots = FORMS[name]
    weakest = min(k for _, k in knots)
    claim = law.facts.smoothness
    if "," not in name:
        assert claim.startswith(f"C{weakest} ")
    elif weakest < 0:
        assert "jump" in claim or "sign" in name
    else:
        assert f"C{weakest}" in findall(r"C\d", claim)


@pytest.mark.parametrize("name", EVERYWHERE)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_law_that_claims_all_derivatives_has_continuous_ones(name: str, order: int) -> None:
    law = ALL_LAWS[name]()
    scale = min(float(law.velocity_scale), 1.0)
    x = ca.SX.sym("x")
    row = ca.SX(law.force(scale * x, 5.0, **given_inputs(law)))
    for _ in range(order):
        row = ca.gradient(row, x)
    f = ca.Function("f", [x], [row])
    points = [k / 4 for k in range(-12, 13)] + [10.0, -10.0, 100.0, -100.0]
    values = [float(f(p)) for p in points]
    size = max(map(abs, values)) + 1e-9
    for p, here in zip(points, values, strict=True):
        for side in (-1e-9, 1e-9):
            assert float(f(p + side * max(1.0, abs(p)))) == pytest.approx(here, abs=1e-4 * size)


EXTREMES = [s * m for m in (0.0, 1e-300, 1e-12, 1e-6, 1e-3, 1.0, 1e3) for s in (1.0, -1.0)]


@pytest.mark.parametrize("name", FORMS)
def test_value_and_derivatives_of_every_form_are_finite_and_odd(name: str) -> None:
    law, x = FORMS[name][0], ca.SX.sym("x")
    given = {n: ca.SX.sym(n) for n in given_inputs(law)}
    every = ca.vertcat(x, *given.values())
    hessian, gradient = ca.hessian(ca.SX(law.force(x, 5.0, **given)), every)
    f = ca.Function("f", [every], [law.force(x, 5.0, **given), gradient, hessian])
    for v in EXTREMES:
        point = ca.DM([v, *given_inputs(law).values()])
        forward, backward = f(point), f(-point)
        assert all(result.is_regular() for result in forward), v
        if law.facts.odd:
            assert float(forward[0]) == -float(backward[0]), v
