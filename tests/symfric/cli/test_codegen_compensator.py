"""`symfric codegen --compensator`."""

import json
import shutil
from pathlib import Path

import pytest

from identification import Fit, InverseDynamics, synthetic_drive_data
from symfric import Coulomb, Sum, Viscous
from symfric.cli import main

compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


def described(folder: Path) -> dict[str, object]:
    return json.loads((folder / "friction_compensator_manifest.json").read_text())


@compiled
def test_a_law_becomes_a_compensator_with_its_settings(tmp_path: Path) -> None:
    line = f"codegen --law lugre --compensator --out {tmp_path} --real double --no-kit"
    line += " --set mu_d=0.12 --compensation v_blend=0.02 --compensation error_gain=20"
    line += " --compensation scales=coulomb:0.9 --compensation without=stribeck,viscous"
    assert main(line.split()) == 0
    starts = {p["name"]: p["default"] for p in described(tmp_path)["parameters"]}
    assert starts["mu_d"] == 0.12
    assert (starts["v_blend"], starts["k_error"], starts["scale_coulomb"]) == (0.02, 20.0, 0.9)
    assert "scale_stribeck" not in starts
    assert [v["name"] for v in described(tmp_path)["inputs"]] == ["v_ref", "e", "v", "enable"]


@compiled
def test_fold_bakes_all_in(tmp_path: Path) -> None:
    line = f"codegen --law stribeck --compensator --fold --out {tmp_path} --real double --no-kit"
    assert main(f"{line} --step-size 0.001".split()) == 0
    assert described(tmp_path)["parameters"] == []
    assert described(tmp_path)["constants"]["v_blend"] == 0.01


@compiled
@pytest.mark.heavy
def test_a_fit_brings_its_drive(tmp_path: Path) -> None:
    data = synthetic_drive_data(Sum((Coulomb(20.0), Viscous(160.0))), speeds=(0.05, 0.1))
    fit = Fit(InverseDynamics(), "coulomb+viscous", data, starts=1).solve(throw=False)
    fit.to_json(tmp_path / "fit.json")
    line = f"codegen {tmp_path / 'fit.json'} --compensator --out {tmp_path / 'c'} --no-kit"
    assert main(line.split()) == 0
    starts = {p["name"]: p["default"] for p in described(tmp_path / "c")["parameters"]}
    drive = fit.drive
    assert drive is not None
    assert starts["N"] == drive.N
    assert starts["offset"] == pytest.approx(drive.offset) == pytest.approx(-3.0, abs=0.2)
    assert starts["mu_d"] == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--law lugre --compensation v_blend=1", "--compensation: expected with --compensator"),
        ("--law lugre --compensator --free mu_s", "--free: expected with a law or --scene only"),
        ("--law lugre --compensator --scene drive", "expected with a law or a fit, got --scene"),
        ("--law lugre --compensator --compensation vblend=1", "did you mean v_blend?"),
        ("--law random_bristles --compensator", "expected a law, got a population"),
    ],
)
def test_what_does_not_apply_is_refused(
    options: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*f"codegen {options} --out {tmp_path / 'c'}".split()]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "c").exists()
