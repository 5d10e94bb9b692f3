from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle, StepPatch
from phases import there_and_back, unit_move

from ocp.solving.one_solve import solve_once
from ocp.solving.solution import Mode, Solution, plot_solutions
from symfric import Hold, Trajectory, simulate


@dataclass
class Verdict:
    trajectories: tuple[Trajectory, ...]
    ok: bool = True

    def to_dict(self) -> dict[str, Any]:
        return {}


@pytest.fixture(scope="module")
def move() -> Solution:
    problem = there_and_back(bounds={"a": (-20.0, 20.0), "power": (None, 50.0)})
    return solve_once(problem, 5)


def curves(axis: Axes) -> list[np.ndarray]:
    return [np.asarray(line.get_ydata()) for line in axis.lines if np.size(line.get_ydata())]


def test_nodes_are_circles_and_phases_are_parted(move: Solution) -> None:
    axis = move.plot("x").axes[0]
    nodes, line = curves(axis)[:2]
    np.testing.assert_array_equal(nodes, move["x"][::3])
    np.testing.assert_array_equal(line, move["x"])
    assert [1.0, 1.0] in [list(line.get_xdata()) for line in axis.lines]


def test_simulated_lines_stand_where_there_are_some() -> None:
    plain = solve_once(unit_move(), 5)
    model, control = plain.problem.spans[0].model, Hold(plain.t_control, plain.controls["a"])
    run = simulate(model, 1.0, u={"a": control}, rtol=1e-9)
    checked = replace(plain, verification=Verdict((run,)))
    assert (plain.trajectories, checked.trajectories) == ((), (run,))
    figure = checked.plot("x")
    np.testing.assert_array_equal(curves(figure.axes[0])[1], run["x"])
    assert "lines: simulated" in figure.axes[-1].get_xlabel()
    assert figure.axes[0].get_title().endswith("verified")
    assert "lines: optimised" in plain.plot("x").axes[-1].get_xlabel()


def test_inputs_are_steps_between_dashed_bounds(move: Solution) -> None:
    axis = move.plot("a").axes[0]
    (steps,) = (patch for patch in axis.patches if isinstance(patch, StepPatch))
    np.testing.assert_array_equal(steps.get_data().values, move.controls["a"])
    assert steps.get_data().edges[-1] == 2.0
    dashed = [line for line in axis.lines if line.get_linestyle() == "--"]
    assert {float(line.get_ydata()[0]) for line in dashed} == {-20.0, 20.0}
    power = move.plot("power").axes[0]
    assert [50.0, 50.0] in [list(line.get_ydata()) for line in power.lines]


def test_what_is_asked_for_is_marked(move: Solution) -> None:
    crosses = [line for line in move.plot("x").axes[0].lines if line.get_marker() == "x"]
    asked = {(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in crosses}
    assert asked == {(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)}
    ranged = solve_once(unit_move(end={"x": (0.9, 1.1), "v": 0.0, "power": (None, 3.0)}), 5)
    figure = ranged.plot("x", "power")
    bars = [line for line in figure.axes[0].lines if line.get_marker() == "_"]
    assert [list(line.get_ydata()) for line in bars] == [[0.9, 1.1]]
    bars = [line for line in figure.axes[1].lines if line.get_marker() == "_"]
    assert [list(line.get_ydata()) for line in bars] == [[3.0]]


def test_modes_are_shaded_a_band_for_each_contact(move: Solution) -> None:
    modes = {
        "guide": (Mode("slip+", 0.0, 0.9), Mode("stick", 0.9, 1.1), Mode("slip-", 1.1, 2.0)),
        "wheel": (Mode("stick", 0.0, 2.0),),
    }
    axis = replace(move, modes=modes).plot("v").axes[0]
    bands = [patch for patch in axis.patches if isinstance(patch, Rectangle)]
    assert [(b.get_x(), b.get_y(), b.get_height()) for b in bands] == [
        (0.0, 0.0, 0.5),
        (0.9, 0.0, 0.5),
        (1.1, 0.0, 0.5),
        (0.0, 0.5, 0.5),
    ]
    assert bands[1].get_facecolor() == bands[3].get_facecolor() != bands[0].get_facecolor()
    (legend,) = axis.get_figure(root=True).legends  # type: ignore[union-attr]
    assert [text.get_text() for text in legend.get_texts()] == [
        "slip+", "stick", "slip-", "bands from below: guide, wheel",
    ]  # fmt: skip


def test_several_solutions_and_scenarios_are_overlaid(move: Solution) -> None:
    two = solve_once(unit_move(scenarios={"dry": {}, "oiled": {}}), 5)
    failed = solve_once(unit_move(bounds={"a": (-1.0, 1.0)}), 4)
    figure = plot_solutions({"a": move, "b": two, "c": failed}, ["x"])
    (legend,) = figure.legends
    entries = [text.get_text() for text in legend.get_texts()]
    assert [entry.split(":")[0] for entry in entries] == ["a", "b dry", "b oiled", "c"]
    assert entries[0].startswith("a: T = 2 s, J = ")
    assert entries[3].endswith("infeasible")


def test_bad_wishes_are_refused(move: Solution, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"plot of 'double integrator': .* got w"):
        move.plot("w")
    with pytest.raises(ValueError, match="plot: expected at least one solution"):
        plot_solutions({})
    move.plot("v", "a", path=tmp_path / "move.png")
    assert (tmp_path / "move.png").stat().st_size > 1000
