"""Pages made from the code are complete; results of the build are kept until the code changes."""

import json
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

from docs.machine import build, items, lists, measure
from docs.machine.lists import MODULES, catalogue, known, place, reference_pages
from docs.machine.markdown import block, cell, directive, plain, table
from symfric import ALL_LAWS, POPULATIONS, LuGre, parameters
from symfric.bench.interop import MOVES, RUNS
from symfric.bench.report import Report
from symfric.cli.app import COMMANDS
from symfric.gallery import scripts
from symfric.gallery.rendering import Gallery, Record
from symfric.scenes import ALL_SCENES

needs_sphinx = pytest.mark.skipif(find_spec("sphinx") is None, reason="needs Sphinx (extra docs)")


def test_pieces_of_markdown() -> None:
    assert plain("a * b `x*y` [1] $") == r"a \* b `x*y` \[1] \$"
    shown = [cell(x) for x in ("", "- a", "1. b", 2, "a\nb")]
    assert shown == [r"\-", r"\- a", r"1\. b", "2", "a b"]
    shown = table(["a", "b"], [["x", 1.5]], "numbers")
    assert ":header-rows: 1" in shown and ":class: numbers" in shown and "* - x\n  - 1.5" in shown
    assert ":stub-columns: 1" in table((), [["x", "y"]]) and ":class: facts" in table((), [["x"]])
    assert table((), []) == ""
    assert directive("note", "", block("x")).startswith("````{note}\n```text")


def test_every_law_has_a_page_with_formula_picture_and_parameters() -> None:
    pages = items.law_pages()
    assert {*ALL_LAWS, *POPULATIONS, *items.MADE_OF_LAWS, "index"} == {*pages}
    for name in ALL_LAWS:
        assert f".. autoclass:: symfric.{ALL_LAWS[name].__name__}\n" in pages[name]
        assert f"/made/laws/{name}.png" in pages[name]
        assert f":file: ../made/sliders/{name}.html" in pages[name]
    assert all("it has no sliders" in pages[name] for name in POPULATIONS)
    assert all(f"`{p}`" in pages["lugre"] for p in parameters(LuGre()))
    assert r"$\sigma_{0}$" in pages["lugre"]
    families = {items.family(law) for law in items.every().values()}
    assert families == {*items.FAMILIES} - {items.WITH_DATA}
    assert items.signature(LuGre).startswith("(mu_s=")
    assert [items.bounds(*b) for b in ((0, 1), (0, float("inf")), (-float("inf"), 2))] == [
        "0 ... 1", "≥ 0", "≤ 2"
    ]  # fmt: skip


def test_every_scene_has_a_page_with_its_presets() -> None:
    pages = items.scene_pages()
    assert {*ALL_SCENES, "index"} == {*pages}
    for name, kind in ALL_SCENES.items():
        assert all(f"`{preset}`" in pages[name] for preset in kind.presets)
        assert f".. autoclass:: symfric.scenes.{kind.__name__}\n" in pages[name]


@needs_sphinx
def test_every_public_name_is_documented_once() -> None:
    pages = reference_pages()
    text = "".join(pages[module] for module in MODULES if module in pages)
    for public in (p for names in catalogue().values() for p in names):
        kinds = ("autoclass", "autofunction", "autoexception", "py:data")
        entries = sum(text.count(f"{kind}:: {public.full}\n") for kind in kinds)
        assert entries == (not public.page), public.full
    page = pages["commands"]
    assert all(f"(symfric-{name})=\n## symfric {name}\n" in page for name in COMMANDS)
    assert "* `--law NAME[,NAME]`" in page and "```console\n$ symfric run rabinowicz" in page
    assert "Laws made of laws" in text or "ALL_LAWS" in text
    assert "drifts under vibration" in pages["limits"]
    assert all(f"[{name}](../laws/{name}.md)" in pages["limits"] for name in ALL_LAWS)
    assert "Jing and Mi, Investigation of Selection Mechanism" in pages["literature"]
    assert "@software" in pages["literature"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("simulate", ("py", "obj", "symfric.simulate")),
        ("ocp.solve()", ("py", "obj", "ocp.solve")),
        ("LuGre", ("std", "doc", "/laws/lugre")), ("lugre", ("std", "doc", "/laws/lugre")),
        ("symfric bench ivp --quick", ("std", "ref", "symfric-bench")),
        ("rabinowicz", ("std", "doc", "/scenes/rabinowicz")),
        ("symfric.codegen", ("std", "doc", "/reference/symfric.codegen")),
        ("mu_s", None), ("symfric -h", None), ("simulate(x)", None),
    ],
)  # fmt: skip
def test_names_lead_to_their_documentation(name: str, expected: object) -> None:
    assert place(name) == expected
    assert known()["Problem"].full == "ocp.Problem"


