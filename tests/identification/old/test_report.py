import pytest

from identification import Dataset, Filter, Identification, identify
from identification.old.report import table


def test_table_is_aligned() -> None:
    text = table(["a", "long"], [["1", "2"], ["wide cell", ""]])
    assert len({len(line) for line in text.splitlines()}) == 1


@pytest.mark.parametrize(
    "text",
    [
        "# Identification of `stribeck` from synthetic drive, seed 0",
        "| mu_s      | 28.",
        "fixed: smoothing width, small against the speeds",
        "mu_s, mu_d read as force levels in newtons",
        "Cross-validation inside the record",
        "## Correlation of the estimates",
    ],
)
def test_report_says_what_was_found(stribeck: Identification, text: str) -> None:
    assert text in stribeck.report()


def test_report_of_another_record_has_no_published_values(stribeck: Identification) -> None:
    assert "published" not in stribeck.report()


def test_report_names_what_cannot_be_told_apart(stage: Dataset) -> None:
    found = identify(stage, "viscous+viscous", filter=Filter(100.0, 10))
    assert "**Not identifiable:** sigma_2_1, sigma_2_2 cannot be told apart" in found.report()


def test_emps_stands_beside_the_published_models(emps_directions: Identification) -> None:
    lines = emps_directions.report().splitlines()
    ours = next(line for line in lines if line.startswith("| ours") and "95.1" in line)
    assert ours.count("(") == 5
    assert any("published, least squares" in line and "95.1089 (0.10" in line for line in lines)
    assert any("DATA_EMPS_PULSES.mat | 5.980" in line for line in lines)
