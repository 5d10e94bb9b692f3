"""`symfric select`: laws ranked on a scene or a function of the user."""

import json
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from symfric.cli import select as command
from symfric.laws import Law, LuGre

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
    monkeypatch.setattr(command, "reader", lambda *_, **__: lambda _: None)
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
