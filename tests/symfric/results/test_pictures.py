"""Pictures of runs: what they show by default, with which names, units and line styles.

Runs as one page.
"""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import casadi as ca
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.image import imread
from pages import Balanced
from robots import SMALL

import symfric as sf
from symfric.cli import main
from symfric.foundation.style import line
from symfric.multibody.urdf import read_urdf
from symfric.page.html import STYLE
from symfric.results.kinds import friction_laws, is_mechanism, kinds, norms, shortened
from symfric.results.pictures import level, plot_trajectories
from symfric.scenes import CoupledBlocks, Drive, FourMass, Pendulum, QuarterCar, Rabinowicz


@pytest.fixture(scope="module")
def runs() -> dict[str, sf.Trajectory]:
    laws = {"lugre": sf.LuGre(), "brown_mcphee": sf.BrownMcPhee()}
    return {name: sf.simulate(sf.rabinowicz(law), 0.5, samples=51) for name, law in laws.items()}


@pytest.fixture(scope="module")
def four_mass() -> sf.Trajectory:
    return sf.simulate(FourMass(sf.BrownMcPhee()).model(), 0.1, samples=11)


def labels(figure: Figure) -> list[str]:
    return [axis.get_ylabel() for axis in figure.axes]


def names(axis: Axes) -> list[str]:
    return [str(one.get_label()) for one in axis.lines]


def test_a_run_shows_positions_friction_and_power_and_names_its_law(
    runs: dict[str, sf.Trajectory],
) -> None:
    figure = runs["lugre"].plot()
    assert labels(figure) == ["x [mm]", "friction [N]", "power [mW]"]
    assert figure.axes[-1].get_xlabel() == "t [s]"
    assert figure.axes[0].get_title(loc="left") == "rabinowicz with LuGre"
    (line_,) = figure.axes[0].lines
    assert line_.get_xdata() == pytest.approx(runs["lugre"].looks)
    assert line_.get_ydata() == pytest.approx(1e3 * runs["lugre"].at_looks("x"))


def test_chosen_signals_in_the_chosen_order_all_of_them_or_none(
    runs: dict[str, sf.Trajectory], tmp_path: Path
) -> None:
    run, path = runs["lugre"], tmp_path / "new" / "x.png"
    figure = run.plot("friction", "x", label="LuGre", path=path)
    assert labels(figure) == ["friction [N]", "x [mm]"]
    assert figure.axes[0].lines[0].get_label() == "LuGre"
    assert imread(path).shape[2] == 4
    assert plt.get_fignums() == []
    assert [p.name for p in path.parent.iterdir()] == ["x.png"]
    every = ["x [mm]", "v [m/s]", "z [µm]", "v_rel [m/s]", "friction [N]", "power [mW]"]
    assert labels(run.plot(panels="all")) == every
    for names, panels, message in (
        ((), "some", "plot: panels: expected one of main, all, got some"),
        (("frction",), "main", "got frction; did you mean friction"),
    ):
        with pytest.raises(ValueError, match=message):
            run.plot(*names, panels=panels)


def test_runs_differ_by_colour_and_line_style_and_stand_in_a_legend_below(
    runs: dict[str, sf.Trajectory],
) -> None:
    figure = plot_trajectories(runs)
    assert [len(axis.lines) for axis in figure.axes] == [2, 2, 2]
    for k, one in enumerate(figure.axes[0].lines):
        assert to_hex(one.get_color()) == line(k)["color"]
        assert one.is_dashed() == (k == 1)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == list(runs)
    figure.draw_without_rendering()
    lowest = min(axis.get_window_extent().y0 for axis in figure.axes)
    assert legend.get_window_extent().y1 < lowest


def test_mechanisms_share_panels_by_kind_and_constraints_are_left_to_all(
    four_mass: sf.Trajectory,
) -> None:
    figure = four_mass.plot()
    assert labels(figure) == ["position [m]", "friction [N]", "energy [J]"]
    assert [names(axis) for axis in figure.axes] == [
        ["x1", "y2", "z3", "x4"],
        ["x1", "y2", "z3", "x4"],
        ["kinetic", "potential", "energy"],
    ]
    everything = four_mass.plot(panels="all")
    assert labels(everything) == ["position [m]", "rate [m/s]", "normal force [N]", "friction [N]",
                                  "power of friction [W]", "energy [J]",
                                  "constraints"]  # fmt: skip
    assert [axis.get_yscale() for axis in everything.axes] == 6 * ["linear"] + ["log"]


def test_of_compared_mechanisms_energy_is_the_sum(four_mass: sf.Trajectory) -> None:
    run = sf.simulate(QuarterCar(sf.LuGre()).model(), 0.1, samples=5)
    assert labels(plot_trajectories({"a": run, "b": run})) == [
        "X_b [m]", "X_w [m]", "friction [N]", "power [W]",
    ]  # fmt: skip
    both = plot_trajectories({"a": four_mass, "b": four_mass})  # nine signals: too many alone
    assert labels(both) == ["position [m]", "friction [N]", "energy [J]"]
    first, second = both.axes[0].lines[:2]
    assert first.get_color() == second.get_color()
    assert (first.is_dashed(), second.is_dashed()) == (False, True)


def test_a_constant_is_a_level_line_and_no_offset_is_written() -> None:
    x, c = sf.Variable("x", "m", start=1.0), sf.Variable("c", "m", start=7.8e-6)
    still = sf.Model("still", x=(x, c), ode=ca.SX([1.0, 0.0]))
    axis = sf.simulate(still, 1.0, samples=5).plot("c").axes[0]
    assert axis.get_ylabel() == "c [µm]"
    assert axis.get_ylim() == pytest.approx((0.8 * 7.8, 1.2 * 7.8))
    axis.figure.draw_without_rendering()
    assert axis.yaxis.get_offset_text().get_text() == ""


