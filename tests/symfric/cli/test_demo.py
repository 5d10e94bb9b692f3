"""`symfric demo`: everything is left behind and listed."""

import json
import re
from math import hypot
from pathlib import Path
from typing import Any

import pytest

from symfric.cli import main
from symfric.cli.demo import identified, load_records, numbers_of

EMPS = Path(__file__).parents[4] / "shared" / "data" / "EMPS"


def check_folder(out: Path) -> None:
    """Every file is listed, every listed file is there, every picture is one."""
    listed = set(re.findall(r"\]\(([^)]+)\)", (out / "README.md").read_text()))
    present = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert present == listed | {"README.md", "summary.json"}
    pictures = [out / name for name in present if name.endswith(".png")]
    assert len(pictures) >= 4
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)


def test_without_data_it_simulates_its_own_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["demo"]) == 0
    out, err = capsys.readouterr()
    assert "a simulated record (no measured one found" in err
    assert max(map(len, out.splitlines())) <= 80
    check_folder(tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    identified = summary["Identification of a positioning drive"]["stribeck"]["parameters"]
    # the record was made with 28 N static, 20 N dynamic friction and 95 kg
    assert identified["mu_s"]["value"] == pytest.approx(28.0, rel=0.01)
    assert identified["mu_d"]["value"] == pytest.approx(20.0, rel=0.01)
    assert identified["m"]["value"] == pytest.approx(95.0, rel=0.01)
    moves = summary["Optimal moves of the identified drive"]
    assert {move["status"] for move in moves.values()} == {"SOLVED"}
    assert all(move["miss"] < 1e-3 for move in moves.values())
    assert moves["minimum time"]["T"] < moves["minimum effort"]["T"]


@pytest.mark.slow
@pytest.mark.skipif(not EMPS.is_dir(), reason="needs the EMPS benchmark in ../shared/data")
def test_with_data_it_identifies_the_measured_stage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--out", str(tmp_path / "o"), "--data", str(EMPS)]) == 0
    assert f"the measured EMPS stage in {EMPS}" in capsys.readouterr().err
    check_folder(tmp_path / "o")
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    found = summary["Identification of a positioning drive"]["coulomb+viscous"]["parameters"]
    as_published(found)


@pytest.mark.skipif(not EMPS.is_dir(), reason="needs the EMPS benchmark in ../shared/data")
def test_the_measured_stage_has_its_published_parameters() -> None:
    records, laws, origin = load_records(EMPS)
    assert origin == f"the measured EMPS stage in {EMPS}"
    assert laws == ("coulomb+viscous", "asymmetric(coulomb+viscous)")
    as_published(numbers_of(identified(records, laws[0]))["parameters"])


def as_published(found: dict[str, Any]) -> None:
    # published least squares: value and standard error as if residuals were white, which they are
    # not: ours is twice that
    published = {"m": (95.1089, 0.109), "mu_d": (20.3935, 0.101), "sigma_2": (203.5034, 1.146)}
    for name, (value, error) in published.items():
        ours = found[name]
        assert abs(ours["value"] - value) < 3 * hypot(error, ours["standard_error"])
