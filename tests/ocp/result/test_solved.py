import csv
import json
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from phases import UNIT, fastest_move, there_and_back, unit_move

from ocp.formulation.expressions import integral
from ocp.formulation.phase import Phase
from ocp.formulation.problem import Problem
from ocp.solving.motion import Stretch
from ocp.solving.one_solve import solve_once
from ocp.solving.solution import Mode, Solution
from ocp.transcription.schemes import Legendre, Radau
from symfric import Hold, Model, Variable, simulate


@pytest.fixture(scope="module")
def move() -> Solution:
    return solve_once(fastest_move(0.1), 20)


def test_signals_are_known_at_nodes_and_collocation_points(move: Solution) -> None:
    assert list(move.signals) == ["x", "v", "force", "friction", "power"]
    assert move.t.shape == (61,)
    assert all(values.shape == move.t.shape for values in move.signals.values())
    assert (move.t[0], move.t[-1]) == (0.0, move.T)
    assert (np.diff(move.t) > 0).all()
    assert list(move.states) == ["x", "v"]
    assert list(move.inputs) == ["force"]
    np.testing.assert_array_equal(move["t"], move.t)
    np.testing.assert_array_equal(move.t[move.motions[0].nodes][:-1], move.t_control)


@pytest.mark.parametrize(("scheme", "inside"), [(Radau(2), 1), (Legendre(2), 2)])
def test_points_of_a_scheme_stand_in_the_order_of_time(
    scheme: Radau | Legendre, inside: int
) -> None:
    solution = solve_once(unit_move(), 4, scheme)
    assert solution.t.size == 4 * (inside + 1) + 1
    nodes = scheme.coefficients().nodes
    np.testing.assert_allclose(solution.t[: inside + 1] * 4, nodes[: inside + 1])
    interval = np.minimum(np.arange(solution.t.size) // (inside + 1), 3)
    start = interval * (inside + 1)
    t = solution.t - solution.t[start]
    x, v, a = solution["x"][start], solution["v"][start], solution.controls["a"][interval]
    np.testing.assert_allclose(solution["x"], x + v * t + a * t**2 / 2, atol=1e-9)


def test_outputs_belong_to_the_states_and_inputs(move: Solution) -> None:
    np.testing.assert_allclose(move["power"], move["friction"] * move["v"])


def test_inputs_hold_from_each_time_on(move: Solution) -> None:
    np.testing.assert_array_equal(move["force"][:-1], np.repeat(move.controls["force"], 3))
    np.testing.assert_array_equal(move.t_control, move.t[:-1:3])


def test_algebraic_variables_at_nodes_are_those_of_the_interval_before() -> None:
    """0 = z - v: at the nodes, z extrapolated by the polynomial through the collocation points."""
    x, v, z = Variable("x", "m"), Variable("v", "m/s"), Variable("z", "m/s")
    a = Variable("a", "m/s^2")
    model = Model("dae", x=(x, v), z=(z,), u=(a,), ode=ca.vertcat(z.symbol, a.symbol),
                  alg=z.symbol - v.symbol)  # fmt: skip
    for scheme in (Radau(2), Legendre(2)):
        solution = solve_once(unit_move(model=model), 5, scheme)
        np.testing.assert_allclose(solution["z"][1:], solution["v"][1:], atol=1e-9)


def test_phases_are_joined_and_a_time_is_there_once_where_nothing_jumps() -> None:
    solution = solve_once(there_and_back(), [4, 6])
    assert solution.phases == (Stretch("out", 0.0, 1.0), Stretch("back", 1.0, 1.0))
    assert solution.phases[1].end == solution.T == 2.0
    assert solution.t.size == 3 * 10 + 1
    assert (np.diff(solution.t) > 0).all()
    np.testing.assert_allclose(solution["x"][12], 1.0)
    assert solution["a"][12] == solution.controls["a"][4]
    np.testing.assert_allclose(solution.t_control, [0, 0.25, 0.5, 0.75, *(1 + np.arange(6) / 6)])


def test_a_jump_and_signals_that_a_phase_lacks() -> None:
    y = Variable("y", "m")
    other = Model("other", x=(y,), u=(u := Variable("w", "m/s"),), ode=u.symbol)
    chain = Phase(UNIT, 1.0, end={"x": 1.0, "v": 0.0}) >> Phase(
        other, 1.0, link={"y": "x"}, end={"y": 0.0}, bounds={"w": (-2.0, 2.0)}
    )
    costs = [replace(phase, cost=integral(c)) for phase, c in
             zip(chain, (lambda s: s.a**2, lambda s: s.w**2), strict=True)]  # fmt: skip
    solution = solve_once(Problem(costs[0] >> costs[1]), 4)
    assert solution.t.size == 2 * 13
    assert solution.t[12] == solution.t[13] == 1.0
    assert np.isnan(solution["y"][:13]).all()
    assert np.isnan(solution["x"][13:]).all()
    np.testing.assert_allclose(solution["y"][[13, -1]], [1.0, 0.0], atol=1e-9)
    assert np.isnan(solution.controls["w"][:4]).all()
    assert solution.to_dict()["motions"][0]["signals"]["y"][0] is None
    assert solution.units["y"] == "m"


def test_scenarios_have_motions_of_their_own() -> None:
    several = unit_move(scenarios={"one": {}, "two": {}})
    solution = solve_once(several, 5)
    assert [motion.name for motion in solution.motions] == ["one", "two"]
    np.testing.assert_allclose(solution.scenarios["two"]["x"], solution["x"])
    with pytest.raises(ValueError, match="solution: expected one of x, v, a, power, got b"):
        solution.scenarios["two"]["b"]


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
    model = move.problem.spans[0].model
    again = simulate(model, move.T, u={"force": control}, rtol=1e-9)
    assert again["x"][-1] == pytest.approx(move["x"][-1], abs=2e-3)


def test_csv_of_scenarios_names_them(tmp_path: Path) -> None:
    solution = solve_once(unit_move(scenarios={"one": {}, "two": {}}), 3)
    solution.to_csv(tmp_path / "two.csv")
    with (tmp_path / "two.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header[:2] == ["scenario", "t [s]"]
    assert [row[0] for row in rows] == ["one"] * 10 + ["two"] * 10


def test_json_holds_everything_as_plain_data(move: Solution, tmp_path: Path) -> None:
    told = replace(move, modes={"guide": (Mode("slip+", 0.0, move.T),)})
    told.to_json(tmp_path / "move.json")
    data = json.loads((tmp_path / "move.json").read_text())
    assert data == told.to_dict()
    assert data["scene"] == "drive"
    assert data["status"] == "SOLVED"
    assert data["T"] == move.T == pytest.approx(data["cost"])
    assert data["units"]["force"] == "N"
    assert data["statistics"]["iterations"] == move.iterations
    assert data["modes"] == {"guide": [{"kind": "slip+", "begin": 0.0, "end": move.T}]}
    assert data["verified"] is False
    assert data["verification"] is None


def test_statistics_count_the_program(move: Solution) -> None:
    """Unknowns: a copy of the state at each node, three points and an input an interval, T."""
    counts = move.statistics
    assert (counts.unknowns, counts.constraints) == (2 * 21 + 20 * 7 + 1, 20 * 6 + 20 * 2)
    assert counts.iterations == move.iterations > 0
    assert counts.solves == 1


def test_it_tells_itself_in_a_few_lines(move: Solution) -> None:
    told = replace(move, modes={"guide": (Mode("slip+", 0.0, 0.25), Mode("stick", 0.25, 0.5))})
    assert repr(told).startswith("<Solution of 'drive': SOLVED, J = 0.4")
    lines = str(told).splitlines()
    assert lines[0] == told.message
    assert lines[1] == f"J = {told.cost:.6g}, T = {told.T:.6g} s"
    assert lines[2] == "guide: slip+ 0 ... 0.25 s, stick 0.25 ... 0.5 s"
    assert lines[3].startswith(f"solves: 1, iterations: {told.iterations}, ")
    assert repr(told.motions[0]).startswith("<Motion: x, v, force, friction, power over 0.4")
    assert repr(told.stored).startswith("<Stored solution of 'drive': SOLVED, J = 0.4")
    phases = str(solve_once(there_and_back(), 4)).splitlines()[1]
    assert phases.endswith("T = 2 s (out 1 s, back 1 s)")


def test_a_notebook_shows_the_motion_in_a_picture(move: Solution) -> None:
    page = move._repr_html_()
    assert page.count("data:image/png;base64,") == 1
    assert f"J = {move.cost:.6g}" in page
