"""`symfric run` and `report`: the same numbers as in Python, in every form of output.

`symfric scenes`: the list, and one scene in full.
"""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robots import SMALL
from tables import sampled

from symfric import Linear, LuGre, drive, parameters, rabinowicz, simulate
from symfric.cli import scenes as command
from symfric.cli.machines import input_from_text
from symfric.laws import ALL_LAWS
from symfric.results import animation
from symfric.scenes import ALL_SCENES, PendulumBox, Robot

PNG = b"\x89PNG\r\n\x1a\n"
RABINOWICZ = "run rabinowicz --law lugre --t-end 2"
CASES = {
    RABINOWICZ: lambda: simulate(rabinowicz(LuGre()), 2.0),
    f"{RABINOWICZ} --max-step 0.01 --times '0.5, 1.25'": lambda: simulate(
        rabinowicz(LuGre()), 2.0, max_step=0.01, times=[0.5, 1.25]
    ),
    f"{RABINOWICZ} --set mu_s=0.2 --set k=3 --x0 x=0.1 --rtol 1e-8 --method radau5": lambda: (
        simulate(
            rabinowicz(LuGre(mu_s=0.2), k=3.0), 2.0, x0={"x": 0.1}, rtol=1e-8, method="radau5"
        )
    ),
    "run drive --law lugre --input force=f.csv:force": lambda: simulate(
        drive(LuGre()), 2.5, u={"force": Linear([0.0, 1.0, 2.5], [0.0, 3.0, 1.0])}
    ),
    "run small.urdf --law lugre --x0 hinge=1.2 --t-end 0.5 --input tau_hinge=1": lambda: simulate(
        Robot(LuGre(mu_s=1.0, mu_d=0.1 / 0.15), SMALL).model(), 0.5,
        x0={"hinge": 1.2}, u={"tau_hinge": 1.0},
    ),
}  # fmt: skip


MACHINES = """
import casadi as ca
from symfric import LuGre, Model, Variable, contact
from symfric.scenes import Rabinowicz
def sled(law, m=2.0, pull=0.02):
    s, v, u = Variable("s", "m"), Variable("v", "m/s"), Variable("u", "m/s", start=pull)
    slip = contact("ground", law, v, m * 9.81)
    rates = ca.vertcat(u - v, (50 * s - slip.force) / m)
    return Model("sled", x=(s, v), u=(u,), ode=rates, contacts=(slip,))
def number(law):
    return 3
Belt = Rabinowicz
model = sled(LuGre())
"""
OF_FILE = {
    "run m.py:sled --law lugre --t-end 3 --set m=3 --set mu_s=0.3 --input u=0.02 --json -": "sled",
    "run m.py:Belt --law lugre --set k=5 --t-end 3 --json -": "rabinowicz",
    "run m.py:sled --law lugre --t-end 3 --plot a.png": "sled with lugre, 0 ... 3 s",
    "report m.py:sled --law lugre,viscous --t-end 1 --input u=0.02": "wrote report.html",
    "scenes m.py:sled --law lugre": "bristle stiffness",
    "export-fmu m.py:sled --law lugre --set m=3 --out s.fmu": "wrote s.fmu",
    "codegen --scene m.py:sled --law stribeck --step-size 1e-3 --out c": "sled_f64.c",
    "select m.py:sled --law stribeck,coulomb --no-fixed-steps --t-end 1": "stribeck",
    "analyse m.py:sled --law viscous --over u=0.01:0.1 --from equilibrium": "to 0.1",
}
REFUSED = {
    "run m.py:sled --law lugre": "--t-end: expected the end time",
    "run m.py:number --law lugre --t-end 1": "'m.py:number': expected a model",
    "run m.py:model --law lugre --t-end 1": "expected a function law -> Model",
    "run m.py:none --law lugre --t-end 1": "it holds sled, number",
    "run m.py:sled --law lugre --t-end 1 --set q=1": "v_eps, m, pull, got q",
    "run m.py:sled --law lugre --t-end 1 --preset haug": "--preset of m.py:sled",
    "run m.py:sled --law lugre --t-end 1 --law-of hinge=dahl": "--law-of of m.py:sled",
    "select m.py:sled --law lugre,stribeck": "the end of the motion",
    "analyse m.py:sled --law lugre --over m=1:3": "a parameter p of the model",
}


