"""Intervals and words about what the data do not tell."""

from dataclasses import replace

import numpy as np
import pytest
from linear_fits import ar1, coulomb, fitted
from scipy.stats import t as student

from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import Covariance, Levels
from identification.verdict.covariance import covariance as covariance_of
from identification.verdict.minimum import Minimum

N = 400
C, V = coulomb(N).T[1:3]


def unknowns(*names: str) -> tuple[Unknown, ...]:
    return tuple(Unknown(n, "N", 1.0) for n in names)


def covariance(names: str, values: tuple[float, ...], *columns: np.ndarray) -> Covariance:
    """Of a fit at `values` with these derivatives by them."""
    J = np.column_stack(columns)
    made = fitted(J, ar1(N, 0.0, 1), unknowns(*names.split()))
    at = np.array(values)
    made = replace(made, values=at, change=lambda p: float(np.linalg.norm(J @ (p - at))))
    return covariance_of(made)


@pytest.mark.parametrize(
    ("names", "values", "columns", "sentence"),
    [
        ("a b", (2.0, 5.0), (C, 0 * C), "b has no influence on the measured signals."),
        ("mu_s mu_d", (2.0, 5.0), (C, -C), "Only the difference mu_s - mu_d is identifiable"),
        ("a b", (2.0, 5.0), (C, C), "Only the sum a + b is identifiable, not a and b each."),
        ("mu N", (2.0, 5.0), (5 * C, 2 * C), "Only the product mu N is identifiable, not mu and N"),
        ("k m", (2.0, 5.0), (5 * C, -2 * C), "Only the ratio k / m is identifiable, not k and m"),
        ("a b c", (2.0, 5.0, 3.0), (15 * C, 6 * C, 10 * C), "Only the product a b c is identif"),
        ("a b c", (2.0, 5.0, 3.0), (C, V, C + 2 * V), "Of a, b and c only 2 combinations are iden"),
    ],
)  # fmt: skip
def test_what_is_not_told_is_said(
    names: str, values: tuple[float, ...], columns: tuple[np.ndarray, ...], sentence: str
) -> None:
    found = covariance(names, values, *columns)
    assert found.sentences[0].startswith(sentence)
    group = found.undetermined[0]
    for name, error in zip(found.names, found.standard_errors, strict=True):
        assert np.isnan(error) == (name in group)


def test_equal_values_are_told_apart_by_going_a_little_way() -> None:
    """a = b = 2: a product and a sum have the same derivatives."""
    made = fitted(2 * np.column_stack([C, C]), ar1(N, 0.0, 1), unknowns("a", "b"))
    made = replace(made, values=np.array([2.0, 2.0]))
    product = covariance_of(
        replace(made, change=lambda p: float(np.linalg.norm((p[0] * p[1] - 4) * C)))
    )
    total = covariance_of(
        replace(made, change=lambda p: float(np.linalg.norm(2 * (p[0] + p[1] - 4) * C)))
    )
    assert "product a b" in product.sentences[0]
    assert "sum a + b" in total.sentences[0]


def test_difference_is_told_where_the_coordinate_is_the_excess() -> None:
    """mu_s = mu_d + w: the untold coordinate is mu_d, the untold values are both."""
    J = np.column_stack([0 * C, C])
    made = fitted(J, ar1(N, 0.0, 1), unknowns("mu_d", "mu_s"))
    made = replace(made, values=np.array([2.0, 5.0]), slope=np.array([[1.0, 0.0], [1.0, 1.0]]))
    found = covariance_of(
        replace(made, change=lambda p: float(np.linalg.norm((p[1] - p[0] - 3) * C)))
    )
    assert found.sentences[0].startswith("Only the difference mu_d - mu_s is identifiable")
    assert np.isnan(found.standard_errors).all()


def test_bounds_count_as_known_and_logarithms_keep_their_sign() -> None:
    log = replace_unknown("v_s", logarithmic=True)
    made = fitted(np.column_stack([C, V]), 30 * ar1(N, 0.0, 1), (log, *unknowns("b")))
    made = replace(made, values=np.array([0.5, 3.0]), held=np.array([False, True]))
    found = covariance_of(made)
    assert found.at_bound == ("b",)
    assert np.isnan(found.standard_errors[1])
    assert found.low[0] > 0
    assert found.low[0] * found.high[0] == pytest.approx(0.25)
    assert found.sentences[0].startswith("v_s is poorly identified: between ")


def test_half_of_itself_is_hardly_told() -> None:
    made = fitted(C[:, None], ar1(N, 0.0, 1), unknowns("F_C"))
    (error,) = covariance_of(made).standard_errors
    for share, told in ((0.45, True), (0.55, False)):
        found = covariance_of(replace(made, values=np.array([error / share])))
        assert (found.sentences == ()) == told
        assert told or found.sentences[0].startswith("F_C is poorly identified: between ")


