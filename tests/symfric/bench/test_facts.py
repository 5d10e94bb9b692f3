"""Published numbers, norms of constraints and drift of the energy: the limits we promise."""

import pytest

from symfric.bench.mechanisms import Fact, drifts, facts, norms


@pytest.mark.parametrize("fact", facts(), ids=lambda f: f"{f.case}-{f.signal}-{f.t:g}")
def test_reference_numbers_are_met_to_their_digits(fact: Fact) -> None:
    assert fact.value == pytest.approx(fact.reference, abs=fact.digits)


def test_constraints_are_kept_on_three_levels() -> None:
    for row in norms(("joint",)):
        assert row.phi < 1e-11
        assert row.phi_dot < 1e-13
        assert row.phi_ddot < 1e-13


@pytest.mark.slow
def test_energy_of_frictionless_mechanisms_stays_for_100_s() -> None:
    for row in drifts():
        assert row.relative < 1e-6, row.case


@pytest.mark.slow
def test_constraints_are_kept_in_absolute_coordinates() -> None:
    for row in norms(("absolute",)):
        assert row.phi < 1e-11
        assert row.phi_dot < 1e-13
        assert row.phi_ddot < 1e-13
