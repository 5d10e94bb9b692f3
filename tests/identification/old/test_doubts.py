"""Mistakes of a record are said, and nonsense is not called a result."""

from dataclasses import replace
from re import search

import numpy as np
import pytest

from identification import Dataset, Filter, identify
from identification.old.doubts import of_motion, of_record
from symfric import SolveError, Status

FILTER = Filter(100.0, 10)


def with_spikes(data: Dataset, key: str, size: float, count: int) -> Dataset:
    values = data.signals()[key].copy()
    values[np.linspace(500, 6000, count).astype(int)] += size
    return replace(data, **{key: values}, loop=None)


def test_sound_records_are_passed_over(stage: Dataset) -> None:
    records = [
        stage,
        replace(stage, x=1e-5 * np.round(stage.x / 1e-5)),
        replace(stage, force=5 * np.round(stage.force / 5)),
        replace(stage, x=stage.x + 1e-6 * np.random.default_rng(0).standard_normal(stage.x.size)),
    ]
    assert [list(of_record(record)) for record in records] == [[]] * 4
    assert not list(of_motion(np.gradient(stage.x)))


def test_what_is_wrong_with_a_record_is_said(stage: Dataset) -> None:
    frozen = stage.x.copy()
    frozen[5200:5600] = frozen[5200]
    one_way = np.abs(np.gradient(stage.x))
    cases = {
        r"stays at its largest value 25 N in \d+%": replace(stage, force=stage.force.clip(-99, 25)),
        r"stays at its smallest value -25 N": replace(stage, force=stage.force.clip(-25, 99)),
        r"force is far off its neighbours in 1 samples, most in sample 500 with 100\d\d\.?\d* N":
            with_spikes(stage, "force", 1e4, 1),
        r"position jumps 6 times, at most by 0.05": with_spikes(stage, "x", 0.05, 3),
        r"position jumps 1 times": replace(stage, x=frozen),
    }  # fmt: skip
    for words, record in cases.items():
        assert [bool(search(words, text)) for text in of_record(record)] == [True]
    assert list(of_motion(one_way)) == [
        "The drive moves one way only: friction cannot be told from a constant force."
    ]


def test_force_of_the_wrong_sign_is_no_result(stage: Dataset) -> None:
    """Guards m = 2.6e-12 kg being called solved."""
    turned = replace(stage, force=-stage.force, loop=None)
    with pytest.raises(
        SolveError, match=r"cannot be meant: .* The mass is at its bound.* sign"
    ) as e:
        identify(turned, "stribeck", filter=FILTER)
    assert e.value.status is Status.IMPLAUSIBLE
    assert e.value.partial.linear.values["m"] < 0
    assert identify(turned, "coulomb", filter=FILTER, throw=False).status is Status.IMPLAUSIBLE


def test_a_force_that_no_law_explains_is_no_result(stage: Dataset) -> None:
    noise = np.random.default_rng(0).standard_normal(stage.t.size)
    with pytest.raises(SolveError, match=r"The law leaves \d+ % of the force unexplained"):
        identify(replace(stage, force=noise, loop=None), "coulomb+viscous", filter=FILTER)


def test_a_clipped_force_and_a_spike_are_said_beside_the_result(stage: Dataset) -> None:
    """Guards both being solved without a word."""
    clipped = replace(stage, force=stage.force.clip(-25.0, 25.0), loop=None)
    with pytest.warns(UserWarning, match="seed 0': The force stays at its largest value 25 N"):
        found = identify(clipped, "coulomb+viscous", filter=FILTER)
    assert "amplifier or the sensor was at its limit" in found.message
    assert "amplifier or the sensor was at its limit" in found.report()
    with pytest.warns(UserWarning, match="The force is far off its neighbours in 1 samples"):
        identify(with_spikes(stage, "force", 1e3, 1), "coulomb+viscous", filter=FILTER, throw=False)


def test_more_pieces_than_equations_are_refused_at_once(stage: Dataset) -> None:
    """Guards a cross-validation that never ends."""
    with pytest.raises(ValueError, match=r"folds: expected at most .* equations, got 1000000"):
        identify(stage, "coulomb", filter=FILTER, folds=1_000_000)
