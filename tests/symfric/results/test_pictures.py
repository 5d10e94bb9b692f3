"""Pictures carry names, units and legends, and are written whole."""

from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from matplotlib.image import imread

from symfric import BrownMcPhee, LuGre, Trajectory, rabinowicz, simulate
from symfric.results.pictures import plot_trajectories
from symfric.scenes import FourMass


@pytest.fixture(scope="module")
def runs() -> dict[str, Trajectory]:
    laws = {"lugre": LuGre(), "brown_mcphee": BrownMcPhee()}
    return {name: simulate(rabinowicz(law), 0.5, samples=51) for name, law in laws.items()}


def test_trajectory_plots_a_labelled_panel_per_signal(runs: dict[str, Trajectory]) -> None:
    figure = runs["lugre"].plot()
    axes = figure.axes
    assert [axis.get_ylabel() for axis in axes] == [
        "x [m]",
        "v [m/s]",
        "z [m]",
        "v_rel [m/s]",
        "friction [N]",
        "power [W]",
    ]
    assert axes[-1].get_xlabel() == "t [s]"
    assert "rabinowicz" in (axes[0].get_title(), axes[0].get_title(loc="left"))
    line = axes[1].lines[0]
    assert line.get_xdata() == pytest.approx(runs["lugre"].looks)
    assert line.get_ydata() == pytest.approx(runs["lugre"].at_looks("v"))


def test_chosen_signals_in_the_chosen_order(runs: dict[str, Trajectory]) -> None:
    figure = runs["lugre"].plot("friction", "x", label="LuGre")
    assert [axis.get_ylabel() for axis in figure.axes] == ["friction [N]", "x [m]"]
    assert figure.axes[0].lines[0].get_label() == "LuGre"


def test_several_trajectories_share_panels_and_a_legend(runs: dict[str, Trajectory]) -> None:
    figure = plot_trajectories(runs)
    assert [len(axis.lines) for axis in figure.axes] == [2] * 5  # z stands in one of them only
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == list(runs)


def test_picture_is_written_and_pyplot_keeps_none(
    runs: dict[str, Trajectory], tmp_path: Path
) -> None:
    runs["lugre"].plot("x", path=tmp_path / "new" / "x.png")
    assert imread(tmp_path / "new" / "x.png").shape[2] == 4
    assert plt.get_fignums() == []
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["x.png"]


@pytest.mark.parametrize("ending", ["svg", "pdf"])
def test_format_follows_the_ending(
    runs: dict[str, Trajectory], tmp_path: Path, ending: str
) -> None:
    target = tmp_path / f"x.{ending}"
    runs["lugre"].plot("x", path=target)
    assert target.read_bytes()[:5] in (b"<?xml", b"%PDF-")


def test_unknown_signal_is_refused_with_a_hint(runs: dict[str, Trajectory]) -> None:
    with pytest.raises(ValueError, match=r"got frction; did you mean friction"):
        runs["lugre"].plot("frction")


def test_mechanisms_have_a_panel_per_kind_and_constraints_on_a_logarithmic_scale() -> None:
    run = simulate(FourMass(BrownMcPhee()).model(), 0.1, samples=11)
    axes = {axis.get_ylabel(): axis for axis in run.plot().axes}
    assert list(axes) == ["position [m]", "rate [m/s]", "normal force [N]", "friction [N]",
                          "friction [W]", "energy [J]", "constraints"]  # fmt: skip
    assert [line.get_label() for line in axes["position [m]"].lines] == ["x1", "y2", "z3", "x4"]
    assert [axis.get_yscale() for axis in axes.values()] == 6 * ["linear"] + ["log"]
