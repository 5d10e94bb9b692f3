"""Figures outside pyplot, for print, and with colours for all eyes.

What objects say of themselves: within a screen, and as HTML that no name can break.
"""

import subprocess
import sys
from dataclasses import dataclass, fields
from functools import cache
from io import BytesIO
from itertools import combinations
from pathlib import Path
from typing import Any

import casadi as ca
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text
from pages import on_a_screen, parsed, shown

from symfric import BrownMcPhee, LuGre, Trajectory, for_print, rabinowicz, simulate
from symfric.foundation.numeric import Array
from symfric.foundation.panels import Picture, blank, grid, panels, save
from symfric.foundation.parameters import Variable
from symfric.foundation.shown import (
    WIDTH,
    Shown,
    TextTable,
    among,
    brief,
    counted,
    cut,
    in_a_line,
    valued,
)
from symfric.foundation.style import COLOURS, CYCLE, DASHES, line
from symfric.integrator import Hold, Linear
from symfric.laws import ALL_LAWS
from symfric.model import Contact, Event, Monitor, Output
from symfric.results.pictures import plot_trajectories
from symfric.scenes import ALL_SCENES, FourBar, QuarterCar


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


EVIL = '<script>alert("&")</script>'


def test_everything_of_a_user_is_escaped() -> None:
    page = parsed(Shown(EVIL, (EVIL,), TextTable((EVIL, ""), ((EVIL, "1"),)), (EVIL,)).html())
    assert page.words.count(EVIL) == 5


def test_a_long_table_names_what_it_leaves_out() -> None:
    rows = tuple((f"row{k}", f"{k}") for k in range(40))
    text = Shown("many", ("one",), TextTable(("name", "n"), rows, numbers=(1,)), ("last",)).text()
    assert on_a_screen(text)
    assert text.splitlines()[-1] == "last"
    assert "... 20 more: row20, row21" in text
    assert text.splitlines()[2:4] == ["  name    n", "  row0    0"]
    assert parsed(Shown("many", (), TextTable(("name", "n"), rows)).html()).words.count("row") == 40


def test_words_for_counts_and_values() -> None:
    assert [counted(n, "body", "bodies") for n in (0, 1, 2)] == ["no bodies", "1 body", "2 bodies"]
    assert among("abcd", 2) == "a, b, ... 2 more"
    assert valued([("m", 0.8, "kg"), ("mu", 0.2, "1")]) == "m = 0.8 kg, mu = 0.2"
    assert len(cut("x" * 300)) == WIDTH


def test_laws_show_parameters_and_a_picture() -> None:
    for name, law in [*ALL_LAWS.items()][::6]:
        (line,) = law().thumbnail().axes[0].lines
        assert np.isfinite(line.get_ydata()).all(), name
    page = shown(LuGre())
    assert len(page.pictures) == 1
    assert "static friction coefficient" in page.words


def test_scenes_are_the_call_that_makes_them_and_models_show_no_expressions() -> None:
    laws = vars(__import__("symfric.laws").laws)
    for kind in ALL_SCENES.values():
        scene = kind(LuGre())
        text, model = repr(scene), scene.model()
        assert repr(eval(text, {**laws, kind.__name__: kind, "LuGre": LuGre})) == text
        reported = repr(model)
        assert on_a_screen(text) and on_a_screen(reported)
        assert "by LuGre" in reported and "SX(" not in reported and "@1" not in reported
        assert "further" not in model.__dict__, "showing must not write the details"
    assert "QuarterCar(law=LuGre(" in repr(QuarterCar(LuGre()))
    assert shown(QuarterCar(LuGre())).pictures


def test_parts_of_a_model_in_a_line() -> None:
    v = Variable("v", "m/s", doc="rate")
    for thing, words in (
        (v, "<variable 'v' [m/s], start 0: rate>"), (Output(1.0, "N"), "<output [N]>"),
        (Monitor(1.0, 1e-3), "<monitor on the scale 0.001>"),
        (Event("hit", 1.0, -1, terminal=True), "<event 'hit', falling, ends the run>"),
        (Contact("b", v.symbol, 1.0, LuGre(), bare=True), "<contact 'b' by LuGre, states z>"),
    ):  # fmt: skip
        assert repr(thing) == words


@dataclass(frozen=True, eq=False)
class Many:
    """Of all kinds."""

    array: Any
    mapping: Any

    __repr__ = brief


def test_arrays_are_described_by_size_and_range() -> None:
    lines = repr(Many(np.linspace(0, 5, 2001), {"a": np.zeros((3, 4)), "b": 1.0})).splitlines()
    assert lines[:2] == ["<Many", "  array: 2001 values from 0 to 5"]
    assert lines[2] == "  mapping: a: 3 x 4 values from 0 to 0, b: 1>"
    assert in_a_line(np.array([1.0, 2.5])) == "[1, 2.5]"
    assert in_a_line(np.full(20, np.nan)) == "20 values"
    assert in_a_line(ca.SX.sym("x", 3)) == "expression of shape (3, 1)"
    assert in_a_line(({}, (1, "a"), None)) == "(none, (1, 'a'), None)"


def test_a_screen_is_enough_for_anything() -> None:
    long = {f"name_{k}": np.zeros(k) for k in range(300)}
    assert on_a_screen(repr(Many(long, tuple(range(1000)))))
    assert on_a_screen(repr(Linear(np.arange(1e4), np.arange(1e4))))
    assert repr(Hold([0, 1], [2, 3])) == "<Hold\n  t: [0, 1]\n  values: [2, 3]>"
    assert len(fields(Hold)) == 2


def test_an_energy_balance_is_a_table() -> None:
    books = simulate(FourBar(BrownMcPhee()).model(), 0.1, samples=11).energy_balance()
    text = repr(books)
    assert on_a_screen(text)
    row = next(line.split() for line in text.splitlines() if "work of friction" in line)
    assert row == ["work", "of", "friction", f"{books.work['friction'][-1]:.6g}"]
    assert f"unexplained over what moved: {books.relative:.2g}" in text
    assert "work of friction" in shown(books).words
