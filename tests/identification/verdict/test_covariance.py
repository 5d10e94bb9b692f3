"""Intervals and words about what the data do not tell."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from linear_fits import ar1, coulomb, fitted
from scipy.stats import t as student

from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import unknowns_of
from identification.verdict.covariance import Covariance, Levels, covariance

N = 400
C, V = coulomb(N).T[1:3]


def of(
    unknowns: str | tuple[Unknown, ...], *columns: np.ndarray, noise: float = 1.0,
    levels: Levels | None = None, **changes: Any,
) -> Covariance:  # fmt: skip
    """Of a fit with these derivatives by the unknowns."""
    if isinstance(unknowns, str):
        unknowns = tuple(Unknown(n, "N", 1.0) for n in unknowns.split())
    made = fitted(np.column_stack(columns), noise * ar1(N, 0.0, 1), unknowns)
    if "values" in changes:
        changes["values"] = np.array(changes["values"])
    return covariance(replace(made, **changes), levels)


def norm(x: np.ndarray) -> float:
    return float(np.linalg.norm(x))


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
def test_what_is_not_identifiable_is_reported(
    names: str, values: tuple[float, ...], columns: tuple[np.ndarray, ...], sentence: str
) -> None:
    J = np.column_stack(columns)
    found = of(names, *columns, values=values, change=lambda p: norm(J @ (p - values)))
    assert found.sentences[0].startswith(sentence)
    group = found.undetermined[0]
    for name, error in zip(found.names, found.standard_errors, strict=True):
        assert np.isnan(error) == (name in group)


def test_equal_values_are_distinguished_by_a_small_step() -> None:
    """a = b = 2: a product and a sum have the same derivatives."""
    same: Any = ("a b", 2 * C, 2 * C)
    product = of(*same, values=(2.0, 2.0), change=lambda p: norm((p[0] * p[1] - 4) * C))
    total = of(*same, values=(2.0, 2.0), change=lambda p: norm(2 * (p[0] + p[1] - 4) * C))
    assert "product a b" in product.sentences[0]
    assert "sum a + b" in total.sentences[0]


def test_difference_is_identifiable_where_the_coordinate_is_the_excess() -> None:
    """mu_s = mu_d + w: the untold coordinate is mu_d, the untold values are both."""
    slope = np.array([[1.0, 0.0], [1.0, 1.0]])
    change = lambda p: norm((p[1] - p[0] - 3) * C)  # noqa: E731
    found = of("mu_d mu_s", 0 * C, C, values=(2.0, 5.0), slope=slope, change=change)
    assert found.sentences[0].startswith("Only the difference mu_d - mu_s is identifiable")
    assert np.isnan(found.standard_errors).all()


def test_bounds_count_as_known_and_logarithms_keep_their_sign() -> None:
    both = (Unknown("v_s", "m/s", 1.0, 0.0, logarithmic=True), Unknown("b", "N", 1.0))
    found = of(both, C, V, noise=30.0, values=(0.5, 3.0), held=np.array([False, True]))
    assert found.at_bound == ("b",)
    assert np.isnan(found.standard_errors[1])
    assert found.low[0] > 0
    assert found.low[0] * found.high[0] == pytest.approx(0.25)
    assert found.sentences[0].startswith("v_s is poorly identified: between ")


def test_an_error_of_half_the_value_is_poorly_identified() -> None:
    (error,) = of("F_C", C).standard_errors
    assert of("F_C", C, values=[error / 0.45]).sentences == ()
    (reported,) = of("F_C", C, values=[error / 0.55]).sentences
    assert reported.startswith("F_C is poorly identified: between ")


@pytest.mark.parametrize("logarithmic", [True, False])
def test_what_could_be_nearly_anything_has_no_interval(logarithmic: bool) -> None:
    """A stiffness between 2e-164 and 7e+96 is none; its neighbour keeps its interval."""
    both = (Unknown("k", "N/m", 1.0, 0.0, logarithmic=logarithmic), Unknown("b", "N", 1.0))
    found = of(both, 1e-5 * C, V, values=(0.5, 3.0))
    for lost in (found.standard_errors, found.white_errors, found.low, found.high):
        assert np.isnan(lost).tolist() == [True, False]
    assert set(found.notes) == {"k"}
    reported = "k is not identifiable: its effect on the measurements is below the noise."
    assert [s for s in found.sentences if "k " in s] == [reported]


def test_a_level_far_above_every_force_is_not_identifiable() -> None:
    """Regardless of its formal error. Levels near the forces and masses are not affected."""
    levels = Levels({"mu_s": 2.0, "mu_d": 2.0}, 0.6)
    columns = C, V, np.gradient(V)
    found = of("mu_s mu_d m", *columns, levels=levels, values=(253.0, 0.2, 900.0))
    assert np.isnan(found.standard_errors).tolist() == [True, False, False]
    reported = (
        "mu_s is not identifiable: no friction force in the data is near 506 N, the largest is"
    )
    assert found.sentences[0] == f"{reported} 0.6 N."
    assert "mu_s is poorly" not in " ".join(found.sentences)


def test_tied_values_follow() -> None:
    slope = np.array([[1.0, 0.0], [0.0, 1.0], [1.2, 0.0]])
    found = of("a b", C, V, names=("a", "b", "c"), values=slope @ [2.0, 5.0], slope=slope)
    assert found.standard_errors[2] == pytest.approx(1.2 * found.standard_errors[0])
    assert found.correlation[0, 2] == pytest.approx(1.0)


def test_intervals_are_those_of_student() -> None:
    found = of("a b", C, V, values=(2.0, 5.0))
    reach = student.ppf(0.975, found.freedom) * found.standard_errors
    np.testing.assert_allclose(found.high - [2.0, 5.0], reach)
    np.testing.assert_allclose([2.0, 5.0] - found.low, reach)


def ordered(
    unknowns: tuple[Unknown, ...], w: list[float], *columns: np.ndarray, **changes: Any
) -> Covariance:
    """At the coordinates `w` of unknowns in an order, with these derivatives by their values."""
    made = unknowns_of(unknowns, {}, [u.name for u in unknowns])
    values, slope = made.values(np.array(w)), made.slope(np.array(w))
    J = (np.column_stack(columns) @ slope).T
    return of(unknowns, *J, values=values, slope=slope, change=lambda _: 1.0, **changes)


def test_a_level_at_its_upper_bound_has_no_interval() -> None:
    both = (Unknown("mu_d", "N", 8.9), Unknown("mu_s", "N", 24.0, upper=24.0, above="mu_d"))
    rounded = [8.9, 1.0 - 2e-16]  # at its bound but for rounding
    found = ordered(both, rounded, C, V, held=np.array([False, True]))
    assert found.at_bound == ("mu_s",)
    assert np.isnan(found.standard_errors).tolist() == [False, True]


def test_a_level_whose_excess_has_no_effect_does_not_borrow_the_error_of_the_lower_one() -> None:
    """A record that only slides: 0.344 +- 2e-7 N was reported for a static level of 0.15 N."""
    three = (
        Unknown("mu_s", "N", 0.15, above="mu_d", scale=0.15),
        Unknown("mu_d", "N", 0.1, lower=1e-9, logarithmic=True),
        Unknown("k", "N/m", 1e5, lower=1e-9, logarithmic=True),
    )
    at = [0.594978404, -2.30258449, 9.6]
    found = ordered(three, at, 0 * C, 3e7 * C, 10.0 * V)
    assert np.isnan(found.standard_errors).tolist() == [True, False, False]
    assert found.sentences[0] == "mu_s has no influence on the measured signals."
