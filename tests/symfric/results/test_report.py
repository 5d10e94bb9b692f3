"""Runs as one page."""

import re
from pathlib import Path

import pytest
from pages import Balanced
from robots import SMALL

from symfric import BrownMcPhee, LuGre, parameters, report, simulate
from symfric.cli import main
from symfric.multibody.urdf import read_urdf
from symfric.page.html import STYLE
from symfric.results.pictures import plot_trajectories
from symfric.scenes import Rabinowicz


def _places(cells: list[str], name: str) -> list[int]:
    found = [k for k, cell in enumerate(cells) if cell == name]
    assert len(found) >= 2
    return found


def test_a_page_holds_the_numbers_of_the_runs_and_needs_nothing(tmp_path: Path) -> None:
    scenes = {"LuGre": Rabinowicz(LuGre()), "<b>": Rabinowicz(BrownMcPhee(mu_s=0.17))}
    runs = {n: simulate(s.model(), 2.0, measure_error=True) for n, s in scenes.items()}
    text = report(runs, tmp_path / "p.html", settings={n: parameters(s) for n, s in scenes.items()})
    assert (tmp_path / "p.html").read_text("utf-8") == text
    page = Balanced(text)
    assert all(s.startswith(("#", "data:")) for s in page.sources)
    assert "<b>" not in text.replace("&lt;b&gt;", "")
    for run in runs.values():
        assert f"{run.extremes['x'][1]:.6g}" in page.cells
        assert f"{run.final['friction']:.6g}" in page.cells
        assert f"{run.statistics.error:.1e}" in page.cells
    for run, at in zip(runs.values(), _places(page.cells, "x"), strict=False):
        ends = (run.final["x"], *run.extremes["x"])
        assert page.cells[at + 1 : at + 5] == [*(f"{value:.6g}" for value in ends), "m"]
    assert "0.17" in page.cells
    assert text.count("Source:") == len(runs)


def test_a_law_has_one_colour_on_its_page() -> None:
    """That of the picture of the motion, also in the second chart of friction."""
    run = simulate(Rabinowicz(BrownMcPhee()).model(), 0.1)
    runs = {f"law {k}": run for k in range(5)}
    page = report(runs)
    drawn = re.findall(r'<polyline class="(run\d)"', page)
    assert drawn == [f"run{k}" for k in range(5)]
    positions = plot_trajectories(runs, ["x"]).axes[0].lines
    for kind, line in zip(drawn, positions, strict=True):
        assert f"svg .{kind} {{ stroke: {line.get_color()};" in STYLE
    robot = simulate(read_urdf(SMALL).build(), 0.1, x0={"hinge": 1.0})
    for text, unit in ((page, "m/s"), (report(robot), "rad/s")):
        assert f"sliding velocity [{unit}]" in text


def test_what_is_no_run_is_refused() -> None:
    for bad in ({}, {"x": 1.0}, 3):
        with pytest.raises(ValueError, match="report"):
            report(bad)  # pyright: ignore[reportArgumentType]


def test_the_command_writes_one_page_of_several_laws(tmp_path: Path) -> None:
    out = tmp_path / "r.html"
    words = "report rabinowicz --law dahl --law coulomb --t-end 2 --set m=0.5 --html"
    assert main([*words.split(), str(out)]) == 0
    cells = Balanced(out.read_text("utf-8")).cells
    assert {"dahl", "coulomb", "0.5", "sigma_0"} <= set(cells)
    assert main([*words.split()[:-3], "--set", "mm=1", "--out", str(tmp_path / "n.html")]) == 2
    assert not (tmp_path / "n.html").exists()


def test_the_page_of_a_run_that_jams_is_written_and_is_no_success(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "jams.html"
    line = "report four_bar --law lugre --law-of pin=brown_mcphee --t-end 0.3 --out"
    words = [*line.split(), str(out)]
    monkeypatch.setattr("sys.argv", ["symfric", *words])
    assert main(words) == 1
    text = out.read_text("utf-8")
    assert "Not finished" in text
    assert f"symfric {line} {out}" in text
    assert f"wrote {out}" in capsys.readouterr().err