@pytest.mark.parametrize("line", OF_FILE)
def test_a_machine_of_a_file_is_a_scene(line: str, symfric) -> None:
    Path("m.py").write_text(MACHINES)
    said = symfric(line)
    assert OF_FILE[line] in said.out + said.err
    if "--set m=3" in line and "--json" in line:
        found, law = said.json, LuGre(mu_s=0.3)
        space: dict[str, Any] = {}
        exec(MACHINES, space)
        expected = simulate(space["sled"](law, m=3.0), 3.0, u={"u": 0.02})
        assert found["final"] == expected.final
        assert (found["parameters"]["m"], found["parameters"]["mu_s"]) == (3.0, 0.3)


def test_machines_of_a_file_that_are_none_are_refused(symfric) -> None:
    Path("m.py").write_text(MACHINES)
    for line, text in REFUSED.items():
        assert text in " ".join(symfric(line, 2).err.split()), line


@pytest.mark.parametrize("line", CASES)
def test_json_has_the_numbers_of_python(line: str, symfric) -> None:
    Path("f.csv").write_text("t [s],force [N]\n0,0\n1,3\n2.5,1\n")
    Path("small.urdf").write_text(SMALL)
    found, expected = symfric(f"{line} --json -").json, CASES[line]()
    assert found["final"] == expected.final
    assert found["extremes"] == {n: list(pair) for n, pair in expected.extremes.items()}
    assert found["statistics"]["steps"] == expected.statistics.steps
    assert (found["status"], found["t_end"]) == ("SUCCESS", expected.t[-1])
    assert (found["law"], found["scene"]) == ("lugre", expected.scene)


def test_parameters_and_inputs_are_named_in_the_json(symfric) -> None:
    found = symfric(f"{RABINOWICZ} --set mu_s=0.2 --json -").json
    held = parameters(LuGre(mu_s=0.2))
    assert {n: found["parameters"][n] for n in held} == {n: p.value for n, p in held.items()}
    assert found["parameters"]["v_belt"] == 0.1
    line = "run drive --law viscous --set m=2 --t-end 60 --json - --input"
    found = symfric(f"{line} force=3").json
    assert found["inputs"] == {"force": "3"}
    assert found["final"]["v"] == pytest.approx(3 / 0.4, rel=1e-4)  # force / sigma_2
    found = symfric("run drive --law lugre --t-end 0.5 --json -").json
    assert found["inputs"] == {"force": "2 sin(pi t)"}
    assert found["final"]["force"] == pytest.approx(2.0)
    Path("f.csv").write_text("t [s],x [m]\n0,0.25\n1,3\n")
    found = symfric("run prescribed --law viscous --input x=f.csv:x --json -").json
    assert found["final"]["x"] == pytest.approx(3.0)
    assert found["final"]["v"] == pytest.approx(2.75)


