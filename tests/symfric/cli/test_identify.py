"""`symfric identify` on records made here: a mass on a known force with known friction."""

import json
from pathlib import Path
from typing import Any

import crane
import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.result.fitted import Fitted
from identification.unknowns.spec import above, linear, log, tied
from symfric import Coulomb, SolveError, Sum, Viscous
from symfric.cli.identify import free_in, refuse

TRUTH = {"m": 40.0, "offset": 2.0, "mu_d": 15.0, "sigma_2": 80.0}
LINE = "identify one.csv --law coulomb+viscous --starts 1"


@pytest.fixture(scope="session")
def made() -> list[Dataset]:
    law = Sum((Coulomb(mu_d=TRUTH["mu_d"], v_eps=1e-4), Viscous(sigma_2=TRUTH["sigma_2"])))
    how: dict[str, Any] = {"m": TRUTH["m"], "offset": TRUTH["offset"], "rate": 250.0}
    return [synthetic_drive_data(law, **how, speeds=(0.02, 0.1), seed=seed) for seed in (1, 2)]


@pytest.fixture(autouse=True)
def records(made: list[Dataset], symfric) -> None:
    """Two records, and a friction curve in mm/s and kN under other names."""
    for name, record in zip(("one", "two"), made, strict=True):
        record.to_csv(f"{name}.csv")
    rng = np.random.default_rng(0)
    v = np.concatenate([-np.geomspace(1, 200, 30), np.geomspace(1, 200, 30)])
    F = 3.0 + np.sign(v) * 15.0 + 0.08 * v + 0.1 * rng.standard_normal(v.size)
    lines = [f"{a},{b / 1e3}" for a, b in zip(v.tolist(), F.tolist(), strict=True)]
    Path("points.csv").write_text("\n".join(["speed,load", *lines]) + "\n")


def test_empty_cells_and_a_pause_are_read_on_request(symfric) -> None:
    rows = Path("one.csv").read_text().splitlines()
    rows[50] = rows[50].split(",")[0] + ",,"
    half = len(rows) // 2
    del rows[half : half + 30]
    Path("one.csv").write_text("\n".join(rows) + "\n")
    assert "--missing drop" in symfric(LINE, 2).err
    assert len(symfric(f"{LINE} --missing drop --resample --json -").json["records"]) == 2


def test_a_wrong_sign_is_turned(symfric) -> None:
    rows = Path("one.csv").read_text().splitlines()
    k = next(k for k, name in enumerate(rows[0].split(",")) if name.startswith("force"))
    cells = [row.split(",") for row in rows]
    for row in cells[1:]:
        row[k] = str(-float(row[k]))
    Path("turned.csv").write_text("\n".join(map(",".join, cells)) + "\n")
    line = LINE.replace("one.csv", "turned.csv")
    assert "sign" in symfric(line, 1).out
    right = symfric(f"{LINE} --json -").json["parameters"]
    assert symfric(f"{line} --scale force=-1 --json -").json["parameters"] == right


def test_the_true_values_are_inside_their_intervals_and_files_are_written(symfric) -> None:
    files = "--html r.html --plot r.png --json r.json"
    printed = symfric(f"{LINE} --validate two.csv --profile mu_d {files}")
    result = json.loads(Path("r.json").read_text())
    for name, value in TRUTH.items():
        estimate = result["parameters"][name]
        assert 0 < abs(estimate["value"] - value) < 4 * estimate["standard_error"]
    assert result["parameters"]["sigma_2"]["unit"] == "N s/m"
    assert list(result["errors"]) == ["one.csv"]
    assert result["validation"]["two.csv"]["force"]["relative"] < 5.0
    assert printed.out.startswith("coulomb+viscous fitted by InverseDynamics(): ")
    assert "mu_d: 1" in printed.out.splitlines()[-1]
    assert printed.err == "wrote r.html, r.png, r.json\n"
    assert "<h1>coulomb+viscous</h1>" in Path("r.html").read_text()
    assert Path("r.png").read_bytes().startswith(b"\x89PNG")
    back = Fitted.from_json("r.json")
    assert str(back) in printed.out
    assert result["profiles"][0]["name"] == "mu_d"
    assert back.drive is not None
    assert float(back.drive.m) == back.values["m"]


def test_records_are_fitted_together_and_parameters_can_be_held(symfric) -> None:
    result = symfric(f"{LINE} two.csv --fix offset=1.5 --json -").json
    offset = result["parameters"]["offset"]
    assert (offset["value"], offset["fixed"]) == (1.5, True)
    assert list(result["errors"]) == ["one.csv", "two.csv"]
    assert result["validation"] is None


def test_a_dead_time_is_estimated_between_bounds(symfric) -> None:
    result = symfric(f"{LINE} --dead-time 0:6e-3 --starts 1 --json -").json
    assert abs(result["parameters"]["dead_time[0]"]["value"]) < 6e-3


