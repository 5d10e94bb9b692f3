"""Figures for a printed page: width, text, legends, fonts."""

from functools import cache
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from symfric import BrownMcPhee, LuGre, Trajectory, for_print, rabinowicz, simulate
from symfric.results.pictures import plot_trajectories

PLAIN = 10.0
"""Ordinary text of Matplotlib [pt]."""


@cache
def runs() -> dict[str, Trajectory]:
    laws = {"Brown-McPhee": BrownMcPhee(), "LuGre": LuGre(), "another name, rather long": LuGre()}
    return {name: simulate(rabinowicz(law), 1.0) for name, law in laws.items()}


@pytest.fixture(name="figure")
def _figure() -> Figure:
    return plot_trajectories(runs(), ["x", "friction"])


def sizes(figure: Figure) -> set[float]:
    figure.draw_without_rendering()
    texts = [one for one in figure.findobj(Text) if one.get_text() and one.get_visible()]
    return {round(float(one.get_fontsize()), 3) for one in texts}


def test_width_and_text_are_what_is_asked_for_and_everything_is_on_the_page(figure: Figure) -> None:
    before = sizes(figure)
    wide = figure.legends[0].get_window_extent().width
    assert wide > 85 / 25.4 * figure.dpi  # it would be cut off
    assert for_print(figure) is figure
    assert figure.get_size_inches()[0] == pytest.approx(85 / 25.4)
    assert sizes(figure) == {round(size * 8 / PLAIN, 3) for size in before}
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 3
    assert legend.get_window_extent().width <= figure.bbox.width
    assert sizes(for_print(figure, width=85.0, height=70.0, text=PLAIN)) == before
    assert figure.get_size_inches()[1] == pytest.approx(70 / 25.4)


def test_text_in_pdf_is_truetype(figure: Figure, tmp_path: Path) -> None:
    for_print(figure, tmp_path / "figure.pdf")
    content = (tmp_path / "figure.pdf").read_bytes()
    assert b"/TrueType" in content or b"/CIDFontType2" in content
    assert b"/Type3" not in content


def test_bad_sizes_and_endings_are_refused(figure: Figure) -> None:
    for arguments, message in (
        ({"width": 0.0}, "for_print: width: expected .*> 0"),
        ({"text": -8.0}, "for_print: text"),
        ({"height": "x"}, "for_print: height"),
        ({"path": "figure.docx"}, "ending: expected one of"),
    ):
        with pytest.raises(ValueError, match=message):
            for_print(figure, **arguments)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="a figure, such as run"):
        for_print(None)  # type: ignore[arg-type]
