"""`symfric identify` on records made here: a mass on a known force with known friction.

`symfric select`: laws ranked on a scene or a function of the user.

`symfric ocp`: ready problems and those of a user's file.
"""

import csv
import json
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.data.synthetic import synthetic_drive_data
from identification.result.fitted import Fitted
from identification.unknowns.spec import above, linear, log, tied
from ocp import Legendre, Radau, Shooting, load
from ocp.problems import READY
from symfric import Coulomb, SolveError, Sum, Viscous
from symfric.cli import ocp as ocp_command
from symfric.cli import select as command
from symfric.cli.identify import free_in, refuse
from symfric.cli.ocp import scheme_of
from symfric.laws import Law, LuGre

TRUTH = {"m": 40.0, "offset": 2.0, "mu_d": 15.0, "sigma_2": 80.0}
LINE = "identify one.csv --law coulomb+viscous --starts 1"


@pytest.fixture(scope="session")
def made() -> list[Dataset]:
    law = Sum((Coulomb(mu_d=TRUTH["mu_d"], v_eps=1e-4), Viscous(sigma_2=TRUTH["sigma_2"])))
    how: dict[str, Any] = {"m": TRUTH["m"], "offset": TRUTH["offset"], "speeds": (0.02, 0.1)}
    return [synthetic_drive_data(law, **how, seed=seed) for seed in (1, 2)]


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
    printed = symfric(f"{LINE} --json fit.json", 1)
    assert "columns are exchanged" in " ".join((printed.out + printed.err).split())
    assert printed.err.splitlines()[-1].startswith("symfric: ")


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


FAST = "--no-fixed-steps --workers 1 --accuracy 0.02"


def test_a_scene_with_parameters_gives_table_and_files(symfric) -> None:
    laws = "--law stribeck --law coulomb --set mu_s=0.2 --set m=1 --set stribeck.delta=1"
    files = "--json c.json --html c.html --csv c.csv"
    out = symfric(f"select rabinowicz {laws} --t-end 5 {FAST} {files}").out
    assert "mu_s = 0.2, mu_d = 0.1" in out
    assert "Simulation: take stribeck" in out
    assert json.loads(Path("c.json").read_text(encoding="utf-8"))["best"] == "stribeck"
    assert Path("c.html").stat().st_size > 10_000
    assert Path("c.csv").read_text(encoding="utf-8").startswith("law,")
    line = f"select rabinowicz --law coulomb --need '' --t-end 5 {FAST}"
    assert "coulomb comes nearest" in symfric(line, 1).err


def seen(symfric, monkeypatch: pytest.MonkeyPatch, line: str) -> Any:
    """The arguments of the ranking that a line asks for."""
    found: list[Any] = []

    def stop(machine: Any, laws: Any, **how: Any) -> None:
        found.append((machine, laws, how))
        raise ValueError("enough")

    monkeypatch.setattr(command, "select_law", stop)
    assert symfric(f"select {line}", 2).err == "symfric: enough\n"
    return found[0]


def test_structure_and_parameters_of_a_scene_are_set(symfric, monkeypatch) -> None:
    line = "drive --law stribeck --set m=2 --set turning=true --of x,v --t-end 1 --set v_s=0.3"
    machine, laws, how = seen(symfric, monkeypatch, line)
    made = machine(LuGre())
    assert (made.m, made.turning, machine.__name__) == (2.0, True, "drive")
    assert list(laws) == ["stribeck"]
    assert (how["of"], how["t_end"], how["friction"].v_s) == (["x", "v"], 1.0, 0.3)
    assert how["needs"] == ("stiction", "stribeck")


def test_a_function_in_a_file_is_a_machine(symfric, mine, monkeypatch) -> None:
    machine, _, _ = seen(symfric, monkeypatch, "mine.py --law stribeck --set m=3")
    assert machine.keywords == {"m": 3.0}
    assert machine(LuGre()).name == "press"


def test_forms_are_set_for_one_law_or_all(symfric, monkeypatch) -> None:
    def form(line: str) -> list[str]:
        _, laws, _ = seen(symfric, monkeypatch, f"rabinowicz --law karnopp --need '' {line}")
        return [law.form for law in laws["karnopp"]]

    assert form("") == ["event", "smooth"] or len(form("")) > 1
    assert form("--set karnopp.form=event") == ["event"]
    assert form("--law stribeck --set form=original") == ["original"]


def test_laws_without_the_required_phenomena_are_not_fitted(symfric, monkeypatch) -> None:
    requested = list[str]()

    def stop(laws: list[str], *_: object) -> None:
        requested.extend(laws)
        raise ValueError("enough")

    monkeypatch.setattr(command, "fitted", stop)
    monkeypatch.setattr(command, "reader", lambda *_: lambda _: None)
    symfric("select drive --law dahl,lugre,coulomb --need presliding,stribeck --data d", 2)
    assert requested == ["lugre"]


