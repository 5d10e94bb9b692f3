from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from motions import fastest, out_and_back, stage

from ocp import Solution, solve
from ocp.picture import plot_solutions


@pytest.fixture(scope="module")
def moves() -> dict[str, Solution]:
    return {
        "fastest": solve(fastest(stage()), intervals=10),
        "back": solve(out_and_back(), intervals=10, throw=False),
    }


def lines(axis: Axes) -> list[np.ndarray]:
    return [np.asarray(line.get_ydata()) for line in axis.lines if np.size(line.get_ydata())]


def test_nodes_stand_against_the_simulated_line(moves: dict[str, Solution]) -> None:
    figure = plot_solutions(moves, ["x", "force"])
    nodes, simulated = lines(figure.axes[0])[:2]
    move = moves["fastest"]
    assert move.trajectory is not None
    np.testing.assert_array_equal(nodes, move["x"][::3])
    np.testing.assert_array_equal(simulated, move.trajectory["x"])
    plt.close(figure)


def test_inputs_are_steps(moves: dict[str, Solution]) -> None:
    figure = plot_solutions(moves, ["x", "force"])
    first, second = figure.axes[1].patches
    np.testing.assert_array_equal(first.get_data().values, moves["fastest"].controls["force"])
    assert second.get_data().edges[-1] == 2.0
    plt.close(figure)


def test_legend_says_how_long_and_how_it_ended(moves: dict[str, Solution]) -> None:
    figure = plot_solutions(moves, ["x"])
    legend = figure.axes[0].get_legend()
    assert legend is not None
    first, second = (text.get_text() for text in legend.get_texts())
    assert first.startswith("fastest: T = 0.4")
    assert second == "back: T = 2 s, terminal miss"
    plt.close(figure)


def test_unknown_signal_is_refused(moves: dict[str, Solution]) -> None:
    with pytest.raises(ValueError, match=r"plot of 'drive': .* got w"):
        plot_solutions(moves, ["w"])


def test_picture_is_written_without_verification(tmp_path: Path) -> None:
    plain = solve(fastest(stage()), intervals=10, verify=False)
    plot_solutions({"plain": plain}, path=tmp_path / "plain.png")
    assert (tmp_path / "plain.png").stat().st_size > 1000
