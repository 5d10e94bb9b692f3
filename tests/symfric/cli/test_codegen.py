"""`symfric codegen`."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from robots import SMALL

from symfric.cli import main
from symfric.cli.codegen import bits, compared, show_verification
from symfric.codegen.verification import Check, Verification

compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


@compiled
def test_files_are_written_and_proved_equal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["codegen", "--law", "lugre", "--out", str(tmp_path / "c"), "--json", "-"]) == 0
    result = json.loads(capsys.readouterr().out)
    names = {Path(file).name for file in result["files"]}
    assert names == {path.name for path in (tmp_path / "c").iterdir()}
    assert {"lugre_f64.c", "lugre_f64.h", "lugre_f32.c", "lugre_f32.h"} < names
    double, single = result["verification"]["checks"]
    assert (double["real"], double["ulp"], double["warnings"]) == ("double", 0, [])
    assert single["real"] == "float"
    assert result["verification"]["ok"]


@compiled
def test_the_table_shows_every_type(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    line = f"codegen --law coulomb+viscous --out {tmp_path} --real double --name stage"
    assert main(line.split()) == 0
    out, err = capsys.readouterr()
    assert max(map(len, err.splitlines()[1:])) <= 80
    assert "stage: verified" in out
    assert "bit for bit equal" in out
    assert "float " not in out
    assert max(map(len, out.splitlines())) <= 80


@compiled
def test_a_law_with_forms_has_the_one_that_is_set(tmp_path: Path) -> None:
    line = f"codegen --law gms --set form=event --set mu_s=0.2 --out {tmp_path} --real double"
    assert main(line.split()) == 0
    header = (tmp_path / "gms_f64.h").read_text()
    assert "default 0.2" in header


def test_a_float_that_differs_is_not_called_within_rounding() -> None:
    alike = Check("float", 1, (), None, 1e-7, (), worst="F", rounding=1e-7)
    assert compared(alike) == "within rounding"
    assert compared(replace(alike, error=1e-2)) == "differs"
    assert compared(replace(alike, ulp=0, error=0.0)) == "bit for bit equal"


def test_set_parameters_and_a_fixed_step_become_constants(tmp_path: Path) -> None:
    line = f"codegen --law dahl --out {tmp_path} --set sigma_0=12345 --step-size 0.002"
    assert main(f"{line} --free mu_d --real double".split()) == 0
    manifest = json.loads((tmp_path / "dahl_manifest.json").read_text())
    assert [p["name"] for p in manifest["parameters"]] == ["mu_d"]
    assert manifest["constants"]["sigma_0"] == 12345.0


def test_without_a_compiler_the_files_are_written_and_the_status_says_not_verified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    assert main(["codegen", "--law", "viscous", "--out", str(tmp_path / "c")]) == 1
    assert "no C compiler found" in capsys.readouterr().out
    assert (tmp_path / "c" / "viscous_f64.c").is_file()


@pytest.mark.parametrize(
    ("ulp", "words"), [(None, "within rounding"), (0, "bit for bit equal"), (3, "3 ulp apart")]
)
def test_distance_in_words(ulp: int | None, words: str) -> None:
    assert bits(ulp) == words


@compiled
def test_what_a_plant_is_made_of_is_set_beside_its_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = f"codegen --scene drive --law stribeck --no-kit --out {tmp_path} --set m=2"
    assert main([*line.split(), "--set", "turning=true"]) == 0
    assert "moving mass [kg m^2]" in (tmp_path / "drive_f64.h").read_text()
    assert main([*line.split(), "--set", "turning=yes"]) == 2
    assert "--set turning: expected one of true, false" in capsys.readouterr().err


def test_scene_becomes_a_plant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = f"codegen --scene rabinowicz --law lugre --set k=3 --out {tmp_path} --free mu_s"
    assert main(f"{line} --step-size 1e-3 --method backward_euler --json -".split()) == 0
    result = json.loads(capsys.readouterr().out)
    manifest = result["manifest"]
    assert [state["name"] for state in manifest["states"]] == ["x", "v", "z"]
    assert [p["name"] for p in manifest["parameters"]] == ["mu_s"]
    assert (manifest["constants"]["k"], manifest["constants"]["h"]) == (3.0, 1e-3)
    (check,) = result["verification"]["checks"]
    assert (check["real"], check["ulp"]) == ("double", 0)
    assert "backward Euler" in (tmp_path / "rabinowicz_f64.h").read_text()


def test_all_parameters_of_a_plant_are_variable_by_default_and_none_when_folded(
    tmp_path: Path,
) -> None:
    line = f"codegen --scene drive --law brown_mcphee --no-kit --out {tmp_path} --step-size 1e-3"
    assert main(line.split()) == 0
    manifest = json.loads((tmp_path / "drive_manifest.json").read_text())
    assert [p["name"] for p in manifest["parameters"]] == [
        "m",
        "N",
        "offset",
        "mu_s",
        "mu_d",
        "v_t",
    ]
    assert manifest["constants"] == {"mu_v": 0.0, "h": 1e-3}
    assert main([*line.split(), "--fold"]) == 0
    manifest = json.loads((tmp_path / "drive_manifest.json").read_text())
    assert manifest["parameters"] == []
    assert manifest["constants"]["m"] == 0.8


def test_guards_and_kit_are_left_out_on_request(tmp_path: Path) -> None:
    line = f"codegen --law coulomb --real float --no-guards --no-kit --out {tmp_path}"
    assert main(line.split()) == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"coulomb_f32.c", "coulomb_f32.h", "coulomb_manifest.json"}
    assert "status" not in (tmp_path / "coulomb_f32.h").read_text()


@pytest.mark.parametrize(
    ("options", "messages"),
    [
        (
            "--law lugre --method rodas3 --payload tool",
            ["--method: expected", "--payload: expected"],
        ),
        ("--law lugre --fold --free mu_s", ["--free, --fold: expected one of them, got both"]),
        ("--law coulomb --step-size 1e-3", ["--step-size: expected", "got a law without states"]),
        ("--law coulomb --step-size 1e-3 --method rodas3", ["--step-size: ", "--method: "]),
        ("--law random_bristles --fold --turning", ["--fold: ", "--turning: ", "a population"]),
        ("--law lugre --scene drive --turning", ["--turning: ", "got --scene, which defines"]),
        ("--law lugre --core m9", ["--core: expected one of m0plus, m3, m4f, m7, got m9"]),
        ("robot.urdf --inverse-dynamics --free a --fold", ["--free: ", "--fold: ", "one of them"]),
    ],
)
def test_options_that_do_not_apply_are_refused_all_at_once(
    options: str, messages: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(f"codegen {options} --out {tmp_path / 'c'}".split()) == 2
    error = capsys.readouterr().err
    assert all(message in error for message in messages)
    assert error.count("\n") == 1
    assert not (tmp_path / "c").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--method rodas3", "--method: expected with --scene only"),
        ("--scene belt", "--scene: expected one of rabinowicz, drive"),
        ("--scene drive --method euler", "expected one of auto, rodas5p"),
        ("--scene drive --set v_belt=1", "v_belt"),
    ],
)
def test_bad_plants_are_refused_in_one_sentence(
    options: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(f"codegen --law lugre --out {tmp_path} {options}".split()) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


def test_robot_of_a_file_is_a_plant(tmp_path: Path) -> None:
    path = tmp_path / "small.urdf"
    path.write_text(SMALL)
    line = f"codegen --scene {path} --law lugre --out {tmp_path} --step-size 0.001"
    assert main(line.split()) == 0
    assert "tau_hinge" in (tmp_path / "small_f64.h").read_text()


@compiled
def test_a_step_that_is_too_long_is_named_with_one_that_is_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = f"codegen --scene rabinowicz --law lugre --method dopri5 --out {tmp_path}"
    assert main(f"{line} --step-size 0.05 --json -".split()) == 1
    status = json.loads(capsys.readouterr().out)["verification"]["status"]
    assert "steps of 0.05 s it runs away, in CasADi as in C: that step is too long, 0.0" in status
    shorter = status.rsplit(", ", 1)[1].split()[0]
    assert main(f"{line} --step-size {shorter}".split()) == 0


def test_ties_are_told_where_there_are_some(capsys):
    checks = (
        Check("double", 28000, (), 0, 0.0, ()),
        Check("float", 28000, (), None, 0.0, (), ties=3),
    )
    show_verification(Verification("springs", "verified", "gcc", checks))
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("rounding decides") == 1
    assert "float: in 3 of 28000 steps rounding decides a mode, in CasADi as in C" in said
