"""Plates on disk: all that work, and why the others do not."""

import json
from collections.abc import Iterator
from html import escape
from pathlib import Path

import pytest

from symfric.gallery import rendering
from symfric.gallery.plate import chosen, figure_of, plate_of, plates, script, sections, short
from symfric.gallery.rendering import draw, index_page, read, render, together
from symfric.stress.campaign import Crashed, TimedOut

NAME = "self_tuning/fig_07_shape_factor"


def test_a_docstring_falls_into_its_parts() -> None:
    doc = """Force.

        Some
        text.

        Compared: this
        with that.
        Distance: of both.

        Refuted: none

        but this.
        """
    assert sections(doc) == {
        "title": "Force",
        "text": "Some text.",
        "Compared": "this with that.",
        "Distance": "of both.",
        "Refuted": "none\n\nbut this.",
    }


def test_a_function_is_named_after_its_figure() -> None:
    assert figure_of("fig_07_shape_factor") == "Figure 7"
    assert figure_of("fig_3_2_forces") == "Figure 3.2"
    assert short("thesis/fig_3_2_forces") == "thesis/fig_3_2"
    assert short(NAME) == "self_tuning/fig_07"
    with pytest.raises(ValueError, match="expected a function fig_07_what_it_shows"):
        figure_of("figure_seven")


def test_a_name_may_be_a_figure_or_a_paper() -> None:
    assert chosen((NAME,)) == chosen(("self_tuning/fig_07",)) == (NAME,)
    assert NAME in chosen(("self_tuning",)) == chosen(("self_tuning/",))
    assert {*chosen(("self_tuning",))} <= {*chosen(())}
    assert {*chosen(("fig_04",))} == {name for name in chosen(()) if "/fig_04_" in name}
    assert chosen(("fig_07_shape_factor",)) == chosen(("self_tuning/fig_7",)) == (NAME,)
    with pytest.raises(ValueError, match="did you mean self_tuning/fig_"):
        chosen(("self_tuning/fig_0",))


def test_a_plate_refuses_numbers_that_are_not_finite() -> None:
    with pytest.raises(ValueError, match="expected finite numbers, got distance, period"):
        numbers = {"period [s]": float("inf")}
        plate_of(script(NAME), None, float("nan"), numbers, {}, "m", within=1.0, quick=True)  # type: ignore[arg-type]


def test_a_plate_whose_text_is_untrue_is_not_drawn() -> None:
    claims = {"it is round": True, "it is flat": False}
    with pytest.raises(
        ValueError, match=r"bear out its text, got others for 'it is flat'; correct"
    ):
        plate_of(script(NAME), None, 0.1, {}, claims, "m", within=0.1, quick=True)  # type: ignore[arg-type]
    held = plate_of(script(NAME), None, 0.1, {}, {"it is round": 1}, "m", within=0.1, quick=True)  # type: ignore[arg-type]
    assert held.checked == ("it is round",)


def test_a_plate_is_written_whole(tmp_path: Path) -> None:
    record = draw(NAME, tmp_path, quick=True)
    assert (tmp_path / f"{NAME}.png").stat().st_size > 10_000
    assert json.loads((tmp_path / f"{NAME}.json").read_text()) == record == read(tmp_path)[NAME]
    page = index_page([record])
    assert f'src="{NAME}.png"' in page
    assert record["how_far"] in page
    assert all(escape(claim) in page for claim in record["checked"])
    assert "checked at reduced size" in page
    assert "the law is the reconstruction of <code>SelfTuning</code>" in page
    assert "observation reproduced" not in page


def test_a_plate_shows_itself_in_one_screen() -> None:
    plate = plates()[NAME](quick=True)
    told = repr(plate).splitlines()
    assert told[0] == "Figure 7: Influence of the shape factor C on the friction force"
    assert "how far: 0 of 4 statements (at most 0" in repr(plate)
    assert len(told) <= 25
    assert max(map(len, told)) <= 100
    assert "<img" in plate._repr_html_()  # pyright: ignore[reportPrivateUsage]


