"""Cross-validation and ranking of laws on points of a Stribeck curve."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from identification.cross import Left, cross_validate, percent, relative, shared, uncertainty
from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from identification.select import FitRanking, select
from symfric import Stribeck
from symfric.foundation.status import Status
from symfric.laws import steady_force

LAW = Stribeck(mu_s=6.0, mu_d=4.0, v_s=0.02, v_eps=1e-4, sigma_2=8.0)


def points(seed: int, noise: float = 0.05, n: int = 160) -> Dataset:
    r = np.random.default_rng(seed)
    v = r.choice([-1, 1], n) * np.geomspace(2e-3, 0.3, n)
    F = np.asarray(steady_force(LAW, v, 1.0)) + noise * r.standard_normal(n)
    return Dataset.of(v=v, F=F, units={"v": "m/s", "F": "N"}, points=True, name=f"points {seed}")


@pytest.fixture(scope="module")
def ranking() -> FitRanking:
    laws = {name: name for name in ("coulomb", "coulomb+viscous", "stribeck")}
    return select({**laws, "<odd>": "stribek"}, points(1), Points(), starts=2)


def test_the_true_law_is_first_and_the_unknown_one_last(ranking: FitRanking) -> None:
    assert [row.law for row in ranking.rows] == ["stribeck", "coulomb+viscous", "coulomb", "<odd>"]
    first = ranking.rows[0]
    assert first.status == "SOLVED"
    assert first.aicc == first.bic == 0.0
    assert first.validation == pytest.approx(100 * 0.05 / np.std(points(1)[0]["F"]), rel=0.3)
    assert ranking["coulomb"].status == "DOUBTFUL"
    assert ranking["coulomb"].bic > 100
    assert ranking.best.law is not None
    assert "stribeck" in ranking.rows[-1].sentence


@pytest.mark.slow
def test_the_simpler_law_is_first_within_the_standard_error() -> None:
    """Data of Coulomb and viscous friction; the Stribeck peak may predict better by chance."""
    first = list[str]()
    for seed in range(8):
        r = np.random.default_rng(seed)
        v = r.choice([-1, 1], 120) * np.geomspace(2e-3, 0.3, 120)
        F = 4 * np.sign(v) + 8 * v + 0.1 * r.standard_normal(v.size)
        data = Dataset.of(v=v, F=F, units={"v": "m/s", "F": "N"}, points=True)
        found = select(["stribeck", "coulomb+viscous"], data, Points(), starts=1)
        first.append(found.rows[0].law)
        assert 0 < found.rows[0].uncertainty < 0.3 * found.rows[0].validation
    assert first.count("coulomb+viscous") >= 7


def test_the_standard_error_is_the_spread_over_seeds() -> None:
    def errors(seed: int) -> list[Left]:
        r = np.random.default_rng(seed)
        noise = np.convolve(r.standard_normal(2009), np.ones(10) / np.sqrt(10), mode="valid")
        return [Left("a", "F", "N", np.arange(2000.0), noise, 5.0)]

    found = np.array([(relative(e), uncertainty(e)) for e in map(errors, range(40))])
    assert found[:, 1].mean() == pytest.approx(found[:, 0].std(), rel=0.3)


def test_ranking_prints_plots_and_is_plain_data(ranking: FitRanking) -> None:
    text = str(ranking)
    assert "4 folds (points)" in text
    assert "not fitted" in text.splitlines()[-1]
    rows = ranking.to_dict()["rows"]
    assert rows[0]["operations"] > rows[2]["operations"]
    assert rows[-1]["validation [%]"] is None
    assert ranking.plot().axes
    page = ranking._repr_html_()
    assert ">stribeck<" in page and "&lt;odd&gt;" in page and "<odd>" not in page
    assert page.count("<tr>") == 1 + 4


def test_a_prediction_that_ran_away_is_no_number() -> None:
    tiny = points(2).scaled({"F": 1e-9})
    found = select({"mine": LAW}, points(1), Points(), tiny, starts=1)
    (row,) = found.rows
    assert "diverged" in str(found)
    assert "e+" not in str(found)
    assert "not fitted its error exceeds 1000 %" in row.sentence
    assert row.to_dict()["validation [%]"] is None
    assert percent(4.56789) == "4.57 %"


def test_other_data_replace_folds_and_too_many_folds_are_reported() -> None:
    found = select({"mine": LAW}, points(1), Points(), points(2), starts=1)
    assert found.how == "validation on points 2"
    assert found.rows[0].validation == pytest.approx(found.rows[0].fitted, rel=0.2)
    short = select(["coulomb"], points(1), Points(), starts=1, folds=1000)
    assert short.how == "no validation, although 1000 folds were requested"


def test_records_are_left_out_whole() -> None:
    data = points(1) + points(2) + points(3)
    found = cross_validate(Fit(Points(), "coulomb", data, starts=1), folds=3)
    assert found.by == "records"
    assert found.folds == 3
    assert {part.record for part in found.left} == {"points 1", "points 2", "points 3"}
    assert found.relative == pytest.approx(100 * found.rms["F"] / np.std(data[0]["F"]), rel=0.02)


def test_blocks_of_time_keep_a_distance() -> None:
    from identification.cross import _divided  # noqa: PLC0415  # pyright: ignore

    t = np.arange(400) * 1e-3
    data = Dataset.of(t=t, x=np.sin(t), force=np.cos(t), units="m, N")
    parts, by = _divided(data, 4)
    assert by == "blocks of time"
    rest, part = parts[1]
    assert part[0].size == 100
    assert [r.size for r in rest] == [95, 195]


def test_errors_are_compared_where_all_have_some() -> None:
    def left(times: Sequence[float]) -> list[Left]:
        t = np.array(times, float)
        return [Left("a", "F", "N", t, t, 2.0)]

    first, second = shared([left([1, 2, 3]), left([2, 3, 4])])
    np.testing.assert_array_equal(first[0].t, second[0].t)
    assert relative(first) == pytest.approx(100 * np.sqrt(6.5) / 2)
    assert np.isnan(relative([]))


def test_criteria_are_those_of_the_errors_and_the_numbers_of_parameters(
    ranking: FitRanking,
) -> None:
    first, other = ranking["stribeck"], ranking["coulomb"]
    n, better = ranking.effective, 2 * np.log(other.fitted / first.fitted)
    fewer = first.parameters - other.parameters
    assert n == 160 and fewer == 3
    assert other.bic == pytest.approx(n * better - fewer * np.log(n))
    k, m = first.parameters, other.parameters
    cost = 2 * k * n / (n - k - 1) - 2 * m * n / (n - m - 1)
    assert other.aicc == pytest.approx(n * better - cost)


def test_an_interrupted_fit_is_not_validated_at_length(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(self: Fit, **_: object) -> object:
        return replace(solve(self, throw=False), status=Status.INTERRUPTED)

    solve = Fit.solve
    monkeypatch.setattr(Fit, "solve", interrupted)
    found = select(["coulomb"], points(1), Points(), starts=1)
    assert np.isnan(found["coulomb"].validation)
