import csv
import json
from pathlib import Path

import numpy as np
import pytest
from motions import fastest, least_effort, stage

from ocp import Solution, solve
from symfric import Hold, simulate


@pytest.fixture(scope="module")
def move() -> Solution:
    return solve(fastest(stage()), intervals=20)


def test_signals_are_known_at_all_collocation_points(move: Solution) -> None:
    assert list(move.signals) == ["x", "v", "force", "friction", "power"]
    assert move.t.shape == (61,)
    assert all(values.shape == move.t.shape for values in move.signals.values())
    assert (move.t[0], move.t[-1]) == (0.0, move.T)
    assert (np.diff(move.t) > 0).all()
    assert list(move.states) == ["x", "v"]
    assert list(move.inputs) == ["force"]
    np.testing.assert_array_equal(move["t"], move.t)


def test_outputs_belong_to_the_states_and_inputs(move: Solution) -> None:
    np.testing.assert_allclose(move["power"], move["friction"] * move["v"])
    np.testing.assert_allclose(move["friction"][5:-5], 4.0, rtol=1e-3)


def test_inputs_hold_from_each_time_on(move: Solution) -> None:
    np.testing.assert_array_equal(move["force"][:-1], np.repeat(move.controls["force"], 3))
    np.testing.assert_array_equal(move.t_control, move.t[:-1:3])


def test_unknown_signal_is_refused(move: Solution) -> None:
    with pytest.raises(ValueError, match=r"solution of 'drive': .* got forse; did you mean force"):
        move["forse"]


def test_csv_gives_the_control_again(move: Solution, tmp_path: Path) -> None:
    move.to_csv(tmp_path / "move.csv")
    with (tmp_path / "move.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header == ["t [s]", "x [m]", "v [m/s]", "force [N]", "friction [N]", "power [W]"]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 1], move["x"])
    control = Hold(table[:, 0], table[:, 3])
    again = simulate(stage(), move.T, u={"force": control}, rtol=1e-9)
    assert again["x"][-1] - move["x"][-1] == pytest.approx(move.terminal_miss["x"], abs=1e-7)


def test_json_holds_everything_as_plain_data(move: Solution, tmp_path: Path) -> None:
    move.to_json(tmp_path / "move.json")
    data = json.loads((tmp_path / "move.json").read_text())
    assert data == move.to_dict()
    assert data["scene"] == "drive"
    assert data["status"] == "SOLVED"
    assert data["T"] == move.T == data["cost"]
    assert data["units"]["force"] == "N"
    assert data["statistics"]["iterations"] == move.iterations
    assert data["terminal_miss"] == move.terminal_miss
    assert data["relative_miss"]["x"] == pytest.approx(10 * move.terminal_miss["x"])


def test_statistics_count_the_program(move: Solution) -> None:
    counts = move.statistics
    assert (counts.unknowns, counts.constraints) == (2 + 20 * 7 + 1, 20 * 6)
    assert counts.jacobian_nonzeros == 20 * 36
    assert counts.iterations == move.iterations > 0


def test_plot_is_written(move: Solution, tmp_path: Path) -> None:
    figure = move.plot("v", "force", path=tmp_path / "move.png")
    assert (tmp_path / "move.png").stat().st_size > 1000
    assert [axis.get_ylabel() for axis in figure.axes] == ["v [m/s]", "force [N]"]


def test_fixed_duration_is_reported_too() -> None:
    solution = solve(least_effort(T=2.0), intervals=4)
    assert solution.T == 2.0 == solution.t[-1]