def test_plates_that_died_are_told_apart_from_those_that_were_done(tmp_path: Path) -> None:
    draw(NAME, tmp_path, quick=True)
    found = rendering._failures((NAME, "other"), tmp_path, Crashed("SIGKILL", "out of memory"))  # pyright: ignore[reportPrivateUsage]
    assert found == {"other": "its process died, SIGKILL: out of memory"}
    hung = rendering._failures(("other",), tmp_path, TimedOut(600.0))  # pyright: ignore[reportPrivateUsage]
    assert hung == {"other": "no end within its time"}


def test_figures_of_the_same_runs_share_a_process() -> None:
    groups = together(chosen(()))
    assert sorted(name for group in groups for name in group) == sorted(chosen(()))
    assert all(len({name.split("/")[0] for name in group}) == 1 for group in groups)
    belt = {name for name in chosen(("selection",)) if "_belt_" in name}
    assert len(belt) == 4
    assert belt in [{*group} for group in groups]


def test_one_that_fails_is_told_beside_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(name: str, folder: Path, quick: bool = False) -> None:
        raise ArithmeticError(f"no {name}")

    monkeypatch.setattr(rendering, "draw", broken)
    task = ((NAME, "other"), str(tmp_path), True)
    assert rendering._rendered(task) == {  # pyright: ignore[reportPrivateUsage]
        NAME: f"ArithmeticError: no {NAME}",
        "other": "ArithmeticError: no other",
    }


def test_what_was_there_before_is_not_what_was_done_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of three is drawn, one fails, and then somebody interrupts."""
    names = [n for n in chosen(()) if n.startswith("laminator_nips/")][:3]
    first, second, third = names
    folder = tmp_path / "laminator_nips"
    folder.mkdir()
    texts = dict.fromkeys(("paper", "figure", "text", "compared", "measure", "note", "unit"), "")
    kept = {"verdicts": {}, "within": 0.0, "checked": [], "how_far": "0", "numbers": {}}
    record = texts | kept | {"quick": True, "seconds": 0.1, "distance": 0.0, "symfric": "0"}

    def put(name: str, title: str) -> None:
        said = record | {"name": name, "title": title, "picture": f"{name}.png"}
        (tmp_path / f"{name}.json").write_text(json.dumps(said), "utf-8")

    for name in names:
        put(name, "before")
        (tmp_path / f"{name}.png").write_bytes(b"before")

    class OneByOne:
        """Answers without processes."""

        def __init__(self, *_: object) -> None:
            pass

        def outcomes(self) -> Iterator[tuple[int, dict[str, str]]]:
            put(first, "now")
            yield 0, {}
            yield 1, {second: "ValueError: no"}
            raise KeyboardInterrupt

        def stop(self) -> None:
            pass

    monkeypatch.setattr(rendering, "WorkerPool", OneByOne)
    monkeypatch.setattr(rendering, "together", lambda names: [(n,) for n in names])  # pyright: ignore
    done = render(tmp_path, names, quick=True)
    assert {name: kept["title"] for name, kept in done.records.items()} == {first: "now"}
    assert (done.failures, done.left) == ({second: "ValueError: no"}, 1)
    assert not (tmp_path / f"{third}.json").exists()
    assert not [*tmp_path.rglob("*.png")]


@pytest.mark.heavy
def test_a_gallery_is_rendered_in_processes(tmp_path: Path) -> None:
    told: list[float] = []
    done = render(tmp_path, [NAME], quick=True, workers=1, progress=told.append)
    assert done.left == 0
    assert told[-1] == 1.0
    assert told == sorted(told)
    assert {*done.records} == {NAME}
    assert not done.failures
    assert "Figure 7" in (tmp_path / "index.html").read_text(encoding="utf-8")
