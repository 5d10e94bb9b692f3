from math import nan

import pytest

from symfric.bench.identification import IdentificationBenchmark, bench_identification
from symfric.bench.table import Goal


def row(value: float, better: str = "<=") -> Goal:
    return Goal("x [%]", value, 2.0, better, 0.1)


def test_a_goal_is_met_on_its_own_side_and_never_by_a_number_that_is_not_there() -> None:
    assert row(1.0).met and not row(3.0).met
    assert row(3.0, ">=").met and not row(1.0, ">=").met
    assert not row(nan).met and not row(nan, ">=").met
    assert IdentificationBenchmark((row(nan),)).to_dict()["rows"][0]["value"] is None


def test_picture_has_a_bar_for_each_number_known(tmp_path) -> None:
    result = IdentificationBenchmark((row(1.0), row(3.0), row(nan)))
    figure = result.plot(tmp_path / "goals.png")
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    assert len(widths) == 2 and widths[0] < 0 < widths[1]


def test_unknown_cases_are_refused_before_anything_is_measured() -> None:
    with pytest.raises(ValueError, match="cases"):
        bench_identification(cases=("nonsense",))
