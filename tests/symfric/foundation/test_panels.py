"""Figures outside pyplot: written whole, shown once, kept by nobody."""

import subprocess
import sys
from io import BytesIO
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from matplotlib.image import imread

from symfric.foundation.panels import Picture, blank, grid, panels, save


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
    told = getattr(figure, "_repr_png_")()  # noqa: B009  (what IPython calls)
    shown = imread(BytesIO(told), format="png")
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
