"""Chains of growing length: what is measured, and the exponent of a power law."""

import pytest

from symfric import BrownMcPhee, simulate
from symfric.bench.mechanisms import ChainRow, chain, exponent, scaling


def test_every_length_is_measured() -> None:
    rows = scaling(chain, (2, 4))
    assert [row.links for row in rows] == [2, 4]
    assert all(row.step_s > 0 and row.build_s > 0 for row in rows)
    assert rows[0].instructions < rows[1].instructions


def test_a_chain_that_takes_too_long_to_build_is_the_last() -> None:
    assert [row.links for row in scaling(chain, (1, 2, 3), budget=0.0)] == [1]


@pytest.mark.parametrize("power", [1.0, 1.3, 2.0])
def test_exponent_is_that_of_a_power_law(power: float) -> None:
    rows = [ChainRow(n, 1.0, 100, 1e-6 * n**power) for n in (2, 4, 8, 16, 32)]
    assert exponent(rows, "step_s") == pytest.approx(power)
    assert exponent(rows, "instructions") == pytest.approx(0.0, abs=1e-12)


def test_short_chains_count_only_where_there_are_no_longer_ones() -> None:
    rows = [ChainRow(n, 1.0, 1, s) for n, s in ((2, 1.0), (8, 2.0), (16, 4.0))]
    assert exponent(rows, "step_s") == pytest.approx(1.0)
    assert exponent(rows[:2], "step_s") == pytest.approx(0.5)


def test_a_chain_keeps_its_energy_or_loses_it_to_friction() -> None:
    free = simulate(chain(3), 0.5, rtol=1e-9)["energy"]
    rough = simulate(chain(3, BrownMcPhee()), 0.5, rtol=1e-7)["energy"]
    assert abs(free - free[0]).max() < 1e-6
    assert rough[-1] < rough[0] - 1e-2
