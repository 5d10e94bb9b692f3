import numpy as np
import pytest

from identification.unknowns.spec import Unknown
from identification.unknowns.unknowns import unknowns_of


def test_a_logarithmic_value_that_wants_to_be_nothing_is_at_its_bound() -> None:
    both = (Unknown("b", "1", 0.05, 0.0, logarithmic=True), Unknown("c", "1", 0.05))
    made = unknowns_of(both, {}, ("b", "c"))
    gone = np.array([-700.0, 0.0])
    assert made.at_bound(gone).tolist() == [True, False]
    there = np.maximum(gone, made.limits[0])
    assert made.values(there)[0] == pytest.approx(0.05e-12)
    assert np.linalg.det(made.slope(there)) > 0
    assert not made.at_bound(made.start).any()


def test_a_value_that_wants_to_be_infinite_is_at_its_bound() -> None:
    three = (
        Unknown("k", "N/m", 2.0, 0.0, logarithmic=True),
        Unknown("mu_d", "1", 0.3),
        Unknown("mu_s", "1", 0.4, above="mu_d", scale=0.1),
    )
    made = unknowns_of(three, {}, ("k", "mu_d", "mu_s"))
    far = np.array([700.0, 1e9, 300.0])
    assert made.at_bound(far).tolist() == [True, False, True]
    there = np.minimum(far, made.limits[1])
    k, mu_d, mu_s = made.values(there)
    assert (k, mu_s - mu_d) == pytest.approx((2e12, 0.2e12), rel=1e-3)
    assert not made.at_bound(made.start).any()


def test_a_value_goes_back_to_the_far_bound_that_its_law_has() -> None:
    v_s = Unknown("v_s", "m/s", 1e-3, lower=1e-12, upper=1e6, logarithmic=True)
    made = unknowns_of((v_s,), {}, ("v_s",))
    low, high = made.values(made.limits[0])[0], made.values(made.limits[1])[0]
    assert 1e-12 < low < 1.001e-12
    assert 0.999e6 < high < 1e6


def test_both_ends_of_a_box_are_bounds() -> None:
    made = unknowns_of((Unknown("a", "m", 2.0, 1.0, 3.0), Unknown("b", "m", 0.0)), {}, ("a", "b"))
    for value, there in ((1.0, True), (2.0, False), (3.0, True)):
        assert made.at_bound(np.array([value, 0.0])).tolist() == [there, False]