def test_every_example_has_its_docstring_and_code() -> None:
    pages = lists.example_pages()
    assert len(pages) == len(lists.EXAMPLES) + 1
    assert "J = 40 + 0.5 / (1 - 4 tanh(1/4)) N^2 s" in pages["out_and_back"]
    assert "def problem()" in pages["out_and_back"]


def test_publications_are_collected() -> None:
    doc = "T.\n\nSource: A, J. X 1(2), 1999, p. 3; B,\nThesis 2001 (part); with words.\n\nMore: C."
    assert [*lists.sources(doc)] == [
        "A, J. X 1(2), 1999, p. 3", "B, Thesis 2001 (part); with words"
    ]  # fmt: skip
    assert any(where.startswith("symfric.integrator.") for _, where in lists.methods())
    named = [name for names in lists.laws().values() for name in names]
    assert sorted(named) == sorted(ALL_LAWS | POPULATIONS)


# ---- measurements ----

KEYS = ("title", "about", "command", "date", "commit", "machine", "load", "seconds", "tables")
"""Keys that `docs.machine.measure` writes; "short", a hand-written summary, may be added."""
SHORT = ("command", "date", "commit", "machine", "tables")
"""Keys of "short": hand-written tables of a longer measurement."""


def test_stored_measurements_are_complete() -> None:
    stored = measure.stored()
    assert {"integrator", "ivp", "ensemble", "multibody", "ocp", "interop"} <= {*stored}
    for name, found in stored.items():
        keys = {*KEYS} if "tables" in found else {"title", "about"}
        assert {*found} - {"short"} == keys and ("tables" in found or "short" in found), name
        short = found.get("short", dict.fromkeys(SHORT, "-") | {"tables": []})
        assert {*short} == {*SHORT} and all(short[k] or k == "tables" for k in short)
        for one in [*found.get("tables", ()), *short["tables"]]:
            assert all({*row} == {*one["rows"][0]} for row in one["rows"]), name
    page = measure.page()
    assert "symfric bench ivp" in page and "Summarised by hand" in page and "; load " in page


def test_tools_are_compared_in_columns() -> None:
    shown = measure.tables()
    moves = measure.stored()["interop"]["tables"][0]["rows"]
    for row in moves:
        if not row["status"]:
            miss = f"{float(row['miss [m]']):.1e}".replace("e-0", "e-")
            text = f"{miss}, {row['iterations']}, {row['processor time [s]']} s"
            assert text in shown["interop_moves"], row
    late = sum(m["status"] == "out of time" for m in moves)
    assert shown["interop_moves"].count("out of time") == late
    assert "`cvodes`" in shown["interop_integrators"] and "stops" in shown["interop_integrators"]
    assert "symfric bench interop" in shown["interop_by"]


def test_a_measurement_is_stored_with_machine_load_and_commit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    move = {"tool": "opti", "route": "flow", "law": "lugre", "cost J [N^2 s]": 1.11449}
    result = Report(tables={MOVES: [move], RUNS: [{"integrator": "cvodes", "law": "lugre"}]})
    monkeypatch.setattr(measure, "STORED", tmp_path)
    monkeypatch.setattr("symfric.bench.measure", lambda subject, quick, progress: result)
    monkeypatch.setattr(measure, "commit", lambda: "abc")
    path = tmp_path / "interop.json"
    short = dict.fromkeys(SHORT, "-") | {"tables": []}
    path.write_text(json.dumps({"title": "T", "about": "A.", "short": short}), "utf-8")
    assert measure.main(["--quick", "interop"]) == 0
    found = json.loads(path.read_text("utf-8"))
    assert {*found} == {*KEYS, "short"}
    assert (found["title"], found["about"], found["short"]) == ("T", "A.", short)
    assert found["command"] == "symfric bench interop --quick"
    assert all(float(load) >= 0 for load in found["load"].split(" to "))
    assert found["tables"][0] == {"title": MOVES, "rows": [move | {"cost J [N^2 s]": "1.11"}]}
    assert measure.main(["nothing"]) == measure.main([]) == 2
    assert "expected some of integrator" in capsys.readouterr().out


# ---- results that are kept ----