def test_files_and_the_table(symfric) -> None:
    printed = symfric(f"{RABINOWICZ} --samples 11 --out x.csv --plot x.png --json x.json")
    assert printed.err == "wrote x.csv, x.png, x.json\n"
    assert "friction" in printed.out
    assert Path("x.png").read_bytes().startswith(PNG)
    assert json.loads(Path("x.json").read_text())["status"] == "SUCCESS"
    with Path("x.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:3] == ["t [s]", "x [m]", "v [m/s]"]
    assert "friction [N]" in header
    np.testing.assert_allclose([float(row[0]) for row in rows], np.arange(11) / 5, atol=1e-15)


def test_a_failed_solve_has_status_1_and_keeps_the_results_so_far(symfric) -> None:
    # an input that leaves the range of double while time goes on
    Path("f.csv").write_text("t [s],force [N]\n0,0\n1,0\n1.5,1e300\n2,1e300\n")
    line = "run drive --law viscous --input force=f.csv:force --t-end 2 --set m=1e-12"
    printed = symfric(f"{line} --out x.csv --json x.json", 1)
    assert "see the last line for the reason" in printed.out
    written, reason = printed.err.splitlines()
    assert written == "wrote x.csv, x.json"
    assert reason.startswith("symfric: ")
    result = json.loads(Path("x.json").read_text())
    assert result["status"] != "SUCCESS"
    assert 1.0 <= result["t_end"] < 2.0
    assert Path("x.csv").read_text().startswith("t [s],x [m]")


def test_warnings_of_a_law_concern_numbers_that_were_changed(symfric) -> None:
    short = "run rabinowicz --t-end 0.1 --backend vm --law"
    assert "Warning" not in symfric(f"{short} lugre").out
    words = " ".join(symfric(f"{short} lugre --set mu_s=0.1500001").out.split())
    assert "Warning: lugre: not passive from v to F: sigma_2 = 0 is below" in words
    assert "= 95" in words
    assert "Warning" not in symfric(f"{short} lugre_passive").out


@pytest.mark.filterwarnings("default")
def test_ignored_parts_of_a_robot_are_warned_about(symfric) -> None:
    Path("small.urdf").write_text(SMALL.replace("</joint>", '<limit effort="0"/></joint>'))
    printed = symfric("run small.urdf --law viscous --t-end 0.1 --backend vm")
    said = "left out: <limit effort=\"0\"> of joint 'hinge'"
    assert printed.err == f"symfric: warning: urdf 'small': {said}\n"


@pytest.mark.filterwarnings("default")
def test_a_robot_without_friction_says_what_to_add_and_does_so(symfric) -> None:
    Path("bare.urdf").write_text(SMALL.replace(' friction="0.2"', ""))
    line = "run bare.urdf --law lugre --t-end 0.1 --backend vm"
    printed = symfric(f"{line} --plot a.png")
    assert printed.err.count("\n") == 2
    assert "LuGre has no effect, because no joint has <dynamics friction" in printed.err
    assert "small with Viscous, 0" in printed.out
    printed = symfric(f"{line} --friction-level 0.5 --json a.json")
    assert "warning" not in printed.err
    result = json.loads(Path("a.json").read_text())
    assert (result["parameters"]["level"], result["final"]["hinge_N"]) == (0.5, 0.5)


def test_a_mechanism_shows_its_main_signals_constraints_and_energy(symfric) -> None:
    line = "run slider_crank --law brown_mcphee --t-end 0.2 --rtol 1e-8 --backend vm"
    printed = symfric(f"{line} --json x.json")
    rows = [row.split()[0] for row in printed.out.splitlines()[3:] if row]
    assert {"crank", "crank_rate", "energy"} <= set(rows)
    assert not {"constraint_position", "crank_power"} & set(rows)
    assert "Largest constraint violations: position " in printed.out
    assert "J, friction -" in printed.out
    assert "unexplained at most" in printed.out
    result = json.loads(Path("x.json").read_text())
    balance = result["energy_balance"]
    assert 0 < balance["relative"] < 1e-6
    assert max(result["constraints"].values()) < 1e-10
    assert result["final"]["energy"] == pytest.approx(balance["end"])
    assert "energy_balance" not in symfric("run drive --law lugre --t-end 0.1 --json -").json


def test_reports_and_animations_are_written_and_named(symfric, monkeypatch) -> None:
    kept = "--html=bericht ä.html".encode().decode("ascii", errors="surrogateescape")
    monkeypatch.setattr("sys.argv", ["symfric", "report", kept])
    printed = symfric("report drive --law viscous --t-end 0.2 --html r.html")
    assert printed.err == "wrote r.html\n"
    page = Path("r.html").read_text(encoding="utf-8")
    assert "bericht ä.html" in page
    assert "viscous" in page
    monkeypatch.setattr(animation, "SHOWN", 0.1)
    line = "run pendulum --law viscous --t-end 0.1 --backend vm --samples 21 --animate x.gif"
    assert symfric(line).err == "wrote x.gif\n"
    assert Path("x.gif").read_bytes().startswith(b"GIF89a")


HEADERS = {
    "t [ms];u [kN];torque [mN m]\n0;1;2000\n500;2;4000\n": {
        ("u", "N"): ([0, 0.5], [1000, 2000]),
        ("torque", "N m"): ([0, 0.5], [2, 4]),
    },
    "t [s],x [m],force [N]\n0,9,1\n0.5,9,2\n\n2,9,-4\n": {
        ("force", "N"): ([0, 0.5, 2], [1, 2, -4]),
        ("force [N]", "N"): ([0, 0.5, 2], [1, 2, -4]),
    },
    "# both forces\ntime F[kN] F[N]\n0 1 2\n1 3 4\n": {
        ("F [N]", "N"): ([0, 1], [2, 4]),
        ("F [kN]", "N"): ([0, 1], [1000, 3000]),
    },
}


def test_columns_of_a_file_are_inputs_in_si_units(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"
    for text, columns in HEADERS.items():
        path.write_text(text, encoding="utf-8")
        for (column, unit), (times, values) in columns.items():
            samples = input_from_text("force", f"{path}:{column}", unit)
            assert isinstance(samples, Linear)
            np.testing.assert_allclose(samples.t, times)
            np.testing.assert_allclose(samples.values, values)
    assert input_from_text("force", "-2.5", "N") == -2.5


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("", ["expected rows of numbers, got an empty file"]),
        ("1,2\n3,4\n", ["'t [s]', got no header; check", "'F [N]', got no header; check"]),
        ("F,t [J]\n1,2\n", ["column 't [J]': expected a unit of s, ms, us, min in br"]),
        ("F [m],t\n1,2\n", ["column 'F [m]': expected a unit of N, mN, kN, N m"]),
        ("F,F,t\n1,2,3\n", ["expected one column 'F [N]', got F, F; check the header"]),
        ("x,s\n1,2\n", ["'t [s]', got x, s; check", "'F [N]', got x, s; check the header"]),
        ("F,t [s]\n1,2\n1,2,5,3\n", ["row 3: expected 2 cells as in the header, got 4; write n"]),
        ("F,t [s]\n1,\n", ["column 't [s]', row 2: expected a number, got ''"]),
        ("F,t\n1,2\n3,1\n", ["t: expected increasing"]),
    ],
)
def test_what_is_no_input_is_refused_with_its_place(
    tmp_path: Path, text: str, messages: list[str]
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError) as caught:
        input_from_text("force", f"{path}:F", "N")
    for message, line in zip(messages, str(caught.value).splitlines(), strict=True):
        assert line.startswith("read 'a.csv': ")
        assert message in line
    for place, got in ((tmp_path, "a folder"), (tmp_path / "none.csv", "nothing there")):
        with pytest.raises(ValueError, match=f"expected a file, got {got}"):
            input_from_text("force", f"{place}:F", "N")


