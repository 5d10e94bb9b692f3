"""`symfric scenes`: the list, and one scene in full."""

from pathlib import Path

import pytest
from robots import SMALL

from symfric import parameters
from symfric.cli import scenes as command
from symfric.laws import ALL_LAWS
from symfric.scenes import ALL_SCENES, PendulumBox


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


@pytest.mark.parametrize("name", ALL_SCENES)
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
