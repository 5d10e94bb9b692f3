"""`symfric run`: the same numbers as in Python, in every form of output."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robots import SMALL

from symfric import Linear, LuGre, drive, rabinowicz, simulate
from symfric.cli import main
from symfric.results import animation
from symfric.scenes import ALL_SCENES, Robot

PNG = b"\x89PNG\r\n\x1a\n"


def found(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["run", *arguments, "--json", "-"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def test_json_has_the_numbers_of_python(capsys: pytest.CaptureFixture[str]) -> None:
    result = found(capsys, "rabinowicz", "--law", "lugre")
    expected = simulate(rabinowicz(LuGre()), t_end=20.0)
    assert result["final"] == expected.final
    assert result["scene"] == "rabinowicz"
    assert result["law"] == "lugre"
    assert result["status"] == "SUCCESS"
    assert result["parameters"]["v_belt"] == 0.1
    assert result["parameters"]["sigma_0"] == 1e5
    assert result["statistics"]["steps"] == expected.statistics.steps
    assert result["t_end"] == 20.0


def test_longest_step_and_times_are_those_of_python(capsys: pytest.CaptureFixture[str]) -> None:
    told = ["--max-step", "0.01", "--times", "0.5, 1.25", "--t-end", "2"]
    result = found(capsys, "rabinowicz", "--law", "lugre", *told)
    expected = simulate(rabinowicz(LuGre()), 2.0, max_step=0.01, times=[0.5, 1.25])
    assert result["statistics"]["steps"] == expected.statistics.steps
    assert main(["run", "rabinowicz", "--law", "lugre", "--times", "1,x"]) == 2
    assert "--times: expected a finite number, got 'x'" in capsys.readouterr().err


def test_a_peer_runs_in_the_place_of_our_integrator(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["run", "rabinowicz", "--law", "viscous", "--t-end", "0.1", "--peer", "sundials"]) == 0
    )
    assert "casadi cvodes" in capsys.readouterr().out


def test_parameters_of_law_and_scene_and_start_values_are_set(
    capsys: pytest.CaptureFixture[str],
) -> None:
    line = "rabinowicz --law lugre --set mu_s=0.2 --set k=3 --x0 x=0.1 --t-end 2 --rtol 1e-8"
    result = found(capsys, *line.split())
    model = rabinowicz(LuGre(mu_s=0.2), k=3.0)
    expected = simulate(model, 2.0, x0={"x": 0.1}, rtol=1e-8)
    assert result["final"] == expected.final
    assert result["parameters"]["mu_s"] == 0.2
    assert result["parameters"]["k"] == 3.0


def test_a_constant_input_drives_the_drive(capsys: pytest.CaptureFixture[str]) -> None:
    line = "drive --law viscous --set m=2 --input force=3 --t-end 60"
    result = found(capsys, *line.split())
    assert result["inputs"] == {"force": "3"}
    assert result["final"]["v"] == pytest.approx(3 / 0.4, rel=1e-4)  # force / sigma_2


def test_the_default_input_of_the_drive_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    result = found(capsys, "drive", "--law", "lugre", "--t-end", "0.5")
    assert result["inputs"] == {"force": "2 sin(pi t)"}
    assert result["final"]["force"] == pytest.approx(2.0)


def test_a_sampled_input_is_linear_and_ends_the_simulation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "force.csv"
    path.write_text("t [s],force [N]\n0,0\n1,3\n2.5,1\n")
    result = found(capsys, "drive", "--law", "lugre", "--input", f"force={path}:force")
    force = Linear([0.0, 1.0, 2.5], [0.0, 3.0, 1.0])
    assert result["t_end"] == 2.5
    assert result["final"] == simulate(drive(LuGre()), 2.5, u={"force": force}).final


def test_csv_has_names_with_units_and_the_values(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    line = "run rabinowicz --law brown_mcphee --t-end 1 --samples 11 --out"
    assert main([*line.split(), str(path)]) == 0
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:3] == ["t [s]", "x [m]", "v [m/s]"]
    assert "friction [N]" in header
    np.testing.assert_allclose([float(row[0]) for row in rows], np.arange(11) / 10, atol=1e-15)


def test_the_table_fits_80_columns_and_files_are_named_beside_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = [str(tmp_path / name) for name in ("x.csv", "x.png", "x.json")]
    options = [
        word for pair in zip(("--out", "--plot", "--json"), paths, strict=True) for word in pair
    ]
    assert main(["run", "rabinowicz", "--law", "lugre", *options]) == 0
    out, err = capsys.readouterr()
    assert max(map(len, out.splitlines())) <= 80
    assert "friction" in out
    assert err == f"wrote {', '.join(paths)}\n"
    assert Path(paths[1]).read_bytes().startswith(PNG)
    assert json.loads(Path(paths[2]).read_text())["status"] == "SUCCESS"


def test_several_laws_share_the_parameters_they_have_and_one_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.png"
    line = "run rabinowicz --law lugre --law brown_mcphee --set v_t=2e-3 --set mu_s=0.2 --plot"
    assert main([*line.split(), str(path)]) == 0
    out = capsys.readouterr().out
    assert "rabinowicz with lugre" in out
    assert "rabinowicz with brown_mcphee" in out
    assert path.read_bytes().startswith(PNG)


def test_a_failed_solve_has_status_1_and_keeps_what_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    # an input that leaves the range of double while time goes on
    line = "run drive --law viscous --input force=f.csv:force --t-end 2 --out x.csv --json x.json"
    (tmp_path / "f.csv").write_text("t [s],force [N]\n0,0\n1,0\n1.5,1e300\n2,1e300\n")
    assert main([*line.split(), "--set", "m=1e-12"]) == 1
    err = capsys.readouterr().err.splitlines()
    assert err[0] == "wrote x.csv, x.json"
    assert err[1].startswith("symfric: ")
    assert len(err) == 2
    result = json.loads((tmp_path / "x.json").read_text())
    assert result["status"] != "SUCCESS"
    assert 1.0 <= result["t_end"] < 2.0
    assert (tmp_path / "x.csv").read_text().startswith("t [s],x [m]")


@pytest.mark.parametrize("scene", ALL_SCENES)
def test_every_scene_runs_with_its_defaults(scene: str) -> None:
    assert main(["run", scene, "--law", "coulomb+viscous"]) == 0


def test_a_law_that_may_push_is_warned_about_with_the_bound(
    capsys: pytest.CaptureFixture[str],
) -> None:
    short = ["--law", "lugre", "--t-end", "0.1"]
    assert main(["run", "rabinowicz", *short]) == 0
    assert "Warning" not in capsys.readouterr().out  # numbers that nobody chose
    assert main(["run", "rabinowicz", *short, "--set", "mu_s=0.1500001"]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "Warning: lugre: not passive from v to F: sigma_2 = 0 is below" in words
    assert "= 95" in words
    assert main(["run", "rabinowicz", "--law", "lugre_passive", "--t-end", "0.1"]) == 0
    assert "Warning" not in capsys.readouterr().out


def test_a_robot_runs_from_its_file_with_the_law_at_its_friction_tags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.urdf"
    path.write_text(SMALL)
    line = f"{path} --law lugre --x0 hinge=1.2 --t-end 0.5 --input tau_hinge=1"
    result = found(capsys, *line.split())
    model = Robot(LuGre(mu_s=1.0, mu_d=0.1 / 0.15), SMALL).model()
    assert result["final"] == simulate(model, 0.5, x0={"hinge": 1.2}, u={"tau_hinge": 1.0}).final
    assert result["scene"] == "small"
    assert (result["parameters"]["mu_s"], result["parameters"]["level"]) == (1.0, 0.0)


@pytest.mark.filterwarnings("default")
def test_what_a_robot_leaves_out_is_warned_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.urdf"
    path.write_text(SMALL.replace("</joint>", '<limit lower="0"/></joint>'))
    assert main(["run", str(path), "--law", "viscous", "--t-end", "0.1"]) == 0
    err = capsys.readouterr().err
    assert err == "symfric: warning: urdf 'small': left out: <limit> of joint 'hinge'\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "arm.urdf': expected a file, got nothing there"),
        ("<robot>", "expected XML, got no element found"),
        (SMALL.replace("0 1 0", "0 1"), "urdf 'small' > joint 'hinge' > axis: expected 3 numbers"),
    ],
)
def test_a_bad_robot_file_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None, message: str
) -> None:
    path = tmp_path / "arm.urdf"
    if text is not None:
        path.write_text(text)
    assert main(["run", str(path), "--law", "lugre"]) == 2
    err = capsys.readouterr().err
    assert message in err
    assert len(err.splitlines()) == 1


def test_a_mechanism_is_told_short_with_its_books(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "four_mass", "--law", "brown_mcphee", "--t-end", "0.5"]) == 0
    out = capsys.readouterr().out
    rows = [line.split()[0] for line in out.splitlines()[3:] if line]
    assert {"x1", "x1_rate", "x1_N", "x1_friction", "energy"} <= set(rows)
    assert not {"x1_slip", "x1_power", "rod_12_lambda", "constraint_position"} & set(rows)
    assert "Largest constraint violations: position " in out
    assert "J, friction -" in out
    assert "unexplained at most" in out
    assert max(map(len, out.splitlines())) <= 80


def test_the_books_of_a_mechanism_are_in_the_json(capsys: pytest.CaptureFixture[str]) -> None:
    line = "four_mass --law brown_mcphee --t-end 0.5 --rtol 1e-8"
    result = found(capsys, *line.split())
    balance = result["energy_balance"]
    gained = balance["end"] - balance["start"]
    assert gained == pytest.approx(balance["work"]["friction"], rel=1e-6)
    assert 0 < balance["relative"] < 1e-7
    assert max(result["constraints"].values()) < 1e-11
    assert result["final"]["energy"] == pytest.approx(balance["end"])
    line = "drive --law lugre --t-end 0.1"
    assert "energy_balance" not in found(capsys, *line.split())


def test_a_film_is_written_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(animation, "SHOWN", 0.2)
    path = tmp_path / "motion.gif"
    line = "run pendulum --law brown_mcphee --t-end 0.2 --animate"
    assert main([*line.split(), str(path)]) == 0
    assert path.read_bytes().startswith(b"GIF89a")
    assert capsys.readouterr().err == f"wrote {path}\n"


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("pendulum --law lugre --animate x.avi", "ending in .gif, .html, .mp4, got '.avi'"),
        ("pendulum --law coulomb --law viscous --animate x.gif", "expected one --law, got 2"),
    ],
)
def test_a_film_that_cannot_be_is_refused_at_once(
    line: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(["run", *line.split()]) == 2
    assert why in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