def test_docstrings_and_comments_are_no_code(tmp_path: Path) -> None:
    texts = (
        '"""A."""\n\n\ndef f(x):\n    """B."""\n    return x + 1  # so\n',
        "def f(x):\n    '''C.'''\n\n    return (x + 1)\n",
        "def f(x):\n    return x + 2\n",
        'def f(x):\n    """B."""\n',
    )
    codes = list[str]()
    for number, text in enumerate(texts):
        (tmp_path / str(number)).write_text(text, "utf-8")
        codes.append(build.code_of(tmp_path / str(number)))
    assert codes[0] == codes[1] and len({*codes}) == 3
    bare = "def f(x):\n    return x\n"
    documented = bare.replace("\n ", '\n    """Title.\n\n    More.\n    """\n ', 1)
    assert build.without_docstring(f'"""M."""\n\n{documented}\ny = 1\n', "f") == bare
    assert build.without_docstring(f"{bare}\ny = 1\n", "f") == bare


def test_results_with_another_key_are_stale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SYMFRIC_DOCS", raising=False)
    assert not build.is_fresh(tmp_path, "a")
    (tmp_path / ".key").write_text("a")
    assert build.is_fresh(tmp_path, "a")
    assert not build.is_fresh(tmp_path, "b")
    assert not build.is_fresh(tmp_path, "a", ["missing.png"])
    monkeypatch.setenv("SYMFRIC_DOCS", "keep")
    assert build.is_fresh(tmp_path, "b")
    assert not build.is_fresh(tmp_path, "a", ["missing.png"])


def test_pages_of_an_earlier_build_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "DOCS", tmp_path)
    build.write("folder", {"a": "A", "b/c": "C"})
    before = (tmp_path / "folder" / "a.md").stat().st_mtime_ns
    build.write("folder", {"a": "A"})
    assert [p.name for p in (tmp_path / "folder").rglob("*.md")] == ["a.md"]
    assert (tmp_path / "folder" / "a.md").stat().st_mtime_ns == before


@pytest.mark.parametrize(
    ("changed", "stale"),
    [
        ("symfric/gallery/shared.py", lambda name: True),
        ("symfric/gallery/self_tuning/machines.py", lambda name: name.startswith("self_tuning/")),
        ("symfric/gallery/self_tuning/__init__.py", lambda name: name.startswith("self_tuning/")),
    ],
)
def test_a_figure_depends_on_its_paper_and_on_shared_code(
    changed: str, stale: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "code_key", lambda: "")
    before, place = build.keys(), build.ROOT / changed
    assert place.is_file()
    read, of = Path.read_text, build.code_of

    def edited(path: Path, *how: str) -> str:
        return read(path, *how) + ("\nCHANGED = 1\n" if path == place else "")

    monkeypatch.setattr(Path, "read_text", edited)
    monkeypatch.setattr(
        build, "code_of", lambda path: of.__wrapped__(path) if path == place else of(path)
    )
    after = build.keys()
    assert {name for name in before if before[name] != after[name]} == {*filter(stale, scripts())}


def test_a_figure_that_failed_is_computed_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SYMFRIC_DOCS", raising=False)
    monkeypatch.setattr(build, "GALLERY", tmp_path)
    monkeypatch.setattr(build, "KEYS", tmp_path / "keys.json")
    monkeypatch.setattr(build, "keys", lambda: {"good": "1", "bad": "2"})
    there = dict[str, object]()
    monkeypatch.setattr(build, "read", lambda _: there)
    requested = list[list[str]]()

    def render(folder: Path, names: list[str], **_: object) -> Gallery:
        requested.append(names)
        there["good"] = {}
        made: dict[str, Record] = {name: {} for name in names if name == "good"}
        return Gallery(folder, tuple(names), made, {"bad": "no"}, 0.0)

    monkeypatch.setattr(build, "render", render)
    assert build.make_gallery(lambda _: None) == ["gallery 'bad': no"]
    assert json.loads((tmp_path / "keys.json").read_text("utf-8")) == {"good": "1"}
    build.make_gallery(lambda _: None)
    assert requested == [["good", "bad"], ["bad"]]


@needs_sphinx
def test_formulas_and_signatures_of_sphinx() -> None:
    from docutils import nodes  # noqa: PLC0415

    from docs.machine.sphinx_pages import mathml, short  # noqa: PLC0415

    for written in (r"|a| + |b|", r"\lvert a\rvert + \lvert b \rvert"):
        found = mathml(nodes.math(written, written), as_block=False)
        assert found.count('lspace="0" rspace="0">|</mo>') == 4, found
    array = "~numpy.ndarray[tuple[~typing.Any, ...], ~numpy.dtype[~numpy.float64]]"
    given, back = short(None, "", "", None, None, f"(t: {array}, n: int)", array)
    assert (given, back) == ("(t: NDArray[float64], n: int)", "NDArray[float64]")
    assert short(None, "", "", LuGre, None, "(x: int)", None)[0] == items.signature(LuGre)