@pytest.mark.parametrize("logarithmic", [True, False])
def test_what_could_be_nearly_anything_has_no_interval(logarithmic: bool) -> None:
    """A stiffness between 2e-164 and 7e+96 is none; its neighbour keeps its interval."""
    both = (Unknown("k", "N/m", 1.0, lower=0.0, logarithmic=logarithmic), *unknowns("b"))
    made = fitted(np.column_stack([1e-5 * C, V]), ar1(N, 0.0, 1), both)
    found = covariance_of(replace(made, values=np.array([0.5, 3.0])))
    for lost in (found.standard_errors, found.white_errors, found.low, found.high):
        assert np.isnan(lost).tolist() == [True, False]
    assert set(found.notes) == {"k"}
    assert [s for s in found.sentences if "k " in s] == [
        "k is not identifiable: its effect on the measurements is below the noise."
    ]


def test_a_level_far_above_every_force_is_not_told() -> None:
    """However small its formal error is; a level near the forces is told, a mass is no level."""
    J = np.column_stack([C, V, np.gradient(V)])
    made = fitted(J, ar1(N, 0.0, 1), unknowns("mu_s", "mu_d", "m"))
    made = replace(made, values=np.array([253.0, 0.2, 900.0]))
    found = covariance_of(made, Levels({"mu_s": 2.0, "mu_d": 2.0}, 0.6))
    assert np.isnan(found.standard_errors).tolist() == [True, False, False]
    assert found.sentences[0] == (
        "mu_s is not identifiable: no friction force in the data is near 506 N, "
        "the largest is 0.6 N."
    )
    assert "mu_s is poorly" not in " ".join(found.sentences)


def test_tied_values_follow() -> None:
    J = np.column_stack([C, V])
    made = fitted(J, ar1(N, 0.0, 1), unknowns("a", "b"))
    slope = np.array([[1.0, 0.0], [0.0, 1.0], [1.2, 0.0]])
    made = replace(made, names=("a", "b", "c"), values=slope @ made.values, slope=slope)
    found = covariance_of(made)
    assert found.standard_errors[2] == pytest.approx(1.2 * found.standard_errors[0])
    assert found.correlation[0, 2] == pytest.approx(1.0)


def test_few_effective_samples_are_said() -> None:
    made: Minimum = fitted(coulomb(200), 0.01 * np.cumsum(ar1(200, 0.5, 2)))
    said = covariance_of(made).sentences
    assert any("independent samples for 4 unknowns" in s for s in said)


def replace_unknown(name: str, *, logarithmic: bool) -> Unknown:
    return Unknown(name, "m/s", 1.0, lower=0.0, logarithmic=logarithmic)


def test_intervals_are_those_of_student() -> None:
    found = covariance("a b", (2.0, 5.0), C, V)
    reach = student.ppf(0.975, found.freedom) * found.standard_errors
    np.testing.assert_allclose(found.high - [2.0, 5.0], reach)
    np.testing.assert_allclose([2.0, 5.0] - found.low, reach)


def test_a_level_at_its_upper_bound_has_no_interval() -> None:
    above = Unknown("mu_s", "N", 24.0, upper=24.0, above="mu_d")
    made = unknowns_of((Unknown("mu_d", "N", 8.9), above), {}, ("mu_s", "mu_d"))
    w = np.array([8.9, 1.0 - 2e-16])  # at its bound but for rounding
    values, slope = (np.asarray(a) for a in made.function(w))
    J = np.column_stack([C, V]) @ slope
    at = fitted(J, ar1(N, 0.0, 1), made.unknowns)
    at = replace(at, names=made.names, values=values.ravel(), slope=slope,
                 held=np.array([False, True]))  # fmt: skip
    found = covariance_of(replace(at, change=lambda _: 1.0))
    assert found.at_bound == ("mu_s",)
    assert np.isnan(found.standard_errors[0])
    assert np.isfinite(found.standard_errors[1])


def test_a_level_whose_excess_has_no_effect_does_not_borrow_the_error_of_the_lower_one() -> None:
    """A record that only slides: 0.344 +- 2e-7 N was said of a static level of 0.15 N."""
    both = (
        Unknown("mu_s", "N", 0.15, above="mu_d", scale=0.15),
        Unknown("mu_d", "N", 0.1, lower=1e-9, logarithmic=True),
        Unknown("k", "N/m", 1e5, lower=1e-9, logarithmic=True),
    )
    made = unknowns_of(both, {}, ("mu_s", "mu_d", "k"))
    w = np.array([0.594978404, -2.30258449, 9.6])
    values, slope = made.values(w), made.slope(w)
    J = np.column_stack([0 * C, 3e7 * C, 10.0 * V]) @ slope
    at = fitted(J, ar1(N, 0.0, 1), both)
    at = replace(at, values=values, slope=slope)
    found = covariance_of(replace(at, change=lambda _: 1.0))
    assert np.isnan(found.standard_errors).tolist() == [True, False, False]
    assert found.sentences[0] == "mu_s has no influence on the measured signals."
