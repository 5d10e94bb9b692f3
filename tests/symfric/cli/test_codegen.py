"""`symfric codegen` and `export-fmu`: laws, plants, robots, compensators, fits."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from backends import needs_compiler
from fits import make
from robots import SMALL

from identification import Fit, InverseDynamics, synthetic_drive_data
from identification.result.fitted import Fitted
from symfric import Coulomb, Sum, Viscous
from symfric.cli import codegen as command
from symfric.cli.codegen_results import compared, show_verification
from symfric.codegen import Block, Proof
from symfric.codegen.verification import Check, Verification
from symfric.embedded import BlockMeasurement
from symfric.scenes import ALL_SCENES

pytestmark = needs_compiler


def described(name: str, folder: str = "c") -> dict[str, Any]:
    return json.loads(Path(folder, f"{name}_manifest.json").read_text())


def names(of: list[dict[str, Any]]) -> list[str]:
    return [one["name"] for one in of]


def test_files_are_written_and_verified(symfric) -> None:
    printed = symfric("codegen --law lugre --out c --step-size 0.002 --set mu_s=0.2 --json r.json")
    head, *lines, last = printed.err.splitlines()
    result = json.loads(Path("r.json").read_text())
    written = {path.name for path in Path("c").iterdir()}
    assert {Path(file).name for file in result["files"]} == written
    assert head == f"wrote {len(written)} files into c:"
    assert set(" ".join(lines).split()) == written
    assert max(map(len, lines)) <= 80
    assert last == "wrote r.json"
    assert {"lugre_f64.c", "lugre_f64.h", "lugre_f32.c", "lugre_f32.h"} < written
    double, single = result["verification"]["checks"]
    assert (double["real"], double["ulp"], double["warnings"]) == ("double", 0, [])
    assert (single["real"], result["law"]) == ("float", "lugre")
    assert result["verification"]["ok"]
    assert "lugre: verified" in printed.out
    assert "bit for bit equal" in printed.out
    assert "within rounding" in printed.out
    assert described("lugre")["constants"]["h"] == 0.002
    assert "default 0.2" in Path("c/lugre_f64.h").read_text()


def test_parameters_are_variable_unless_folded(symfric) -> None:
    line = "codegen --law dahl --out c --set sigma_0=12345 --real double --no-kit --free mu_d"
    symfric(f"{line} --step-size 1")
    assert names(described("dahl")["parameters"]) == ["mu_d"]
    assert described("dahl")["constants"]["sigma_0"] == 12345.0
    line = "codegen --law coulomb --fold --real float --no-guards --no-kit --name stage --out d"
    symfric(line)
    written = {path.name for path in Path("d").iterdir()}
    assert written == {"stage_f32.c", "stage_f32.h", "stage_manifest.json"}
    assert "status" not in Path("d/stage_f32.h").read_text()
    assert described("stage", "d")["parameters"] == []
    symfric("codegen --law gms --turning --set form=event --out e --real double --no-kit")
    shown = Path("e/gms_f64.h").read_text()
    assert "rad/s" in shown and "mode" in shown


def test_a_law_becomes_integers(symfric) -> None:
    line = "codegen coulomb --real fixed --out c --range N=0:20"
    found = symfric(f"{line} --range v=-1:1 --json r.json")
    result = json.loads(Path("r.json").read_text())
    assert 0.0 < result["measured"]["F"] <= result["proven"]["F"] < 1e-6
    assert "integers of 32 bits" in found.out
    assert "times 2^30 [m/s], +-1" in Path("c/coulomb_q31.h").read_text()
    for given, text in {
        line: "expected a range of v [m/s], got none",
        f"{line} --range v=1": "--range v=LOW:HIGH: expected a finite number",
        f"{line} --no-guards": "--real fixed: expected none of --no-guards",
        "codegen --mpc p.py --range v=0:1 --out c": "in addition, got --range",
        "codegen gms --range v=0:1 --estimator kalman --out c": "expected none of --estimator",
    }.items():
        assert text in symfric(given, 2).err


def test_a_proof_is_shown_and_decides_the_exit_status(symfric, monkeypatch) -> None:
    line = "codegen --law stribeck --out c --real float --no-kit --prove"
    for ranges, status, shown in (
        ({"F": (-2.5, 2.5), "F_end": (-3e38, 3e38)}, "proved", "finite outputs; F within -2.5"),
        ({"F": (-4.0, 4.0)}, "not proved: F may exceed F_max = 3 N", "F may exceed F_max"),
    ):
        found = Proof("stribeck", "float", status, ranges)
        monkeypatch.setattr("symfric.cli.codegen.prove_block", lambda *given, p=found: p)
        printed = symfric(f"{line} --json r.json", status=int(not found.ok))
        assert shown in " ".join(printed.out.split())
        assert json.loads(Path("r.json").read_text())["proofs"][0]["status"] == status
    assert "--prove: expected guards" in symfric(f"{line} --no-guards", status=2).err


PROBLEM = """
from ocp import Phase, Problem, effort, track
from symfric import BrownMcPhee, drive

