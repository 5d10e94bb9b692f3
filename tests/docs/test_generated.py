"""Pages that are made of the code hold all of it."""

from pathlib import Path

import pytest

from docs.machine import bench_pages, command_pages, example_pages, law_pages, limit_pages
from docs.machine.api_pages import pages as api_pages
from docs.machine.generated import stale, write
from docs.machine.names import catalogue, known, linked
from docs.machine.scene_pages import pages as scene_pages
from symfric import ALL_LAWS, POPULATIONS, LuGre, parameters
from symfric.cli.commands import COMMANDS, prose_and_examples
from symfric.scenes import ALL_SCENES


def test_every_law_has_a_page_with_formula_picture_and_parameters() -> None:
    pages = law_pages.pages()
    assert {*ALL_LAWS, *POPULATIONS, *law_pages.MADE_OF_LAWS, "index"} == {*pages}
    for name in ALL_LAWS:
        assert ".. math::" in pages[name], name
        assert f"/made/laws/{name}.png" in pages[name]
        assert f".. py:class:: symfric.{ALL_LAWS[name].__name__}(" in pages[name]
    assert all(f"``{p}``" in pages["lugre"] for p in parameters(LuGre()))
    families = law_pages.every().values()
    assert {law_pages.family(law) for law in families} == {*law_pages.FAMILIES} - {
        "Made of laws and data"
    }


def test_every_scene_has_a_page_with_its_parameters_and_presets() -> None:
    pages = scene_pages()
    assert {*ALL_SCENES, "index"} == {*pages}
    for name, kind in ALL_SCENES.items():
        assert all(f"``{preset}``" in pages[name] for preset in kind.presets)
        assert f".. py:class:: symfric.scenes.{kind.__name__}(" in pages[name]


def test_every_command_stands_with_its_options() -> None:
    page = command_pages.page()
    assert all(f"\nsymfric {name}\n" in page for name in COMMANDS)
    assert "``--law NAME``" in page and "required" in page
    assert prose_and_examples("A.\n\nExample: x y\nz") == ("A.", ["x y z"])


def test_every_public_name_stands_once() -> None:
    pages = "".join(api_pages().values())
    for names in catalogue().values():
        for public in names:
            entries = [f"{kind}:: {public.full}\n" for kind in ("autoclass", "autofunction")]
            at_all = sum(pages.count(e) for e in [*entries, f"autoexception:: {public.full}\n"])
            own = f":doc:`{public.name} <" in pages or f"py:data:: {public.full}\n" in pages
            assert at_all == 1 or own, public.full


def test_names_are_linked_where_they_are_documented() -> None:
    assert linked("simulate") == ":py:obj:`simulate <symfric.simulate>`"
    assert linked("mu_s") == "``mu_s``"
    assert known()["Problem"].full == "ocp.Problem"


def test_every_example_has_its_docstring_and_code() -> None:
    pages = example_pages.pages()
    assert len(pages) == len(example_pages.EXAMPLES) + 1
    assert "J = 40 + 0.5 / (1 - 4 tanh(1/4)) N^2 s" in pages["out_and_back"]
    assert "def problem()" in pages["out_and_back"]


def test_stored_measurements_say_by_what_where_and_when() -> None:
    stored = bench_pages.stored()
    assert {"integrator", "ivp", "ensemble", "multibody", "ocp"} <= {*stored}
    for name, found in stored.items():
        assert {*found} == {*bench_pages.KEYS}, name
        assert all(found[key] for key in bench_pages.KEYS if key != "about"), name
        for table in found["tables"]:
            assert all(len(row) == len(table["columns"]) for row in table["rows"]), name
    assert "symfric bench ivp" in bench_pages.page()


def test_limits_of_laws_are_gathered() -> None:
    assert "drifts under vibration" in limit_pages.limits(LuGre)
    page = limit_pages.page()
    assert all(f":doc:`{name} </laws/{name}>`" in page for name in ALL_LAWS)


def test_pages_that_are_none_any_more_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("docs.machine.generated.DOCS", tmp_path)
    write("room", {"a": "A", "b/c": "C"})
    before = (tmp_path / "room" / "a.rst").stat().st_mtime_ns
    assert stale(tmp_path / "room", {"a": "A"}) == [tmp_path / "room" / "b" / "c.rst"]
    write("room", {"a": "A"})
    assert [p.name for p in (tmp_path / "room").rglob("*.rst")] == ["a.rst"]
    assert (tmp_path / "room" / "a.rst").stat().st_mtime_ns == before
