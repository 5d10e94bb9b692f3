"""`symfric identify` on a record made here: a mass on a known force with known friction."""

import json
from pathlib import Path
from typing import Any

import pytest

from identification import Dataset, synthetic_drive_data
from symfric import Coulomb, Sum, Viscous
from symfric.cli import main

TRUTH = {"m": 40.0, "offset": 2.0, "mu_d": 15.0, "sigma_2": 80.0}


def record(seed: int) -> Dataset:
    law = Sum((Coulomb(mu_d=TRUTH["mu_d"], v_eps=1e-4), Viscous(sigma_2=TRUTH["sigma_2"])))
    speeds = (0.02, 0.1)
    return synthetic_drive_data(law, m=TRUTH["m"], offset=TRUTH["offset"], speeds=speeds, seed=seed)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("records")
    record(1).to_csv(path / "one.csv")
    record(2).to_csv(path / "two.csv")
    return path


def found(
    folder: Path, capsys: pytest.CaptureFixture[str], law: str, *arguments: str
) -> dict[str, Any]:
    assert main(["identify", str(folder / "one.csv"), "--law", law, *arguments, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def test_json_holds_the_true_values_inside_their_intervals(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = found(folder, capsys, "coulomb+viscous", "--validate", str(folder / "two.csv"))
    assert result["law"] == "coulomb+viscous"
    for name, value in TRUTH.items():
        estimate = result["parameters"][name]
        assert estimate["standard_error"] > 0
        half_width = estimate["upper95"] - estimate["value"]
        assert abs(estimate["value"] - value) < 2 * half_width  # four standard errors
    assert result["parameters"]["sigma_2"]["unit"] == "N s/m"
    assert result["errors"]["data"] == "one.csv"
    assert result["validation"]["data"] == "two.csv"
    assert result["validation"]["force_relative"] < 5.0


def test_parameters_can_be_held(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = found(folder, capsys, "coulomb+viscous", "--fix", "offset=1.5")
    assert result["parameters"]["offset"]["value"] == 1.5
    assert result["parameters"]["offset"]["fixed"]
    assert result["validation"] is None


def test_the_table_fits_80_columns_and_report_and_picture_are_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report, picture = tmp_path / "r.md", tmp_path / "r.png"
    line = ["--law", "coulomb+viscous", "--report", str(report), "--plot", str(picture)]
    assert main(["identify", str(folder / "one.csv"), *line]) == 0
    out, err = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert "sigma_2" in out
    assert err == f"wrote {report}, {picture}\n"
    assert report.read_text().startswith("# Identification of `coulomb+viscous`")
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--law", "lugre"], "expected a static law"),
        (["--law", "coulomb", "--fix", "mu=1"], "mu_d"),
        (["--law", "coulomb", "--column", "y=z"], "columns"),
        (["--law", "coulomb", "--folds", "1"], "folds"),
    ],
)
def test_bad_requests_are_one_sentence(
    folder: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(folder / "one.csv"), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.count("\n") == 1