def test_what_hardly_changes_is_not_magnified() -> None:
    for values, limits in (([0.0, 0.0], (-1.0, 1.0)), ([5.0, 5.0 + 1e-9], (4.0, 6.0))):
        axis: Any = Figure().subplots()
        axis.plot(values)
        level(axis, [np.array(values), np.array([np.nan])])
        assert axis.get_ylim() == pytest.approx(limits)


def test_names_lose_the_ending_that_all_share_and_stay_short() -> None:
    assert shortened(["phi_1_friction", "phi_2_friction"]) == ["phi_1", "phi_2"]
    assert shortened(["kinetic", "potential"]) == ["kinetic", "potential"]
    assert shortened(["x_friction"]) == ["x_friction"]
    (long,) = shortened(["a" * 30 + "_" + "b" * 30])
    assert (len(long), long[:3], long[-3:]) == (28, "aaa", "bbb")


def test_scenes_without_joints_show_the_same_kinds_and_others_all_they_have() -> None:
    a = sf.Variable("concentration", "mol/m^3", start=1.0)
    decay = sf.Model("decay", x=(a,), ode=-a.symbol)
    blocks, drive = (scene(sf.BrownMcPhee()) for scene in (CoupledBlocks, Drive))
    for model, scene, expected in (
        (blocks.model(), blocks, ["position [m]", "friction [N]", "power of friction [W]"]),
        (drive.model(), drive, ["x [m]", "friction [N]", "power [W]"]),
        (decay, None, ["concentration [mol/m^3]"]),
    ):
        inputs = {name: given.function for name, given in scene.inputs.items()} if scene else {}
        run = sf.simulate(model, 1.0, u=inputs, samples=11)
        assert labels(run.plot()) == expected


def test_a_signal_over_decades_has_a_logarithmic_axis_and_years_below_it() -> None:
    x = sf.Variable("x", "m", start=1e-9, nominal=1e-9)
    year = 365.25 * 86400.0
    growing = sf.Model("growing", x=(x,), ode=x.symbol / year)
    run = sf.simulate(growing, 20 * year)
    figure = run.plot("x", log=["x"])
    (axis,) = figure.axes
    drawn = axis.get_yscale(), axis.get_ylabel(), axis.get_xlabel()
    assert drawn == ("log", "x [m]", "t [years]")
    (curve,) = axis.lines
    years, x_drawn = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    assert x_drawn == pytest.approx(1e-9 * np.exp(years), rel=1e-4)
    assert run.plot("x").axes[0].get_yscale() == "linear"
    with pytest.raises(ValueError, match="expected one of x, got y"):
        run.plot("x", log=["y"])
    sunk = sf.simulate(growing, 3.0, x0={"x": -1.0})
    with pytest.raises(ValueError, match="log: expected signals above zero somewhere, got x"):
        sunk.plot("x", log="x")


def test_every_kind_of_a_mechanism_with_loops_and_bristles() -> None:
    model = FourMass(sf.LuGre()).model()
    found = kinds(model)
    assert Counter(found.values()) == {
        "position": 4, "rate": 4, "state of friction": 4, "normal force": 4, "friction": 8,
        "energy": 3, "constraints": 3,
    }  # fmt: skip
    slips = {f"{name}_slip" for name in ("x1", "y2", "z3", "x4")}
    assert set(model.signals) - set(found) == {"rod_12_lambda", "rod_23_lambda"} | slips


def test_mechanisms_without_loops_have_no_norms_of_constraints() -> None:
    model = Pendulum(sf.BrownMcPhee()).model()
    assert norms(model) == ()
    assert friction_laws(model) == "BrownMcPhee"
    assert is_mechanism(model)
    assert not is_mechanism(sf.rabinowicz(sf.BrownMcPhee()))


def _places(cells: list[str], name: str) -> list[int]:
    found = [k for k, cell in enumerate(cells) if cell == name]
    assert len(found) >= 2
    return found


def test_a_page_holds_the_numbers_of_the_runs_and_needs_nothing(tmp_path: Path) -> None:
    scenes = {"LuGre": Rabinowicz(sf.LuGre()), "<b>": Rabinowicz(sf.BrownMcPhee(mu_s=0.17))}
    runs = {n: sf.simulate(s.model(), 2.0, measure_error=True) for n, s in scenes.items()}
    text = sf.report(
        runs, tmp_path / "p.html", settings={n: sf.parameters(s) for n, s in scenes.items()}
    )
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
    run = sf.simulate(Rabinowicz(sf.BrownMcPhee()).model(), 0.1)
    runs = {f"law {k}": run for k in range(5)}
    page = sf.report(runs)
    drawn = re.findall(r'<polyline class="(run\d)"', page)
    assert drawn == [f"run{k}" for k in range(5)]
    positions = plot_trajectories(runs, ["x"]).axes[0].lines
    for kind, curve in zip(drawn, positions, strict=True):
        assert f"svg .{kind} {{ stroke: {curve.get_color()};" in STYLE
    robot = sf.simulate(read_urdf(SMALL).build(), 0.1, x0={"hinge": 1.0})
    for text, unit in ((page, "m/s"), (sf.report(robot), "rad/s")):
        assert f"sliding velocity [{unit}]" in text


def test_what_is_no_run_is_refused() -> None:
    for bad in ({}, {"x": 1.0}, 3):
        with pytest.raises(ValueError, match="report"):
            sf.report(bad)  # pyright: ignore[reportArgumentType]


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
