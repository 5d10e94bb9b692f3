"""Rungs, standings, order and verdict of rows that are written down, not measured."""

from dataclasses import replace

import pytest

from symfric.choice import Friction
from symfric.choice.measured import _by_data  # pyright: ignore[reportPrivateUsage]
from symfric.choice.needs import needed
from symfric.choice.row import INACCURATE, RANKED, Row, ordered
from symfric.choice.softness import Ladder, Rung, ladder, softness
from symfric.choice.verdict import verdict
from symfric.foundation.parameters import parameters
from symfric.laws import LuGre

ROW = Row(
    "a", RANKED, error=1e-5, method="Rodas5P", attempts=10, time_s=1e-3, steepness=5.0,
    smoothness="C∞", c_operations=100, fixed_step=0.01,
)  # fmt: skip


def test_two_runs_in_a_row_must_keep_the_error() -> None:
    """One that keeps it by chance, as where errors change their sign, is not enough."""
    errors = {1.0: 0.1, 0.25: 1e-4, 0.0625: 0.05, 0.0625 / 4: 1e-3, 0.0625 / 16: 1e-4}
    found = ladder(lambda s: Rung(s, errors[s], 1), 2e-3, 2e-3, True, (ValueError,))
    assert [rung.s for rung in found.rungs] == [*errors]
    assert found.softest(2e-3) is not None
    assert found.rungs[-2].s <= (found.softest(2e-3) or 0.0) < 0.0625


def test_between_two_rungs_the_error_is_a_power_of_the_softness() -> None:
    rungs = Ladder(tuple(Rung(s, 3 * s**0.5, 1) for s in (1.0, 0.25, 0.0625)), "")
    assert rungs.softest(1.0) == pytest.approx(1 / 9, rel=1e-12)
    assert rungs.softest(0.5) is None
    assert rungs.softest(9.0) == 1.0


def test_bristles_of_all_stiffnesses_are_damped_alike() -> None:
    """sigma_1^2 / sigma_0 stays, and with it the share of the damping that is critical."""
    law = LuGre(sigma_0=1e5, sigma_1=200.0)
    found = parameters(softness(law, Friction(0.2, 0.1), 10.0).at(0.01))
    assert found["sigma_0"].value == pytest.approx(1e7)
    assert found["sigma_1"].value == pytest.approx(2000.0)


def test_words_of_papers_are_known() -> None:
    assert needed("n", ["break-away", "Frictional lag", "P"]) == ("stiction", "presliding", "lag")


def test_ranked_laws_stand_by_time_others_by_error() -> None:
    rows = [
        replace(ROW, law="slow", time_s=2.0, error=1e-9), replace(ROW, law="fast", time_s=1.0),
        replace(ROW, law="far", standing=INACCURATE, error=0.3, time_s=0.1),
        replace(ROW, law="near", standing=INACCURATE, error=0.2, time_s=0.9),
    ]  # fmt: skip
    assert [row.law for row in ordered(rows)] == ["fast", "slow", "near", "far"]


def test_the_verdict_names_the_fastest_the_flattest_and_the_cheapest() -> None:
    rows = [
        ROW,
        replace(ROW, law="alike", time_s=1.05e-3, steepness=2.0),
        replace(ROW, law="later", time_s=2e-3, fixed_step=0.05, c_operations=200),
    ]
    fast, smooth, fixed, others = verdict(rows, ["stiction"], 1e-4, 0.05)
    assert fast.startswith("Simulation: take a, ") and fast.endswith("; alike is as fast.")
    assert smooth.startswith("Optimal control: take alike ")
    assert fixed.startswith("Controller: take later: ")  # 4000 operations a second, not 10000
    assert others == "None is left out."


def test_laws_are_ranked_that_fit_as_well_as_the_best() -> None:
    misfits = {"a": 0.0109, "b": 0.0111, "c": 0.01}
    a, b = (_by_data(misfits, replace(ROW, law=name)) for name in "ab")
    assert (a.standing, a.error) == (RANKED, 0.0109)
    assert (b.standing, b.reason) == (INACCURATE, "1.11 % off the data, the best 1 %")
