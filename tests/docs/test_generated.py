"""Pages that are made of the code hold all of it."""

from pathlib import Path

import pytest

from docs.machine import items, lists, measure
from docs.machine.generated import stale, write
from docs.machine.lists import place, reference_pages
from docs.machine.names import FRONTS, catalogue, known, linked
from symfric import ALL_LAWS, POPULATIONS, LuGre, parameters
from symfric.cli.app import COMMANDS, prose_and_examples
from symfric.scenes import ALL_SCENES


def test_every_package_has_a_page_or_stands_on_that_of_its_parent() -> None:
    pages = reference_pages()
    for front in FRONTS:
        found = place(front)
        assert found is not None
        assert found[2].removeprefix("/reference/") in pages


def test_every_law_has_a_page_with_formula_picture_and_parameters() -> None:
    pages = items.law_pages()
    assert {*ALL_LAWS, *POPULATIONS, *items.MADE_OF_LAWS, "index"} == {*pages}
    for name in ALL_LAWS:
        assert ".. math::" in pages[name], name
        assert f"/made/laws/{name}.png" in pages[name]
        assert f".. py:class:: symfric.{ALL_LAWS[name].__name__}(" in pages[name]
    assert all(f"``{p}``" in pages["lugre"] for p in parameters(LuGre()))
    families = items.every().values()
    assert {items.family(law) for law in families} == {*items.FAMILIES} - {"Made of laws and data"}


def test_every_scene_has_a_page_with_its_parameters_and_presets() -> None:
    pages = items.scene_pages()
    assert {*ALL_SCENES, "index"} == {*pages}
    for name, kind in ALL_SCENES.items():
        assert all(f"``{preset}``" in pages[name] for preset in kind.presets)
        assert f".. py:class:: symfric.scenes.{kind.__name__}(" in pages[name]


def test_every_command_stands_with_its_options() -> None:
    page = lists.command_page()
    assert all(f"\nsymfric {name}\n" in page for name in COMMANDS)
    assert "``--law NAME``" in page and "required" in page
    assert prose_and_examples("A.\n\nExample: x y\nz") == ("A.", ["x y z"])


def test_every_public_name_stands_once() -> None:
    pages = "".join(reference_pages().values())
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
    pages = lists.example_pages()
    assert len(pages) == len(lists.EXAMPLES) + 1
    assert "J = 40 + 0.5 / (1 - 4 tanh(1/4)) N^2 s" in pages["out_and_back"]
    assert "def problem()" in pages["out_and_back"]


def test_stored_measurements_say_by_what_where_and_when() -> None:
    stored = measure.stored()
    assert {"integrator", "ivp", "ensemble", "multibody", "ocp", "interop"} <= {*stored}
    for name, found in stored.items():
        measured = {"tables"} <= {*found}
        keys = {*measure.KEYS} if measured else {"title", "about"}
        assert {*found} - {"short"} == keys and (measured or "short" in found), name
        short = found.get("short", dict.fromkeys(measure.SHORT, "-") | {"tables": []})
        assert {*short} == {*measure.SHORT} and all(short[k] or k == "tables" for k in short)
        for table in [*found.get("tables", ()), *short["tables"]]:
            assert all({*row} == {*table["rows"][0]} for row in table["rows"]), name
    assert "symfric bench ivp" in measure.page()


def test_tools_stand_side_by_side_as_they_were_measured() -> None:
    shown = measure.tables()
    moves = measure.stored()["interop"]["tables"][0]["rows"]
    for line in moves:
        if not line["status"]:
            miss = f"{float(line['miss [m]']):.1e}".replace("e-0", "e-")
            said = f"{miss}, {line['iterations']}, {line['processor time [s]']} s"
            assert said in shown["interop_moves"], line
    late = sum(m["status"] == "out of time" for m in moves)
    assert shown["interop_moves"].count("out of time") == late
    assert "``cvodes``" in shown["interop_integrators"]
    assert "symfric bench interop" in shown["interop_by"]


def test_names_in_pages_lead_to_where_they_are_documented() -> None:
    assert place("simulate") == ("py", "obj", "symfric.simulate")
    assert place("ocp.solve()") == ("py", "obj", "ocp.solve")
    assert place("LuGre") == place("lugre") == ("std", "doc", "/laws/lugre")
    assert place("symfric bench ivp --quick") == ("std", "ref", "symfric-bench")
    assert place("rabinowicz") == ("std", "doc", "/scenes/rabinowicz")
    assert place("symfric.codegen") == ("std", "doc", "/reference/symfric.codegen")
    assert place("mu_s") is place("symfric -h") is place("simulate(x)") is None


def test_publications_are_gathered_from_where_they_are_used() -> None:
    said = "T.\n\nSource: A, J. X 1(2), 1999, p. 3; B,\nThesis 2001 (part); with words.\n\nMore: C."
    assert [*lists.sources(said)] == [
        "A, J. X 1(2), 1999, p. 3",
        "B, Thesis 2001 (part); with words",
    ]
    methods = dict(lists.methods())
    assert any(where == "symfric.integrator.step.tangent" for where in methods.values())
    named = [name for names in lists.laws().values() for name in names]
    assert sorted(named) == sorted(ALL_LAWS | POPULATIONS)
    page = lists.literature_page()
    assert "Jing and Mi, Investigation of Selection Mechanism" in page and "@software" in page


def test_limits_of_laws_are_gathered() -> None:
    assert "drifts under vibration" in lists.limits(LuGre)
    page = lists.limit_page()
    assert all(f":doc:`{name} </laws/{name}>`" in page for name in ALL_LAWS)


def test_pages_that_are_none_any_more_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("docs.machine.generated.DOCS", tmp_path)
    write("room", {"a": "A", "b/c": "C"})
    before = (tmp_path / "room" / "a.rst").stat().st_mtime_ns
    assert stale(tmp_path / "room", {"a": "A"}) == [tmp_path / "room" / "b" / "c.rst"]
    write("room", {"a": "A"})
    assert [p.name for p in (tmp_path / "room").rglob("*.rst")] == ["a.rst"]
    assert (tmp_path / "room" / "a.rst").stat().st_mtime_ns == before