def problem(m=1.0):
    model = drive(BrownMcPhee(mu_s=6.0, mu_d=4.0, v_t=1e-2), m=m, N=1.0)
    cost = track("x", "goal", 900.0) + effort("force", 1e-3)
    return Problem(Phase(model, T=0.1), cost, bounds={"force": (-20, 20)}, p={"goal": 0.0})

def quick():
    return problem().to_mpc(0.01, iterations=1)
"""


def test_a_problem_becomes_a_controller(symfric, monkeypatch) -> None:
    Path("move.py").write_text(PROBLEM)
    line = "codegen --mpc move.py --out c --set m=2 --step-size 0.02"
    printed = symfric(f"{line} --json r.json")
    assert "5 intervals of 0.02 s" in printed.out
    assert [row["status"] for row in json.loads(Path("r.json").read_text())["checks"]] == (
        ["verified", "verified"]
    )
    assert {p.name for p in Path("c").iterdir()} == {
        "drive_mpc.c", "drive_mpc.h", "drive_mpc_f32.c", "drive_mpc_f32.h"
    }  # fmt: skip
    measured = BlockMeasurement("drive_mpc", "float", "m7", average=2.5e5, maximum=6e5, finite=True)
    monkeypatch.setattr("ocp.mpc.target.measure_controller", lambda *given: measured)
    shown = symfric("codegen --mpc move.py:quick --out c --real float --core m7").out
    assert "250000" in shown and "600000" in shown
    for wrong, message in (
        ("move.py:quick --step-size 0.1", "--step-size: expected none with a controller"),
        ("move.py --compensator --fold --no-guards", "got --fold, --no-guards, --compensator"),
        ("move.py --law lugre --name x", "got --law, --name"),
        ("none.py", "which does not exist"),
    ):
        assert message in symfric(f"codegen --mpc {wrong} --out d", 2).err


def test_a_scene_becomes_a_plant(symfric, monkeypatch) -> None:
    monkeypatch.setattr(ALL_SCENES["rabinowicz"], "t_end", 1.0)
    line = "codegen --scene rabinowicz --law lugre --set k=3 --out c --free mu_s --no-kit"
    result = json.loads(symfric(f"{line} --step-size 1e-3 --method backward_euler --json -").out)
    manifest = result["manifest"]
    assert names(manifest["states"]) == ["x", "v", "z"]
    assert names(manifest["parameters"]) == ["mu_s"]
    assert (manifest["constants"]["k"], manifest["constants"]["h"]) == (3.0, 1e-3)
    (check,) = result["verification"]["checks"]
    assert (check["real"], check["ulp"]) == ("double", 0)
    assert "backward Euler" in Path("c/rabinowicz_f64.h").read_text()
    steps = {one["h"]: one["error"] for one in result["step_errors"]}
    assert [*steps] == [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4]
    assert f"error of steps of 0.001 s is {steps[1e-3]:.1g}" in " ".join(
        Path("c/rabinowicz_f64.h").read_text().split()
    )
    line = "codegen --scene drive --law stribeck --set turning=true --set m=2 --no-kit --out c"
    assert "errors of fixed steps over 4 s of the scene:" in symfric(line).out
    assert "moving mass [kg m^2]" in Path("c/drive_f64.h").read_text()
    assert names(described("drive")["parameters"])[:3] == ["m", "N", "offset"]
    symfric(f"{line} --fold --step-size 1e-3")
    assert described("drive")["parameters"] == []
    assert described("drive")["constants"]["m"] == 2


def test_a_step_that_is_too_long_is_refused_with_one_that_is_not(symfric, monkeypatch) -> None:
    monkeypatch.setattr(ALL_SCENES["rabinowicz"], "t_end", 1.0)
    line = "codegen --scene rabinowicz --law lugre --method dopri5 --no-kit --out c --step-size"
    status = json.loads(symfric(f"{line} 0.05 --json -", 1).out)["verification"]["status"]
    assert "steps of 0.05 s it runs away, in CasADi as in C: that step is too long, 0.0" in status
    symfric(f"{line} {status.rsplit(', ', 1)[1].split()[0]}")


def test_robots_become_plants_and_inverse_dynamics(symfric) -> None:
    Path("small.urdf").write_text(SMALL)
    symfric("codegen --scene small.urdf --law lugre --no-kit --out c --step-size 0.001")
    assert "tau_hinge" in Path("c/small_f64.h").read_text()
    line = "codegen small.urdf --inverse-dynamics --no-kit --out c --json -"
    result = json.loads(symfric(f"{line} --payload arm").out)
    assert result["law"] == "small"
    manifest = result["manifest"]
    assert names(manifest["inputs"]) == ["q_1", "qd_1", "qdd_1"]
    found = names(manifest["parameters"])
    assert found[0] == "payload_m"
    assert {"payload_c_3", "payload_J_6", "N_1", "sigma_2_1"} < set(found)
    assert "float small_f32" in Path("c/small_f32.h").read_text()
    assert json.loads(symfric(f"{line} --fold").out)["manifest"]["parameters"] == []
    line = "codegen --scene pendulum --law coulomb --set mu_d=0.3 --inverse-dynamics --out c"
    result = json.loads(symfric(f"{line} --real double --no-kit --json -").out)
    held = {p["name"]: p["default"] for p in result["manifest"]["parameters"]}
    assert 0.3 in held.values()
    assert result["law"] == "coulomb"


def test_a_law_becomes_a_compensator_with_its_settings(symfric) -> None:
    line = "codegen --law lugre --compensator --out c --real double --no-kit --set mu_d=0.12"
    line += " --compensation v_blend=0.02,error_gain=20,scales=coulomb:0.9"
    line += " --compensation without=stribeck,viscous"
    symfric(line)
    manifest = described("friction_compensator")
    starts = {p["name"]: p["default"] for p in manifest["parameters"]}
    assert starts["mu_d"] == 0.12
    assert (starts["v_blend"], starts["k_error"], starts["scale_coulomb"]) == (0.02, 20.0, 0.9)
    assert "scale_stribeck" not in starts
    assert names(manifest["inputs"]) == ["v_ref", "e", "v", "enable"]
    line = "codegen --law stribeck --compensator --fold --out c --real double --no-kit"
    symfric(f"{line} --step-size 1e-3")
    assert described("friction_compensator")["parameters"] == []
    assert described("friction_compensator")["constants"]["v_blend"] == 0.01


def test_a_compensator_of_a_fit_has_the_load_and_offset_of_its_drive(symfric) -> None:
    data = synthetic_drive_data(Sum((Coulomb(20.0), Viscous(160.0))), speeds=(0.05, 0.1))
    fit = Fit(InverseDynamics(), "coulomb+viscous", data, starts=1).solve(throw=False)
    fit.to_json("fit.json")
    symfric("codegen fit.json --compensator --out c --no-kit --real double")
    starts = {p["name"]: p["default"] for p in described("friction_compensator")["parameters"]}
    assert fit.drive is not None
    assert starts["N"] == fit.drive.N
    assert starts["offset"] == pytest.approx(fit.drive.offset) == pytest.approx(-3.0, abs=0.2)
    assert starts["mu_d"] == pytest.approx(20.0, rel=0.02)
    line = "codegen fit.json --estimator recursive --out c --no-kit --real double"
    symfric(f"{line} --adaptation noise=1e-4,spread=offset:7 --adaptation change=90")
    manifest = described("friction_estimator")
    starts = {p["name"]: p["default"] for p in manifest["parameters"]}
    assert starts["inertia"] == pytest.approx(fit.drive.m)
    assert (starts["offset_spread"], starts["t_change"]) == (7.0, 90.0)
    assert {"scale_coulomb", "scale_viscous", "offset"} < {*names(manifest["outputs"])}


def test_the_c_of_a_fit_has_its_numbers(symfric) -> None:
    make(records=1, starts=1, n=800).to_json("fit.json")
    line = "codegen fit.json --out c --real double --no-kit"
    printed = symfric(line)
    assert "mu_s, mu_d: fitted as forces under a load of 1 N" in printed.err
    assert "bit for bit equal" in printed.out
    law = {p["name"]: p["default"] for p in described("stribeck")["parameters"]}
    assert law["mu_s"] == Fitted.from_json("fit.json").values["mu_s"] > 20
    symfric("codegen fit.json --scene drive --set m=3 --set N=1 --out c --step-size 1e-3 --no-kit")
    manifest = described("drive")
    values = {p["name"]: p["default"] for p in manifest["parameters"]} | manifest["constants"]
    assert (values["m"], values["mu_s"]) == (3.0, Fitted.from_json("fit.json").values["mu_s"])
    changed = json.loads(Path("fit.json").read_text(encoding="utf-8"))
    for status, noted in {"SOLVED": False, "DOUBTFUL": True}.items():
        Path("f.json").write_text(json.dumps(changed | {"status": status}), encoding="utf-8")
        err = symfric("codegen f.json --real double --no-kit --out d").err
        assert ("f.json: status of the fit DOUBTFUL" in err) is noted
    changed["parameters"]["v_s"] |= {"low": None, "high": None, "standard_error": None}
    Path("f.json").write_text(json.dumps(changed), encoding="utf-8")
    assert (
        "got v_s without an interval; give --set v_s=VALUE"
        in symfric("codegen f.json --out e", 2).err
    )
    for option in ("--accept v_s", "--set v_s=0.01"):
        symfric(f"codegen f.json --real double --no-kit --out e {option}")
    assert "--accept: expected one of" in symfric("codegen f.json --out e --accept v_x", 2).err
    assert "--accept: expected with a fit" in symfric("codegen lugre --out e --accept mu_s", 2).err


def test_sizes_are_measured_on_cores_without_a_compiler(
    symfric, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)

    def measure(block: Block, real: str, core: str, **_: object) -> BlockMeasurement:
        if core == "m3":
            return BlockMeasurement(block.name, real, core, status="no QEMU")
        return BlockMeasurement(
            block.name, real, core, average=12.4, maximum=15.0, text=88.0, stack=16.0, finite=True,
            regimes={"rest": 3.0, "sliding": 14.0},
        )  # fmt: skip

    monkeypatch.setattr(command, "measure", measure)
    line = "codegen --law coulomb --real float --no-kit --out c --core m4f --core m3"
    printed = symfric(f"{line} --json r.json", 1).out
    assert "no C compiler found" in printed
    assert Path("c/coulomb_f32.c").is_file()
    rows = [line.split()[1:] for line in printed.splitlines() if line[:5] == "float"]
    assert rows == [["m4f", "88", "16"], ["m4f", "12", "3", "14", "15"]]
    assert "m3: no QEMU" in printed
    assert [m["core"] for m in json.loads(Path("r.json").read_text())["cores"]] == ["m4f", "m3"]


def test_the_table_shows_comparisons_and_ties(capsys: pytest.CaptureFixture[str]) -> None:
    alike = Check("float", 1, (), None, 1e-7, (), worst="F", rounding=1e-7)
    assert compared(alike) == "within rounding"
    assert compared(replace(alike, error=1e-2)) == "differs"
    assert compared(replace(alike, ulp=0, error=0.0)) == "bit for bit equal"
    assert compared(replace(alike, ulp=3, error=0.0)) == "3 ulp apart"
    double = Check("double", 28000, (), 0, 0.0, ())
    checks = double, Check("float", 28000, (), None, 0.0, (), ties=3)
    show_verification(Verification("springs", "verified", "gcc", checks))
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.count("rounding decides") == 1
    assert "float: in 3 of 28000 steps rounding decides a mode, in CasADi as in C" in printed


def test_a_scene_or_a_model_of_a_file_becomes_a_unit(symfric, mine) -> None:
    line = "export-fmu drive --law brown_mcphee --set m=2 --free m --fmi 2 --out drive.fmu --json -"
    result = json.loads(symfric(line).out)
    assert (result["fmi"], result["file"]) == (2, "drive.fmu")
    tunable = {n for n, v in result["variables"].items() if v["causality"] == "parameter"}
    assert tunable == {"m", "rtol"}
    assert {"modelDescription.xml", "sources/all.c"} <= set(ZipFile("drive.fmu").namelist())
    Path("drive.fmu").unlink()
    printed = symfric("export-fmu mine.py --set m=3")
    assert "FMI 3.0 co-simulation" in printed.out
    assert printed.err == "wrote drive.fmu\n"
    assert Path("drive.fmu").is_file()
