"""Files and manifest."""

import json
from pathlib import Path

import pytest

from symfric import BrownMcPhee, LuGre, Output, Variable, parameters
from symfric.codegen import Block, generate, law_block
from symfric.laws import GMS


def test_writes_header_and_source_for_each_type_and_a_manifest(tmp_path):
    made = generate(LuGre(), tmp_path / "new" / "c", kit=False)
    names = ["lugre_f64.h", "lugre_f64.c", "lugre_f32.h", "lugre_f32.c", "lugre_manifest.json"]
    assert [path.name for path in made.files] == names
    assert sorted(path.name for path in (tmp_path / "new" / "c").iterdir()) == sorted(names)
    assert made.header("float") == tmp_path / "new" / "c" / "lugre_f32.h"


def test_one_type_by_its_name(tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float", name="seal")
    assert [path.name for path in made.files] == [
        *("seal_f32.h", "seal_f32.c", "seal_f32_test.c", "seal_f32_vectors.h"),
        *("seal_f32_vectors.csv", "seal_block.cmake", "CMakeLists.txt", "seal_ctypes.py"),
        *("seal_sfun.c", "seal_manifest.json"),
    ]
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in made.files}


def test_the_manifest_names_everything_with_its_unit(tmp_path):
    made = generate(LuGre(), tmp_path, h=2e-3, free=("sigma_0", "mu_s"))
    manifest = json.loads((tmp_path / "lugre_manifest.json").read_text())
    assert manifest == made.manifest
    assert [(s["name"], s["unit"], s["start"]) for s in manifest["states"]] == [("z", "m", 0.0)]
    assert [(p["name"], p["unit"], p["default"]) for p in manifest["parameters"]] == [
        ("sigma_0", "N/m", 1e5),
        ("mu_s", "1", 0.15),
    ]
    assert [i["name"] for i in manifest["inputs"]] == ["v", "N"]
    assert manifest["outputs"][0]["unit"] == "N"
    assert manifest["constants"]["h"] == 2e-3
    assert manifest["model"] == made.block.fingerprint
    assert manifest["real"]["float"]["bytes"] == {"state": 4, "param": 8, "in": 8, "out": 8}
    assert manifest["real"]["double"]["bytes"]["param"] == 16


@pytest.mark.parametrize("guards", [True, False])
def test_the_manifest_has_the_ranges_that_are_kept(guards, tmp_path):
    found = generate(LuGre(), tmp_path, real="float", kit=False, guards=guards).manifest
    ranges = {variable["name"]: variable["range"] for variable in found["inputs"]}
    kept, bounds = {"v": [-1e6, 1e6], "N": [0.0, 1e7]}, {"v": [None, None], "N": [0.0, None]}
    assert ranges == (kept if guards else bounds)
    assert found["states"][0]["range"] == [None, None]


def test_the_manifest_counts_operations_and_calls(tmp_path):
    step = generate(LuGre(), tmp_path, kit=False).manifest["real"]["float"]["functions"][
        "lugre_f32_step"
    ]
    assert step["calls"] == {"exp": 1, "expm1": 1, "fabs": 1, "tanh": 1}
    assert 45 <= step["operations"] <= 62
    assert step["prototype"].startswith("unsigned int lugre_f32_step(lugre_f32_state_t *state, ")


def test_the_same_law_gives_the_same_files(tmp_path):
    first, second = generate(LuGre(), tmp_path / "a"), generate(LuGre(), tmp_path / "b")
    for one, other in zip(first.files, second.files, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_a_block_is_generated_as_it_is(tmp_path):
    x, u = Variable("x", "m"), Variable("u", "m/s")
    block = Block("integrator", states=(x,), inputs=(u,), next=x.symbol + 1e-3 * u.symbol)
    made = generate(block, tmp_path, real="double")
    assert "state->x = x + 0.001 * u;" in made.source("double").read_text()


@pytest.mark.parametrize(
    ("law", "options", "message"),
    [
        (LuGre(), {"real": "half"}, "expected one of double, float, got half"),
        (LuGre(), {"real": ()}, "expected double, float or both, got none"),
        (LuGre(), {"free": ("mu",)}, "got mu"),
        (GMS(), {}, "have circular dependencies"),
        (LuGre(mu_s=0.3), {"free": (), "h": 1e-60}, "would become 0"),
        (Block("b", outputs={"y": Output(1.0, "m")}), {"h": 1e-3}, "with a law only, got a block"),
    ],
)
def test_bad_input_writes_nothing(tmp_path, law, options, message):
    with pytest.raises(ValueError, match=message):
        generate(law, tmp_path / "c", **options)
    assert not (tmp_path / "c").exists()


def test_a_file_in_place_of_the_folder_is_refused(tmp_path: Path):
    (tmp_path / "c").write_text("")
    with pytest.raises(ValueError, match="expected a folder, got the file"):
        generate(LuGre(), tmp_path / "c")


def test_block_and_law_give_the_same_code(tmp_path):
    free = tuple(parameters(LuGre()))
    direct = generate(LuGre(), tmp_path / "a", free=free, kit=False)
    block = generate(law_block(LuGre(), free=free), tmp_path / "b", kit=False)
    assert direct.manifest == block.manifest


def test_header_of_a_law_that_turns_has_its_units(tmp_path):
    made = generate(LuGre(), tmp_path / "b", real="double", turning=True)
    text = made.header("double").read_text()
    for unit in ("[rad/s]", "[N m]", "[N m/rad]", "[N m s/rad]", "[rad]"):
        assert unit in text
    for unit in ("[m/s]", "[N]", "[N/m]", "[N s/m]"):
        assert unit not in text
    with pytest.raises(ValueError, match="turning: expected with a law only"):
        generate(made.block, tmp_path / "c", turning=True)
