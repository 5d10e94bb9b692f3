"""`symfric codegen ROBOT.urdf --inverse-dynamics`."""

import json
import shutil
from pathlib import Path

import pytest
from robots import SMALL

from symfric.cli import main

compiled = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "small.urdf"
    path.write_text(SMALL, encoding="utf-8")
    return path


@compiled
def test_a_robot_becomes_one_function_with_a_payload(robot, tmp_path, capsys):
    out = tmp_path / "c"
    line = [
        "codegen",
        str(robot),
        "--inverse-dynamics",
        "--payload",
        "arm",
        "--no-kit",
        "--out",
        str(out),
    ]
    assert main([*line, "--json", "-"]) == 0
    manifest = json.loads(capsys.readouterr().out)["manifest"]
    assert [v["name"] for v in manifest["inputs"]] == ["q_1", "qd_1", "qdd_1"]
    names = [v["name"] for v in manifest["parameters"]]
    assert names[0] == "payload_m"
    assert {"payload_c_3", "payload_J_6", "N_1", "sigma_2_1"} < set(names)
    assert "float small_f32" in (out / "small_f32.h").read_text(encoding="utf-8")


@compiled
@pytest.mark.heavy
def test_a_scene_has_the_law_that_is_asked_for(tmp_path, capsys):
    line = f"codegen --scene pendulum --law lugre --inverse-dynamics --out {tmp_path / 'c'}"
    assert main(line.split()) == 0
    assert "verified" in capsys.readouterr().out


@compiled
def test_friction_is_baked_in(robot, tmp_path, capsys):
    line = f"codegen {robot} --inverse-dynamics --fold --no-kit --out {tmp_path / 'c'} --json -"
    assert main(line.split()) == 0
    assert json.loads(capsys.readouterr().out)["manifest"]["parameters"] == []


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--inverse-dynamics --law lugre", "FILE.urdf or --scene NAME, got neither"),
        ("{robot} --scene arm --inverse-dynamics", "got both"),
        ("fit.json --inverse-dynamics", "expected a robot's FILE.urdf, got 'fit.json'"),
        ("--scene arm --inverse-dynamics", "expected --law NAME with --scene arm"),
        ("--scene rabinowicz --law lugre --inverse-dynamics", "a scene of bodies and joints"),
        ("--scene four_bar --law lugre --inverse-dynamics", "loops that close in"),
        ("{robot} --inverse-dynamics --payload hand", "a body or a frame, got 'hand'"),
        ("{robot} --inverse-dynamics --turning", "--turning: expected with a law"),
        ("{robot} --inverse-dynamics --set g=1", "--set: expected with --law only"),
        ("--law lugre --payload hand", "expected with --inverse-dynamics only"),
    ],
)
def test_what_does_not_fit_is_refused(line, said, robot, tmp_path, capsys):
    command = ["codegen", *line.format(robot=robot).split(), "--out", str(tmp_path / "c")]
    assert main(command) != 0
    assert said in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "c").exists()
