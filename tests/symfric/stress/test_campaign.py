"""A campaign counts, keeps what fails, and survives an interrupt."""

import json
from pathlib import Path

import pytest

from symfric.stress.campaign import Report, campaign, rerun
from symfric.stress.cases import Case, draw
from symfric.stress.judge import CLASSES, FAILING, Verdict, judge

COSTLY = ("arm", "four_bar", "double_pendulum")
"""Scenes of which the suite takes no case."""
LONG = (2, 18)
"""Cases of seconds."""
SEEDS = (20261, 20262, 20263, 20264)


def test_of_a_few_random_cases_none_is_silently_wrong_or_ends_badly() -> None:
    """The suite's share of `symfric stress`."""
    numbers = [n for n in range(20) if draw(1, n).scene not in COSTLY and n not in LONG]
    report = campaign(numbers, work=12_000)
    failing = {n: v.reason for n, v in report.verdicts.items() if v.kind in FAILING}
    assert not failing
    assert report.classes["right"] > 0.6 * len(numbers)
    assert report.refereed > 0.3 * len(numbers)
    assert len(report.verdicts) == len(numbers)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_of_500_random_cases_none_is_silently_wrong_and_few_are_undecided(seed: int) -> None:
    report = campaign(500, seed)
    failing = {n: v.reason for n, v in report.verdicts.items() if v.kind in FAILING}
    assert not failing
    assert report.classes["undecided"] < 5
    assert report.classes["right"] > 350
    assert report.refereed > 200


def test_workers_do_not_change_what_is_found() -> None:
    report = campaign(4, seed=7, workers=2)
    assert [report.verdicts[n] for n in range(4)] == [judge(draw(7, n)) for n in range(4)]


def test_an_interrupt_keeps_what_there_is() -> None:
    def interrupt(_: Report) -> None:
        raise KeyboardInterrupt

    report = campaign(50, workers=1, progress=interrupt)
    assert (len(report.verdicts), report.asked) == (1, 50)


def test_numbers_of_a_campaign_are_positive() -> None:
    for cases, workers, limit in ((0, 1, 1.0), (5, 0, 1.0), (5, 1, -1.0)):
        with pytest.raises(ValueError, match=r"stress: expected [a-z]+ > 0"):
            campaign(cases, workers=workers, limit=limit)


def test_a_case_runs_again_in_a_process_of_its_own() -> None:
    assert rerun(draw(3, 1)) == judge(draw(3, 1))
    assert rerun(Case(1, 1, "drive", "dahl", {"mu": 1.0})).kind == "refused"


REPORT = Report(
    7,
    5,
    {
        0: Verdict("right", "", "", 0.5),
        1: Verdict("silent", "1e6 tolerances off", "", 1e6),
        2: Verdict("refused", "no", "input"),
        3: Verdict("loose", "20 tolerances off", "", 20.0),
    },
    12.0,
)


def test_a_report_counts_classes_and_keeps_failing_cases(tmp_path: Path) -> None:
    data = json.loads(json.dumps(REPORT.to_dict(), allow_nan=False))
    assert data["classes"] == {name: 0 for name in CLASSES} | {
        "right": 1, "silent": 1, "refused": 1, "loose": 1,
    }  # fmt: skip
    assert data["groups"]["refused"] == {"input": 1}
    assert (data["cases"], data["asked"], data["seed"]) == (4, 5, 7)
    assert data["errors_in_tolerances"]["greatest"] == 20.0
    assert not REPORT.passed
    (path,) = REPORT.save(tmp_path / "new")
    assert path.name == "silent_7_1.json"
    assert Case.read(path) == draw(7, 1)
