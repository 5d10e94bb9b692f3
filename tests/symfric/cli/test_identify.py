"""`symfric identify` on records made here: a mass on a known force with known friction."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.result.fitted import Fitted
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
    for k, name in enumerate(("one", "two"), start=1):
        record(k).to_csv(path / f"{name}.csv")
    points(path / "points.csv")
    return path


def points(path: Path) -> None:
    """A friction curve in mm/s and kN, headed by names that nobody knows."""
    rng = np.random.default_rng(0)
    v = np.concatenate([-np.geomspace(1, 200, 30), np.geomspace(1, 200, 30)])
    F = 3.0 + np.sign(v) * 15.0 + 0.08 * v + 0.1 * rng.standard_normal(v.size)
    lines = [f"{a},{b / 1e3}" for a, b in zip(v.tolist(), F.tolist(), strict=True)]
    path.write_text("\n".join(["speed,load", *lines]) + "\n")


def found(
    folder: Path, capsys: pytest.CaptureFixture[str], law: str, *arguments: str
) -> dict[str, Any]:
    assert main(["identify", str(folder / "one.csv"), "--law", law, *arguments, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def test_empty_cells_and_a_pause_are_read_on_request(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = (folder / "one.csv").read_text().splitlines()
    rows[50] = rows[50].split(",")[0] + ",,"
    half = len(rows) // 2
    del rows[half : half + 30]
    (tmp_path / "one.csv").write_text("\n".join(rows) + "\n")
    assert main(["identify", str(tmp_path / "one.csv"), "--law", "coulomb+viscous"]) == 2
    assert "--missing drop" in capsys.readouterr().err
    result = found(tmp_path, capsys, "coulomb+viscous", "--missing", "drop", "--resample")
    assert len(result["records"]) == 2


def test_json_holds_the_true_values_inside_their_intervals(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = found(folder, capsys, "coulomb+viscous", "--validate", str(folder / "two.csv"))
    assert result["law"] == "coulomb+viscous"
    for name, value in TRUTH.items():
        estimate = result["parameters"][name]
        assert estimate["standard_error"] > 0
        assert abs(estimate["value"] - value) < 4 * estimate["standard_error"]
    assert result["parameters"]["sigma_2"]["unit"] == "N s/m"
    assert list(result["errors"]) == ["one.csv"]
    assert result["validation"]["two.csv"]["force"]["relative"] < 5.0


def test_several_records_are_fitted_together_and_parameters_can_be_held(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    both = [str(folder / "two.csv"), "--fix", "offset=1.5", "--starts", "1"]
    result = found(folder, capsys, "coulomb+viscous", *both)
    assert result["parameters"]["offset"]["value"] == 1.5
    assert result["parameters"]["offset"]["fixed"]
    assert list(result["errors"]) == ["one.csv", "two.csv"]
    assert result["validation"] is None


def test_points_of_a_curve_with_columns_and_units_of_the_call(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [
        "identify", str(folder / "points.csv"), "--law", "coulomb+viscous", "--kind", "points",
        "--column", "v=speed", "--column", "F=load", "--unit", "v=mm/s", "--unit", "F=kN",
        "--free", "offset", "--json", "-",
    ]  # fmt: skip
    assert main(line) == 0
    parameters = json.loads(capsys.readouterr().out)["parameters"]
    assert parameters["mu_d"]["value"] == pytest.approx(15.0, abs=0.1)
    assert parameters["sigma_2"]["value"] == pytest.approx(80.0, abs=1.0)
    assert parameters["offset"]["value"] == pytest.approx(3.0, abs=0.1)


def test_the_text_fits_80_columns_and_files_are_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, picture, numbers = (tmp_path / f"r.{kind}" for kind in ("html", "png", "json"))
    line = ["--law", "coulomb+viscous", "--html", str(page), "--plot", str(picture)]
    line += ["--json", str(numbers), "--profile", "mu_d"]
    assert main(["identify", str(folder / "one.csv"), *line]) == 0
    out, err = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert out.startswith("coulomb+viscous fitted by InverseDynamics(): ")
    assert "mu_d: 1" in out.splitlines()[-1]
    assert err == f"wrote {page}, {picture}, {numbers}\n"
    assert "<h1>coulomb+viscous</h1>" in page.read_text()
    assert picture.read_bytes().startswith(b"\x89PNG")
    back = Fitted.from_json(numbers)
    assert str(back) in out
    assert json.loads(numbers.read_text())["profiles"][0]["name"] == "mu_d"
    assert back.drive is not None
    assert float(back.drive.m) == back.values["m"]


def test_several_laws_are_ranked_and_the_best_one_is_told(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = [
        "identify",
        str(folder / "one.csv"),
        "--law",
        "viscous,coulomb+viscous",
        "--starts",
        "1",
    ]
    line += ["--validate", str(folder / "two.csv"), "--html", str(tmp_path / "r.html")]
    assert main([*line, "--json", str(tmp_path / "r.json")]) == 0
    out, _ = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert [row.split()[0] for row in out.splitlines()[2:4]] == ["coulomb+viscous", "viscous"]
    assert "coulomb+viscous fitted by" in out
    assert "Ranking of laws" in (tmp_path / "r.html").read_text()
    stored = json.loads((tmp_path / "r.json").read_text())
    assert [row["law"] for row in stored["ranking"]["rows"]] == ["coulomb+viscous", "viscous"]
    assert Fitted.from_json(tmp_path / "r.json").name == "coulomb+viscous"


def test_no_physics_is_an_error_and_everything_is_written_all_the_same(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = record(1)[0]
    flipped = Dataset.of(t=good.time, x=good["x"], force=-good["force"], name="flipped")
    flipped.to_csv(tmp_path / "flipped.csv")
    page = tmp_path / "r.html"
    line = ["identify", str(tmp_path / "flipped.csv"), "--law", "coulomb+viscous"]
    assert main([*line, "--html", str(page)]) == 1
    out, err = capsys.readouterr()
    assert out.startswith("coulomb+viscous fitted by InverseDynamics(): IMPLAUSIBLE")
    assert err.splitlines()[-1].startswith("symfric: identify coulomb+viscous: implausible: ")
    assert 'class="verdict bad"' in page.read_text()


def test_where_nothing_can_be_fitted_the_data_are_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = record(1)[0]
    swapped = Dataset.of(t=good.time, x=1e-3 * good["force"], force=1e3 * good["x"], name="swapped")
    swapped.to_csv(tmp_path / "swapped.csv")
    line = ["identify", str(tmp_path / "swapped.csv"), "--law", "coulomb+viscous"]
    assert main([*line, "--json", str(tmp_path / "fit.json")]) != 0
    out, err = capsys.readouterr()
    assert "columns are exchanged" in " ".join((out + err).split())
    assert err.splitlines()[-1].startswith("symfric: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--law", "coulomb", "--fix", "mu=1"], "mu_d"),
        (["--law", "coulomb", "--column", "y=z"], "z"),
        (["--law", "coulomb", "--column", "y=z", "--column", "t,x"], "got both"),
        (["--law", "coulomb,coulomb"], "every law once"),
        (["--law", "coulomb", "--kind", "points2"], "--kind"),
        (["--law", "coulomb", "--windows", "2"], "--kind shooting only"),
        (["--law", "coulomb", "--free", "mu_d=log(1)"], "log(lower, upper)"),
        (["--law", "coulomb", "--free", "mu_d=around(1)"], "expected one of log"),
        (["--law", "coulomb", "--free", "mu_d=2:1"], "lower < upper"),
        (["--law", "coulomb", "--kind", "points", "--free", "offset=1"], "--free offset"),
        (["--law", "coulomb", "--loss", "cube"], "loss"),
        (["--law", "coulomb", "--starts", "0"], "starts"),
        (["--law", "coulomb", "--workers", "0"], "--workers"),
        (["--law", "coulomb", "--noise", "x=1"], "force"),
        (["--law", "coulomb", "--profile", "v_eps"], "profile"),
    ],
)
def test_bad_requests_are_one_sentence(
    folder: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(folder / "one.csv"), *arguments]) == 2
    out, err = capsys.readouterr()
    assert message in err
    assert err.count("\n") == 1
    assert out == ""