def test_points_of_a_curve_with_columns_and_units_of_the_call(symfric) -> None:
    line = "identify points.csv --law coulomb+viscous --kind points --free offset --json -"
    named = symfric(f"{line} --column v=speed --column F=load --unit v=mm/s --unit F=kN").json
    listed = symfric(f"{line} --column v,F --unit 'mm/s, kN'").json
    assert listed["parameters"] == named["parameters"]
    values = {name: p["value"] for name, p in named["parameters"].items()}
    for name, value in {"mu_d": 15.0, "sigma_2": 80.0, "offset": 3.0}.items():
        assert values[name] == pytest.approx(value, abs=1.0 if name == "sigma_2" else 0.1)


def test_several_laws_are_ranked_and_the_best_one_is_shown(symfric) -> None:
    line = "identify one.csv --law viscous,coulomb+viscous --starts 1 --validate two.csv"
    out = symfric(f"{line} --html r.html --json r.json").out
    assert [row.split()[0] for row in out.splitlines()[2:4]] == ["coulomb+viscous", "viscous"]
    assert "coulomb+viscous fitted by" in out
    assert "Ranking of laws" in Path("r.html").read_text()
    stored = json.loads(Path("r.json").read_text())
    assert [row["law"] for row in stored["ranking"]["rows"]] == ["coulomb+viscous", "viscous"]
    assert Fitted.from_json("r.json").name == "coulomb+viscous"


def test_an_implausible_fit_is_an_error_and_everything_is_written(symfric, made) -> None:
    good = made[0][0]
    flipped = Dataset.of(t=good.time, x=good["x"], force=-good["force"], name="flipped")
    flipped.to_csv("one.csv")
    printed = symfric(f"{LINE} --html r.html", 1)
    assert printed.out.startswith("coulomb+viscous fitted by InverseDynamics(): IMPLAUSIBLE")
    reason = printed.err.splitlines()[-1]
    assert reason.startswith("symfric: identify coulomb+viscous: implausible: ")
    assert 'class="verdict bad"' in Path("r.html").read_text()
    swapped = Dataset.of(t=good.time, x=1e-3 * good["force"], force=1e3 * good["x"], name="swapped")
    swapped.to_csv("one.csv")
    (reason,) = symfric(LINE, 2).err.splitlines()
    assert "columns are exchanged; then data 'one.csv': expected at least 10" in reason


def test_failed_validation_and_profiles_are_errors(symfric, made) -> None:
    good = made[0][0]
    Dataset.of(t=good.time, x=-good["x"], force=good["force"], name="bad").to_csv("bad.csv")
    printed = symfric(f"{LINE} --validate bad.csv", 1)
    assert "fitted by" in printed.out
    assert "--validate: " in printed.err
    fit = Fitted.from_json(Path(symfric(f"{LINE} --json f.json").err.split()[-1]))
    refuse(fit, None, ())
    with pytest.raises(SolveError, match="no profile; no data"):
        refuse(fit, None, ["no profile", "no data"])


def test_free_parameters_have_the_specifications_of_python() -> None:
    texts = ["a", "b=1.5", "c=0:2", "d=:2", "e=-1:", "f=log(1,2)", "g=linear(0, 2, 1)",
             "h=above(a)", "i=tied(a, 1.2)", "x0=rest", "dead_time=0:1e-3"]  # fmt: skip
    inf = float("inf")
    assert free_in(texts) == {
        "a": None, "b": 1.5, "c": (0, 2), "d": (-inf, 2), "e": (-1, inf), "f": log(1, 2),
        "g": linear(0, 2, 1), "h": above("a"), "i": tied("a", 1.2), "x0": "rest",
        "dead_time": (0, 1e-3),
    }  # fmt: skip


def test_a_robot_is_identified_from_its_urdf_and_logs(symfric) -> None:
    Path("crane.urdf").write_text(crane.urdf(1.2, '<dynamics damping="9"/>'))
    crane.log(0, 6.0).to_csv("run.csv")
    crane.log(1, 6.0).to_csv("other.csv")
    line = "identify crane.urdf run.csv --validate other.csv"
    printed = symfric(f"{line} --urdf new.urdf --plot fit.png --json fit.json")
    assert printed.out.startswith(
        "robot 'crane': 3 joints, law coulomb+viscous\nThe log determines"
    )
    assert "other.csv, which did not enter the fit" in printed.out
    assert printed.err == "wrote fit.png, new.urdf, fit.json\n"
    found = json.loads(Path("fit.json").read_text())
    for joint, level in zip(crane.NAMES, crane.COULOMB, strict=True):
        estimate = found["friction"][joint]["mu_d"]
        assert abs(estimate["value"] - level) < 4 * estimate["standard_error"]
    assert 'damping="9"' not in Path("new.urdf").read_text()
    assert "other sign" in symfric(f"{line} --scale slide_torque=-1", 2).err
    assert "expected no --drive" in symfric(f"{line} --drive axis.toml", 2).err