def test_all_scenes_are_listed(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    listed = {row["name"]: row for row in symfric("scenes --json -").json["scenes"]}
    assert list(listed) == [*ALL_SCENES]
    assert listed["nip"]["inputs"] == ["v_set", "load"]
    assert listed["drill_string"]["states"] == 9
    assert listed["coupled_blocks"]["contacts"] == ["block_1", "block_2"]
    few = {name: ALL_SCENES[name] for name in ("rabinowicz", "drive")}
    monkeypatch.setattr(command, "ALL_SCENES", few)
    out = symfric("scenes").out
    for name, kind in few.items():
        assert f"\n{name} " in f"\n{out}"
        assert all(preset in out for preset in kind.presets)


@pytest.mark.parametrize("name", sampled(ALL_SCENES, of=3))
def test_a_scene_shows_all_that_it_accepts_and_computes(name: str, symfric) -> None:
    out = symfric(f"scenes {name}").out
    kind, scene = ALL_SCENES[name], ALL_SCENES[name](ALL_LAWS["viscous"]())
    words, model = " ".join(out.split()), scene.model()
    for variable in (*model.x, *model.u):
        assert f"\n{variable.name} " in out
    for parameter in set(parameters(scene)) - {"sigma_2"}:
        assert f"\n{parameter} " in out
    for given in kind.inputs.values():
        assert given.text in words
    for group in (kind.places(), kind.presets, kind.structures(), model.outputs):
        assert all(f"\n{one} " in out for one in group)
    assert f"Default end time: {kind.t_end:g} s." in words
    assert f"In Python: from symfric.scenes import {kind.__name__}\n" in out
    if name == "drill_string":
        assert "\nJ_bit       471.9698   kg m^2" in out  # to the last digit
    for state, rate in kind.integrals.items():
        assert f"--input {state}=FILE.csv:COLUMN gives {rate} as the rate of {state}." in words


def test_a_law_and_a_preset_show_the_numbers_that_run_takes(symfric) -> None:
    line = "scenes pendulum_box --law lugre --preset jing_mi_table_7 --set mu_s_2=0.004 --json -"
    result = symfric(line).json
    expected = parameters(PendulumBox.preset("jing_mi_table_7", ALL_LAWS["lugre"]()))
    values = {p["name"]: p["value"] for p in result["parameters"]}
    assert values == {n: p.value for n, p in expected.items()} | {"mu_s_2": 0.004}
    assert [v["name"] for v in result["states"]][-2:] == ["x_z", "phi_z"]
    assert result["states"][-1]["start"] is None
    assert "of the law" in symfric("scenes pendulum_box --law lugre").out
    result = symfric("scenes pendulum_box --json -").json
    assert {p["name"] for p in result["parameters"]} == {"m_box", "m", "L", "J", "R", "phi_0", "g"}
    assert (result["law"], result["python"]) == (None, "PendulumBox")


def test_a_robot_shows_its_joints_and_inputs(symfric) -> None:
    Path("small.urdf").write_text(SMALL)
    result = symfric("scenes small.urdf --json -").json
    assert [v["name"] for v in result["states"]] == ["hinge", "hinge_rate"]
    assert [(u["name"], u["unit"]) for u in result["inputs"]] == [("tau_hinge", "N m")]
    assert result["python"] is None


def test_a_picture_shows_a_run(symfric) -> None:
    assert "wrote clutch.png" in symfric("scenes clutch --plot clutch.png").err
    assert Path("clutch.png").read_bytes().startswith(b"\x89PNG")


def test_forms_and_structure_are_set_like_numbers(symfric) -> None:
    def found(line: str, part: str) -> list[dict[str, str]]:
        return symfric(f"scenes {line} --json -").json[part]

    assert len(found("drill_string --set lumps=2", "states")) == 5
    assert found("drive --set turning=true", "inputs")[0]["unit"] == "N m"
    inputs = found("prescribed --set load=input", "inputs")
    assert [u["name"] for u in inputs] == ["v", "load"]
    events = found("rabinowicz --law karnopp --set form=event", "states")
    assert [v["name"] for v in events] == ["x", "v", "mode", "leaving"]
    assert found("drill_string", "forms")["lumps"] == {
        "value": "4", "choices": "a count", "doc": found("drill_string", "forms")["lumps"]["doc"],
    }  # fmt: skip
