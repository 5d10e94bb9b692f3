"""Figures outside pyplot, for print, and with colours for all eyes."""

import subprocess
import sys
from functools import cache
from io import BytesIO
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from symfric import BrownMcPhee, LuGre, Trajectory, for_print, rabinowicz, simulate
from symfric.foundation.numeric import Array
from symfric.foundation.panels import Picture, blank, grid, panels, save
from symfric.foundation.style import COLOURS, CYCLE, DASHES, line
from symfric.results.pictures import plot_trajectories


def test_figures_are_unknown_to_pyplot_and_change_no_settings() -> None:
    before = dict(mpl.rcParams)
    figure, axes = panels(3)
    assert (len(axes), len(figure.axes)) == (3, 3)
    assert save(figure, None) is figure
    grid(2, 2)
    assert plt.get_fignums() == []
    assert dict(mpl.rcParams) == before


@pytest.mark.slow
def test_drawing_does_not_even_import_pyplot() -> None:
    code = (
        "import sys; from symfric import LuGre, rabinowicz, simulate\n"
        "from symfric.figures.pictures import plot_laws\n"
        "plot_laws({'lugre': LuGre()}); simulate(rabinowicz(LuGre()), 0.1, samples=5).plot()\n"
        "assert 'matplotlib' in sys.modules; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_notebook_shows_a_figure_once() -> None:
    figure, (axis,) = panels(1)
    axis.plot([0, 1], [0, 1])
    assert isinstance(figure, Picture)
    pixels = getattr(figure, "_repr_png_")()  # noqa: B009  (what IPython calls)
    shown = imread(BytesIO(pixels), format="png")
    width, height = figure.get_size_inches()
    assert shown.shape[:2] == (round(100 * height), round(100 * width))
    others = ("_repr_html_", "_repr_svg_", "_repr_jpeg_", "_repr_mimebundle_")
    assert not any(getattr(figure, name, lambda: None)() for name in others)


def test_a_window_is_refused_where_there_is_none() -> None:
    with pytest.raises(ValueError, match=r"backend with windows, got 'agg'; pass path= to plot"):
        blank().show()
    assert plt.get_fignums() == []


def test_a_window_takes_the_figure_where_there_are_some(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[object] = []

    class Manager:
        def __init__(self, canvas: object) -> None:
            self.canvas = canvas

    def opened(**_: object) -> object:
        window = Picture()
        window.canvas.manager = Manager(window.canvas)  # type: ignore[assignment]
        shown.append(window.canvas)
        return window

    monkeypatch.setattr(plt, "figure", opened)
    monkeypatch.setattr(plt, "show", lambda: shown.append("shown"))
    figure = blank()
    figure.show()
    assert shown == [figure.canvas, "shown"]
    assert figure.canvas.figure is figure


def test_the_picture_is_written_whole_or_its_ending_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"picture '.*x\.pnk': ending: .*png"):
        save(blank(), tmp_path / "x.pnk")
    save(blank(2.0, 1.0), tmp_path / "new" / "x.png")
    assert imread(tmp_path / "new" / "x.png").shape[:2] == (150, 300)
    assert [p.name for p in tmp_path.rglob("*.*")] == ["x.png"]


PLAIN = 10.0
"""Ordinary text of Matplotlib [pt]."""


@cache
def runs() -> dict[str, Trajectory]:
    one, other = (simulate(rabinowicz(law), 0.1) for law in (BrownMcPhee(), LuGre()))
    return {"Brown-McPhee": one, "LuGre": other, "another name, rather long": other}


@pytest.fixture(name="figure")
def _figure() -> Figure:
    return plot_trajectories(runs(), ["x", "friction"])


def sizes(figure: Figure) -> set[float]:
    figure.draw_without_rendering()
    texts = [one for one in figure.findobj(Text) if one.get_text() and one.get_visible()]
    return {round(float(one.get_fontsize()), 3) for one in texts}


def test_width_and_text_are_as_requested_and_everything_is_on_the_page(figure: Figure) -> None:
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


def test_text_in_pdf_is_truetype(tmp_path: Path) -> None:
    figure, (axis,) = panels(1)
    axis.set_ylabel("x [m]")
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


EYES = {
    "normal": np.eye(3),
    "protanopia": np.array([[0.152286, 1.052583, -0.204868],
                            [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968],
                              [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779],
                            [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
}  # fmt: skip
"""Linear RGB as dichromats see it: Machado, Oliveira, Fernandes, IEEE TVCG 15 (2009), table 1."""

XYZ = np.array([[0.4124564, 0.3575761, 0.1804375],
                [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
"""Linear sRGB to XYZ (IEC 61966-2-1)."""


def linear(text: str) -> Array:
    c = np.array([int(text[i : i + 2], 16) / 255 for i in (1, 3, 5)])
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(rgb: Array) -> Array:
    x = XYZ @ np.clip(rgb, 0.0, 1.0) / (XYZ @ np.ones(3))
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("eyes", EYES)
def test_any_two_colours_differ_for_all_eyes(eyes: str) -> None:
    seen = {text: lab(EYES[eyes] @ linear(text)) for text in COLOURS}
    near = min(float(np.linalg.norm(seen[a] - seen[b])) for a, b in combinations(COLOURS, 2))
    assert near > 25.0


def test_every_colour_contrasts_with_paper() -> None:
    contrast = [1.05 / (XYZ[1] @ linear(text) + 0.05) for text in COLOURS]
    assert min(contrast) > 3.0  # what WCAG 2.1 asks of graphics


def test_four_curves_differ_in_grey_and_28_in_colour_or_line_style() -> None:
    grey = sorted(lab(linear(text))[0] for text in COLOURS[:4])
    assert np.diff(grey).min() > 7.0
    assert len({(one["color"], str(one["linestyle"])) for one in CYCLE}) == len(CYCLE) == 28
    for k in range(28):
        assert line(k)["linestyle"] != line(k + 1)["linestyle"]
        assert line(k)["color"] != line(k + 1)["color"]
        assert line(k) == line(k + 28)
    assert line(0)["linestyle"] == DASHES[0] == "-"
    assert line(3, 0) == {"color": COLOURS[3], "linestyle": "-"}
