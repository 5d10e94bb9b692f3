"""Figures of the gallery: at reduced size all of them, their texts, their files."""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from html import escape
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from symfric.foundation.workers import Crashed, TimedOut
from symfric.gallery import rendering
from symfric.gallery.plate import (
    VERDICTS,
    Plate,
    about,
    chosen,
    figure_of,
    plate_of,
    plates,
    script,
    scripts,
    sections,
    short,
)
from symfric.gallery.rendering import draw, index_page, read, render, together
from symfric.gallery.shared import LOOKS, look
from symfric.laws import ALL_LAWS, POPULATIONS

PLATES = plates()
NAME = "self_tuning/fig_07_shape_factor"
SHAPE = script(NAME)
ROOT = Path(__file__).parents[3]
COSTLY = dict.fromkeys(
    ("generalized_maxwell_slip/fig_05_presliding", "selection/fig_07_box_displacement",
     "generalized_maxwell_slip/fig_02_lag_of_the_generic_model", "self_tuning/fig_13_jitter",
     "laminator_nips/fig_5_7_stick_slip", "generalized_maxwell_slip/fig_07_transition",
     "generalized_maxwell_slip/fig_09_drift", "generalized_maxwell_slip/fig_06_frictional_lag",
     "self_tuning/fig_14_four_mass_positions", "self_tuning/fig_15_four_mass_velocities",
     "self_tuning/fig_16_four_mass_accelerations", "selection/fig_06_pendulum_box",
     "selection/fig_08_box_velocity", "selection/fig_09_box_acceleration",
     "selection/fig_10_pendulum_angle", "selection/fig_11_pendulum_velocity",
     "selection/fig_12_pendulum_acceleration"), pytest.mark.slow,
)  # fmt: skip
"""Figures above a second; others of their modules run in every suite."""


@cache
def quick(name: str) -> Plate:
    """A figure at reduced size, computed once."""
    return PLATES[name](quick=True)


# ---- one figure ----


@pytest.mark.parametrize("name", [pytest.param(n, marks=COSTLY.get(n, ())) for n in PLATES])
def test_a_figure_is_drawn_and_its_claims_hold(name: str) -> None:
    plate = quick(name)
    assert plate.picture.axes
    assert all(axis.has_data() for axis in plate.picture.axes if axis.axison)
    assert plate.numbers and plate.checked and plate.quick and not plate.verdicts
    assert plate.distance <= plate.within
    assert not plt.get_fignums(), "figures are made outside pyplot"
    assert plate.to_dict()["figure"] == plate.figure


def test_every_script_has_the_required_texts() -> None:
    sources = [p.read_text("utf-8") for p in (ROOT / "symfric" / "gallery").glob("*/*.py")]
    assert sum(text.count("\n@plate(") for text in sources) == len(scripts())
    assert not any("pyplot" in text for text in sources)
    for name in scripts():
        texts = about(name)
        assert all(texts.get(part) for part in ("paper", "title", "Compared", "Distance")), name
        assert texts.keys() & VERDICTS.keys(), name
        assert "eleven" not in texts["title"], "a title holds at reduced size, too"
        assert not re.search(r"over [\d.]+ s\b", texts["Distance"]), "and so does the distance"
        assert len(texts["title"]) <= 90, name


def made(
    function: Callable[..., object] = SHAPE, *, distance: float = 0.0, quick: bool = False,
    claims: Mapping[str, object] | None = None, numbers: Mapping[str, float] | None = None,
) -> Plate:  # fmt: skip
    """A figure of given numbers."""
    numbers, claims = numbers or {"a [1]": 1.0}, {"it is": 1} if claims is None else claims
    return plate_of(function, Figure(), distance, numbers, claims, "m", within=0.1, quick=quick)


def test_a_figure_whose_numbers_do_not_support_its_text_is_refused() -> None:
    for options, message in (
        ({"claims": {"it is": True, "two is three": False}}, "got others for 'two is three'; corr"),
        ({"distance": 0.2}, "support its text, got others for a distance within 0.1 m, 0.2;"),
        ({"distance": np.nan, "numbers": {"p [s]": np.inf}}, "finite numbers, got distance, p "),
        ({"numbers": {"period": 1.0}}, "expected numbers with units, got period"),
        ({"function": sum}, "a docstring with Compared, Distance, Reproduced or"),
    ):
        with pytest.raises(ValueError, match=message):
            made(**options)
    assert made(distance=0.1).how_far == "0.1 m (at most 0.1 m)"


def test_verdicts_are_of_three_kinds_and_of_the_full_size() -> None:
    figure = script("selection/fig_07_box_displacement")
    assert [*made(figure).verdicts] == [*VERDICTS.values()]
    assert made(figure).text
    small = made(figure, quick=True)
    assert (small.text, small.verdicts, small.checked) == ("", {}, ("it is",))


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
    parts = {"title": "Force", "text": "Some text.", "Compared": "this with that."}
    parts |= {"Distance": "of both.", "Refuted": "none\n\nbut this."}
    assert sections(doc) == parts


