"""`symfric scenes`: what machines there are, and what one of them takes."""

import json
from pathlib import Path
from typing import Any

import pytest
from robots import SMALL

from symfric import parameters
from symfric.cli import main
from symfric.laws import ALL_LAWS
from symfric.scenes import ALL_SCENES, PendulumBox


@pytest.fixture(autouse=True)
def narrow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def told(capsys: pytest.CaptureFixture[str], line: str) -> str:
    assert main(["scenes", *line.split()]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert max(map(len, out.splitlines())) <= 80
    return out


def found(capsys: pytest.CaptureFixture[str], line: str) -> dict[str, Any]:
    return json.loads(told_json(capsys, line))


def told_json(capsys: pytest.CaptureFixture[str], line: str) -> str:
    assert main(["scenes", *line.split(), "--json", "-"]) == 0
    return capsys.readouterr().out


def test_all_scenes_are_listed_in_eighty_columns(capsys: pytest.CaptureFixture[str]) -> None:
    out = told(capsys, "")
    for name, kind in ALL_SCENES.items():
        assert f"\n{name} " in f"\n{out}"
        assert all(preset in out for preset in kind.presets)
    listed = {row["name"]: row for row in found(capsys, "")["scenes"]}
    assert list(listed) == [*ALL_SCENES]
    assert listed["nip"]["inputs"] == ["v_set", "load"]
    assert (listed["drill_string"]["states"], listed["coupled_blocks"]["contacts"]) == (
        9, ["block_1", "block_2"],
    )  # fmt: skip


@pytest.mark.parametrize("name", ALL_SCENES)
def test_a_scene_says_all_that_it_takes_and_gives(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = told(capsys, name)
    kind, scene = ALL_SCENES[name], ALL_SCENES[name](ALL_LAWS["viscous"]())
    words = " ".join(out.split())
    model = scene.model()
    for variable in (*model.x, *model.u):
        assert f"\n{variable.name} " in out
    for parameter in set(parameters(scene)) - {"sigma_2"}:
        assert f"\n{parameter} " in out
    for given in kind.inputs.values():
        assert given.text in words
    for group in (kind.places(), kind.presets, kind.structures(), model.outputs):
        for one in group:
            assert f"\n{one} " in out
    assert f"Default end time: {kind.t_end:g} s." in words


def test_parameters_are_shown_to_the_last_digit(capsys: pytest.CaptureFixture[str]) -> None:
    """Who types them again has the same machine."""
    assert "\nJ_bit       471.9698   kg m^2" in told(capsys, "drill_string")


def test_a_law_and_a_preset_show_the_numbers_that_run_takes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    line = "pendulum_box --law lugre --preset jing_mi_table_7 --set mu_s_2=0.004"
    result = found(capsys, line)
    expected = parameters(PendulumBox.preset("jing_mi_table_7", ALL_LAWS["lugre"]()))
    values = {p["name"]: p["value"] for p in result["parameters"]}
    assert values == {n: p.value for n, p in expected.items()} | {"mu_s_2": 0.004}
    assert [v["name"] for v in result["states"]][-2:] == ["x_z", "phi_z"]
    assert result["states"][-1]["start"] is None
    assert "of the law" in told(capsys, "pendulum_box --law lugre")
    without = {p["name"] for p in found(capsys, "pendulum_box")["parameters"]}
    assert without == {"m_box", "m", "L", "J", "R", "phi_0", "g"}


def test_a_robot_shows_its_joints_and_inputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "small.urdf"
    path.write_text(SMALL)
    result = found(capsys, str(path))
    assert [v["name"] for v in result["states"]] == ["hinge", "hinge_rate"]
    assert [(u["name"], u["unit"]) for u in result["inputs"]] == [("tau_hinge", "N m")]


def test_a_picture_is_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "clutch.png"
    assert main(["scenes", "clutch", "--plot", str(path)]) == 0
    assert path.read_bytes().startswith(b"\x89PNG")
    assert f"wrote {path}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("drve", "did you mean drive"),
        ("--law lugre", "expected the name of a scene before them, got none"),
        ("drive --preset x", "--preset of drive: expected no names, got x"),
        ("prescribed --law karnopp", "a given motion does not say it"),
        ("drive --plot x.bmp", "expected a picture ending in"),
    ],
)
def test_mistakes_are_one_sentence(
    line: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scenes", *line.split()]) == 2
    (err,) = capsys.readouterr().err.splitlines()
    assert message in err


def test_forms_and_structure_are_set_as_numbers_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(found(capsys, "drill_string --set lumps=2")["states"]) == 5
    assert found(capsys, "drive --set turning=true")["inputs"][0]["unit"] == "N m"
    assert [u["name"] for u in found(capsys, "prescribed --set load=input")["inputs"]] == [
        "v", "load",
    ]  # fmt: skip
    events = found(capsys, "rabinowicz --law karnopp --set form=event")["states"]
    assert [v["name"] for v in events] == ["x", "v", "mode", "leaving"]
    for line, message in (
        ("drill_string --set lumps=2.5", "--set lumps: expected a whole number"),
        ("drive --set turning=1", "expected one of true, false, got 1"),
        ("rabinowicz --law karnopp --set form=evnt", "expected one of smooth, original, event"),
        ("rabinowicz --law lugre --set form=event", "--set of rabinowicz: expected one of"),
    ):
        assert main(["scenes", *line.split()]) == 2
        assert message in capsys.readouterr().err


def test_a_scene_says_what_it_is_called_in_python(capsys: pytest.CaptureFixture[str]) -> None:
    assert "In Python: from symfric.scenes import Prescribed\n" in told(capsys, "prescribed")
    assert found(capsys, "quarter_car")["python"] == ALL_SCENES["quarter_car"].__name__
