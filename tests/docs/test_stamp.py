"""What pictures of the pages depend on: what they come from, and nothing else."""

import json
from pathlib import Path

import pytest

from docs.machine import generated, made
from symfric.gallery import scripts
from symfric.gallery.rendering import Gallery, Record

CRANK = tuple(f"self_tuning/fig_{k}_" for k in range(17, 22))


def test_docstrings_comments_and_places_are_no_code(tmp_path: Path) -> None:
    texts = {
        "one": '"""A."""\n\n\ndef f(x):\n    """B."""\n    return x + 1  # so\n',
        "same": "def f(x):\n    '''C.'''\n\n    return (x + 1)\n",
        "other": "def f(x):\n    return x + 2\n",
        "empty": 'def f(x):\n    """B."""\n',
    }
    found = dict[str, str]()
    for name, text in texts.items():
        (tmp_path / name).write_text(text, "utf-8")
        found[name] = made.code_of(tmp_path / name)
    assert found["one"] == found["same"]
    assert len({*found.values()}) == 3


def test_what_was_made_with_another_key_is_stale(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SYMFRIC_DOCS", raising=False)
    assert not made.is_fresh(tmp_path, "a")
    made.stamped(tmp_path, "a")
    assert made.is_fresh(tmp_path, "a")
    assert not made.is_fresh(tmp_path, "b")
    monkeypatch.setenv("SYMFRIC_DOCS", "keep")
    assert made.is_fresh(tmp_path, "b")


@pytest.mark.parametrize(
    ("changed", "papers"),
    [
        ("symfric/gallery/shared.py", None),
        ("symfric/gallery/rendering.py", None),
        ("symfric/gallery/plate.py", None),
        ("symfric/gallery/self_tuning/machines.py", "self_tuning"),
        ("symfric/gallery/self_tuning/__init__.py", "self_tuning"),
        ("symfric/gallery/self_tuning/crank.py", CRANK),
        ("symfric/gallery/pages.py", ""),
    ],
)
def test_a_plate_depends_on_its_script_its_paper_and_what_the_gallery_shares(
    changed: str, papers: str | tuple[str, ...] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`papers` begins the names of the plates that are computed anew, None for all."""
    before = generated.keys()
    place = generated.ROOT / changed
    assert place.is_file()
    read, of = Path.read_text, made.code_of

    def edited(path: Path, *how: str) -> str:
        return read(path, *how) + ("\nCHANGED = 1\n" if path == place else "")

    def anew_for_the_place(path: Path) -> str:
        return of.__wrapped__(path) if path == place else of(path)

    monkeypatch.setattr(Path, "read_text", edited)
    monkeypatch.setattr(generated, "code_of", anew_for_the_place)
    after = generated.keys()
    anew = {name for name in before if before[name] != after[name]}
    expected = {n for n in scripts() if papers is None or (papers and n.startswith(papers))}
    assert anew == expected


def test_a_plate_that_failed_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SYMFRIC_DOCS", raising=False)
    monkeypatch.setattr(generated, "FOLDER", tmp_path)
    monkeypatch.setattr(generated, "KEYS", tmp_path / "keys.json")
    monkeypatch.setattr(generated, "keys", lambda: {"good": "1", "bad": "2"})
    there = dict[str, object]()
    monkeypatch.setattr(generated, "read", lambda _: there)  # pyright: ignore
    asked = list[list[str]]()

    def render(folder: Path, names: list[str], **_: object) -> Gallery:
        asked.append(names)
        there["good"] = {}
        made: dict[str, Record] = {name: {} for name in names if name == "good"}
        return Gallery(folder, tuple(names), made, {"bad": "no"}, 0.0)

    monkeypatch.setattr(generated, "render", render)
    said = list[str]()
    assert generated.make_gallery(said.append) == ["gallery 'bad': no"]
    assert json.loads((tmp_path / "keys.json").read_text("utf-8")) == {"good": "1"}
    generated.make_gallery(said.append)
    assert asked == [["good", "bad"], ["bad"]]