def test_a_figure_shows_itself_in_one_screen() -> None:
    lines = repr(quick(NAME)).splitlines()
    assert lines[0] == "Figure 7: Influence of the shape factor C on the friction force"
    assert "distance: 0 of 4 statements (at most 0" in "".join(lines)
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 100
    assert "<img" in quick(NAME)._repr_html_()  # pyright: ignore[reportPrivateUsage]


def test_names_of_figures_and_papers() -> None:
    assert figure_of("fig_07_shape_factor") == "Figure 7"
    assert figure_of("fig_3_2_forces") == "Figure 3.2"
    assert short("thesis/fig_3_2_forces") == "thesis/fig_3_2"
    assert short(NAME) == "self_tuning/fig_07"
    with pytest.raises(ValueError, match="expected a function fig_07_what_it_shows"):
        figure_of("figure_seven")
    for names in ("self_tuning/fig_07", "fig_07_shape_factor", "self_tuning/fig_7", NAME):
        assert chosen((names,)) == (NAME,)
    assert NAME in chosen(("self_tuning",)) == chosen(("self_tuning/",))
    assert {*chosen(("fig_04",))} == {name for name in chosen(()) if "/fig_04_" in name}
    with pytest.raises(ValueError, match="did you mean self_tuning/fig_"):
        chosen(("self_tuning/fig_0",))


TOGETHER = (
    ("brown_mcphee", "threlfall", "bengisu_akay", "karnopp", "velocity_based", "awrejcewicz",
     "dahl", "lugre", "elasto_plastic", "stick_slip", "gonthier"),
    ("generic_asperity", "gms", "leuven", "maxwell_slip", "lugre", "elasto_plastic", "dahl"),
)  # fmt: skip
"""The laws of two papers, which stand in one picture."""


def test_laws_of_one_picture_look_different() -> None:
    for laws in TOGETHER:
        assert len({str(look(law)) for law in laws}) == len(laws)
    assert {*LOOKS} <= {*ALL_LAWS, *POPULATIONS}
    with pytest.raises(ValueError, match="did you mean lugre"):
        look("lugr")


# ---- files ----


def test_a_figure_is_written_with_its_page(tmp_path: Path) -> None:
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
    failures = rendering._failures  # pyright: ignore[reportPrivateUsage]
    died = failures((NAME, "other"), tmp_path, Crashed("SIGKILL", "out of memory"))
    assert died == {"other": "its process died, SIGKILL: out of memory"}
    hung = failures(("other",), tmp_path, TimedOut(600.0))
    assert hung == {"other": "not finished within its time"}


def test_figures_of_the_same_runs_share_a_process() -> None:
    groups = together(chosen(()))
    assert sorted(name for group in groups for name in group) == sorted(chosen(()))
    assert all(len({name.split("/")[0] for name in group}) == 1 for group in groups)
    belt = {name for name in chosen(("selection",)) if "_belt_" in name}
    assert len(belt) == 4
    assert belt in [{*group} for group in groups]


def test_a_failure_does_not_stop_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(name: str, folder: Path, quick: bool = False) -> None:
        raise ArithmeticError(f"no {name}")

    monkeypatch.setattr(rendering, "draw", broken)
    found = rendering._rendered(((NAME, "other"), str(tmp_path), True))  # pyright: ignore
    assert found == {name: f"ArithmeticError: no {name}" for name in (NAME, "other")}


def test_results_of_an_earlier_call_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of three figures is drawn, one fails, and then an interrupt ends the call."""
    first, second, third = names = chosen(("laminator_nips",))[:3]
    texts = dict.fromkeys(("paper", "figure", "text", "compared", "measure", "note", "how_far"), "")
    lists = {"verdicts": {}, "checked": [], "numbers": {}, "quick": True, "seconds": 0.1}

    def put(name: str, title: str) -> None:
        record = texts | lists | {"name": name, "title": title, "picture": f"{name}.png"}
        (tmp_path / f"{name}.json").write_text(json.dumps(record), "utf-8")

    (tmp_path / first).parent.mkdir()
    for name in names:
        put(name, "before")
        (tmp_path / f"{name}.png").write_bytes(b"before")

    def outcomes(*_: object) -> Iterator[tuple[int, dict[str, str]]]:
        put(first, "now")
        yield 0, {}
        yield 1, {second: "ValueError: no"}
        raise KeyboardInterrupt

    monkeypatch.setattr(rendering, "outcomes", outcomes)
    monkeypatch.setattr(rendering, "together", lambda names: [(n,) for n in names])  # pyright: ignore
    done = render(tmp_path, names, quick=True)
    assert {name: record["title"] for name, record in done.records.items()} == {first: "now"}
    assert (done.failures, done.left) == ({second: "ValueError: no"}, 1)
    assert not (tmp_path / f"{third}.json").exists()
    assert not [*tmp_path.rglob("*.png")]


@pytest.mark.heavy
def test_a_gallery_is_rendered_in_processes(tmp_path: Path) -> None:
    fractions: list[float] = []
    done = render(tmp_path, [NAME], quick=True, workers=1, progress=fractions.append)
    assert (done.left, fractions, [*done.records], done.failures) == (0, [1.0], [NAME], {})
    assert "Figure 7" in (tmp_path / "index.html").read_text(encoding="utf-8")