def test_fits_are_passed_on_with_their_relative_errors(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    law: Law = LuGre(mu_s=0.2)
    rows = [
        SimpleNamespace(law="lugre", fit=SimpleNamespace(law=law), fitted=2.5, sentence=""),
        SimpleNamespace(law="dahl", fit=None, fitted=1.0, sentence="no motion"),
    ]
    fits = import_module("identification.select")  # the module, not the function of its name
    monkeypatch.setattr(fits, "select", lambda *_, **__: SimpleNamespace(rows=rows))
    assert command.fitted(["lugre", "dahl"], None, None, 1.0) == ({"lugre": law}, {"lugre": 0.025})
    assert "dahl: no motion" in capsys.readouterr().err
    rows.pop(0)
    with pytest.raises(ValueError, match="--data: expected data that some law fits"):
        command.fitted(["dahl"], None, None, 1.0)


def test_progress_is_reported_in_lines_without_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([0.0, 5.0, 20.0, 20.0, 25.0])
    monkeypatch.setattr(command, "perf_counter", lambda: next(clock))
    with command.reported("select x") as say:
        for share in (0.1, 0.5, 0.7):
            say("lugre", share)
    assert capsys.readouterr().err == "select x: 50 % after 20 s, lugre last\n"


def test_a_problem_of_a_file_is_solved_and_written(symfric, mine) -> None:
    """A mass of 1 kg over 1 m from rest to rest in T: J = 12 / T^3."""
    line = "ocp mine.py --set T=2 --intervals 5"
    printed = symfric(f"{line} --csv a.csv --save a.npz --plot a.png --json a.json")
    assert printed.err == "wrote a.csv, a.npz, a.png, a.json\n"
    assert "verified" in printed.out
    assert "yes" in printed.out
    assert "difference" not in printed.out
    found = json.loads(Path("a.json").read_text())
    assert found["cost"] == pytest.approx(12 / 8, rel=1e-3)
    assert found["verification"]["ok"]
    rows = list(csv.reader(Path("a.csv").read_text().splitlines()))
    assert rows[0][:3] == ["t [s]", "x [m]", "v [m/s]"]
    assert load("a.npz").cost == found["cost"]
    assert Path("a.png").stat().st_size > 1000
    by = symfric("ocp mine.py --intervals 5 --sensitivity 'x at the end,T' --json -").json
    assert by["sensitivities"]["x at the end"]["dJ"] == pytest.approx(2 * by["cost"])
    assert by["sensitivities"]["T"]["dJ"] == pytest.approx(-3 * by["cost"])
    again = symfric("ocp mine.py:problem --set T=2 --guess a.npz --scheme legendre2 --json -").json
    assert again["cost"] == pytest.approx(12 / 8, rel=1e-3)


def test_a_soft_end_of_a_file_is_shown(symfric, tmp_path, monkeypatch) -> None:
    """J = 12 x^2 + 3 (1 - x) has its least value at x = 1/8."""
    monkeypatch.chdir(tmp_path)
    Path("wall.py").write_text(
        "from ocp import Phase, Problem, integral, soft\n"
        "import casadi as ca\nfrom symfric import Model, Variable\n"
        "wall = soft(lambda s: s.x == 1.0, linear=3.0)\n"
        "x, v, force = (Variable(name, '') for name in ('x', 'v', 'force'))\n"
        "model = Model('mass', x=(x, v), u=(force,), ode=ca.vertcat(v, force))\n"
        "phase = Phase(model, 1.0, end={'v': 0.0}, at={1: [wall]})\n"
        "problem = Problem(phase, integral(lambda s: s.force**2))\n"
    )
    shown = symfric("ocp wall.py --intervals 10").out
    assert "condition 1 at the end" in shown
    assert "2.625" in shown
    assert "0.875" in shown
    found = symfric("ocp wall.py --intervals 10 --json -").json
    assert found["soft"]["condition 1 at the end"]["violation"] == pytest.approx(0.875, rel=1e-3)


def test_options_are_the_arguments_of_solve(symfric, monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(problem: object, **given: object) -> None:
        seen.update(given)
        raise ValueError("enough")

    seen: dict[str, object] = {}
    monkeypatch.setattr(ocp_command, "solve", solve)
    options = "--intervals 7 --tolerance 0.1 --resting-margin 0.002 --max-time 3 --solver sqp"
    options += " --starts 4 --no-refine --no-verify"
    symfric(f"ocp out_and_back --scheme radau5 --friction smooth {options}", 2)
    del seen["progress"]
    assert str(seen.pop("solver")).startswith("Sqp")
    assert seen == {
        "scheme": Radau(5), "friction": "smooth", "tolerance": 0.1, "resting_margin": 0.002,
        "intervals": 7, "max_time": 3.0, "guess": None, "throw": False,
        "starts": 4, "executor": None, "refine": False, "verify": False,
    }  # fmt: skip


def test_a_ready_problem_is_compared_with_its_best_known_cost(symfric) -> None:
    assert "difference" in symfric("ocp bryson_denham --intervals 8").out
    out = symfric("ocp").out
    assert all(name in out for name in READY)


def test_names_of_schemes() -> None:
    assert scheme_of("radau") == Radau(3)
    assert scheme_of("radau5") == Radau(5)
    assert scheme_of("legendre2") == Legendre(2)
    assert scheme_of("shooting") == Shooting("rodas5p")
    assert scheme_of("shooting:exponential:4") == Shooting("exponential", 4)
