"""Solutions: signals, tables, files and pictures."""

import csv
import json
import pickle
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle, StepPatch
from phases import UNIT, algebraic_move, fastest_move, solve_once, there_and_back, unit_move

from ocp import Phase, Problem, integral, solve, verify
from ocp.checking.verify import verified
from ocp.problems import guide
from ocp.solving.motion import Stretch, along, span_motions
from ocp.solving.picture import plot_solutions
from ocp.solving.solution import SOLUTION, Mode, Solution, load
from ocp.solving.starts import start_of
from ocp.transcription.schemes import Legendre, Radau, make_meshes
from ocp.transcription.transcribe import discretise
from symfric import Hold, Model, Variable, simulate
from symfric.foundation import storable
from symfric.scenes import drive


@pytest.fixture(scope="module")
def move() -> Solution:
    return solve_once(fastest_move(0.1), 20)


@pytest.fixture(scope="module")
def back() -> Solution:
    problem = there_and_back(bounds={"a": (-20.0, 20.0), "power": (None, 50.0)})
    return solve_once(problem, [5, 7], Legendre(2))


@cache
def two() -> Solution:
    return solve_once(unit_move(scenarios={"dry": {}, "oiled": {}}), 3)


# --- signals ------------------------------------------------------------------------------------


def test_signals_are_known_at_nodes_and_collocation_points(move: Solution) -> None:
    assert list(move.signals) == ["x", "v", "force", "friction", "power"]
    assert move.t.shape == (61,)
    assert all(values.shape == move.t.shape for values in move.signals.values())
    assert (move.t[0], move.t[-1]) == (0.0, move.T)
    assert (np.diff(move.t) > 0).all()
    assert (list(move.states), list(move.inputs)) == (["x", "v"], ["force"])
    np.testing.assert_array_equal(move["t"], move.t)
    np.testing.assert_array_equal(move.t[move.motions[0].nodes][:-1], move.t_control)
    np.testing.assert_allclose(move["power"], move["friction"] * move["v"])
    np.testing.assert_array_equal(move["force"][:-1], np.repeat(move.controls["force"], 3))
    np.testing.assert_array_equal(move.t_control, move.t[:-1:3])
    with pytest.raises(ValueError, match=r"solution of 'drive': .* got forse; did you mean force"):
        move["forse"]


@pytest.mark.parametrize(("scheme", "inside"), [(Radau(2), 1), (Legendre(2), 2)])
def test_points_of_a_scheme_are_in_the_order_of_time(scheme: Radau | Legendre, inside: int) -> None:
    """With 0 = z - v: z at the nodes is extrapolated through the collocation points before."""
    solution = solve_once(unit_move(model=algebraic_move()), 4, scheme)
    assert solution.t.size == 4 * (inside + 1) + 1
    nodes = scheme.coefficients().nodes
    np.testing.assert_allclose(solution.t[: inside + 1] * 4, nodes[: inside + 1])
    interval = np.minimum(np.arange(solution.t.size) // (inside + 1), 3)
    start = interval * (inside + 1)
    t = solution.t - solution.t[start]
    x, v, a = solution["x"][start], solution["v"][start], solution.controls["a"][interval]
    np.testing.assert_allclose(solution["x"], x + v * t + a * t**2 / 2, atol=1e-9)
    np.testing.assert_allclose(solution["z"][1:], solution["v"][1:], atol=1e-9)


def test_phases_share_a_time_where_nothing_jumps(back: Solution) -> None:
    assert back.phases == (Stretch("out", 0.0, 1.0), Stretch("back", 1.0, 1.0))
    assert back.phases[1].end == back.T == 2.0
    assert back.t.size == 3 * 12 + 1
    assert (np.diff(back.t) > 0).all()
    np.testing.assert_allclose(back["x"][15], 1.0)
    assert back["a"][15] == back.controls["a"][5]
    np.testing.assert_allclose(back.t_control, [*(np.arange(5) / 5), *(1 + np.arange(7) / 7)])


def test_jumps_and_signals_that_a_phase_lacks() -> None:
    y, w = Variable("y", "m"), Variable("w", "m/s")
    other = Model("other", x=(y,), u=(w,), ode=w.symbol)
    before = Phase(UNIT, 1.0, end={"x": 1.0, "v": 0.0}, cost=integral(lambda s: s.a**2))
    after = Phase(other, 1.0, link={"y": "x"}, end={"y": 0.0}, cost=integral(lambda s: s.w**2))
    solution = solve_once(Problem(before >> after), 4)
    assert solution.t.size == 2 * 13
    assert solution.t[12] == solution.t[13] == 1.0
    assert np.isnan(solution["y"][:13]).all()
    assert np.isnan(solution["x"][13:]).all()
    np.testing.assert_allclose(solution["y"][[13, -1]], [1.0, 0.0], atol=1e-9)
    assert np.isnan(solution.controls["w"][:4]).all()
    assert solution.to_dict()["motions"][0]["signals"]["y"][0] is None
    assert solution.units["y"] == "m"


def test_scenarios_have_motions_of_their_own() -> None:
    assert [motion.name for motion in two().motions] == ["dry", "oiled"]
    np.testing.assert_allclose(two().scenarios["oiled"]["x"], two()["x"])
    with pytest.raises(ValueError, match="solution: expected one of x, v, a, power, got b"):
        two().scenarios["oiled"]["b"]


def test_signals_between_points_are_those_of_the_polynomials(back: Solution) -> None:
    spans = span_motions(back.problem, back.scheme, back.meshes, back.points)
    out, points = spans[0], back.points.spans[0]
    s = np.linspace(0.0, 1.0, 21)
    k = np.minimum((s * 5).astype(int), 4)
    t = s - k / 5
    (x, v), a = points.nodes[:, k], points.u[0][k]
    np.testing.assert_allclose(out.at("x", s), x + v * t + a * t**2 / 2, atol=1e-9)  # type: ignore[arg-type]
    assert out.at("y", s) is None
    joined = along(spans, "x", np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(joined, [0.0, 1.0, 0.0], atol=1e-8)  # type: ignore[arg-type]
    assert along(spans, "y", s) is None


# --- tables and texts ---------------------------------------------------------------------------


def rows_of(path: Path) -> tuple[list[str], list[list[str]]]:
    header, *rows = csv.reader(path.read_text().splitlines())
    return header, rows


def test_csv_contains_the_control(move: Solution, tmp_path: Path) -> None:
    move.to_csv(tmp_path / "move.csv")
    header, rows = rows_of(tmp_path / "move.csv")
    assert header == ["t [s]", "x [m]", "v [m/s]", "force [N]", "friction [N]", "power [W]"]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 1], move["x"])
    control = Hold(table[:, 0], table[:, 3])
    again = simulate(move.problem.spans[0].model, move.T, u={"force": control}, rtol=1e-9)
    assert again["x"][-1] == pytest.approx(move["x"][-1], abs=2e-3)
    two().to_csv(tmp_path / "two.csv")
    header, rows = rows_of(tmp_path / "two.csv")
    assert header[:2] == ["scenario", "t [s]"]
    assert [row[0] for row in rows] == ["dry"] * 10 + ["oiled"] * 10


def test_json_holds_everything_as_plain_data(move: Solution, tmp_path: Path) -> None:
    solution = replace(move, modes={"guide": (Mode("slip+", 0.0, move.T),)})
    solution.to_json(tmp_path / "move.json")
    data = json.loads((tmp_path / "move.json").read_text())
    assert data == solution.to_dict()
    assert (data["scene"], data["status"], data["units"]["force"]) == ("drive", "SOLVED", "N")
    assert data["T"] == move.T == pytest.approx(data["cost"])
    assert data["modes"] == {"guide": [{"kind": "slip+", "begin": 0.0, "end": move.T}]}
    assert (data["verified"], data["verification"]) == (False, None)
    # a copy of the state at each node, three points and an input per interval, T
    counts = move.statistics
    assert (counts.unknowns, counts.constraints) == (2 * 21 + 20 * 7 + 1, 20 * 6 + 20 * 2)
    assert data["statistics"]["iterations"] == counts.iterations == move.iterations > 0
    assert counts.solves == 1


def test_texts_fit_in_a_few_lines(move: Solution, back: Solution) -> None:
    modes = {"guide": (Mode("slip+", 0.0, 0.25), Mode("stick", 0.25, 0.5))}
    solution = replace(move, modes=modes)
    assert repr(solution).startswith("<Solution of 'drive': SOLVED, J = 0.4")
    *lines, last = str(solution).splitlines()
    assert lines == [
        solution.message,
        f"J = {solution.cost:.6g}, T = {solution.T:.6g} s",
        "active: force <= 20 (0 ... 0.2749 s); force >= -20 (0.2978 ... 0.4582 s)",
        "guide: slip+ 0 ... 0.25 s, stick 0.25 ... 0.5 s",
    ]
    assert last.startswith(f"solves: 1, iterations: {solution.iterations}, ")
    assert repr(move.motions[0]).startswith("<Motion: x, v, force, friction, power over 0.4")
    assert str(back).splitlines()[1].endswith("T = 2 s (out 1 s, back 1 s)")
    page = move._repr_html_()
    assert page.count("data:image/png;base64,") == 1
    assert f"J = {move.cost:.6g}" in page


def test_table_of_pandas(move: Solution) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    frame = move.to_dataframe()
    np.testing.assert_array_equal(frame.index, move.t)
    np.testing.assert_array_equal(frame["x"], move["x"])
    assert frame.attrs["units"]["x"] == move.units["x"]


# --- files --------------------------------------------------------------------------------------


def test_saved_solution_is_equal_and_a_start(back: Solution, tmp_path: Path) -> None:
    back.save(tmp_path / "back")
    loaded = load(tmp_path / "back")
    assert loaded.to_dict() == back.to_dict()
    assert loaded.plot().axes
    for name in ("w", "lam_w", "lam_g"):
        np.testing.assert_array_equal(getattr(back.iterate, name), getattr(loaded.iterate, name))
    again = discretise(back.problem, Legendre(2)).on(make_meshes(back.problem, [5, 7]))
    start, warm = start_of(again, loaded)
    assert warm
    np.testing.assert_allclose(start.w, back.iterate.w, atol=1e-12)
    assert solve_once(back.problem, 12, guess=loaded).ok


@pytest.mark.slow
def test_all_of_a_solution_is_saved_to_the_bit(tmp_path: Path) -> None:
    """One with re-simulated motions and modes, by lambdas that no file holds."""
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    phase = Phase(drive(guide(1e-5), m=1.0, N=1.0), T=0.2, **ends, path=[lambda s: s.force <= 20])
    found = solve(Problem(phase, integral(lambda s: s.force**2)), intervals=12)
    found.save(tmp_path / "move.npz")
    back = load(tmp_path / "move.npz")
    back.save(tmp_path / "again.npz")
    for copy in (back, pickle.loads(pickle.dumps(found)), load(tmp_path / "again.npz")):
        assert copy.to_dict() == found.to_dict()
        assert (repr(copy), str(copy)) == (repr(found), str(found))
        for name, values in found.signals.items():
            np.testing.assert_array_equal(copy[name], values)
        for one, other in zip(found.trajectories, copy.trajectories, strict=True):
            t = np.linspace(*one.span, 77)
            np.testing.assert_array_equal(one.at(t)["v"], other.at(t)["v"])
        assert len(copy.plot().axes) == len(found.plot().axes)
        assert str(copy.active()) == str(found.active())
        assert copy.condition == found.condition
    assert verify(back).to_dict() == verify(found).to_dict()
    assert solve_once(found.problem, 12, guess=back).ok
    with pytest.raises(ValueError, match="solve: expected a problem"):
        solve(back.problem)
    with pytest.raises(AttributeError, match="expected an attribute kept in files, got cost; writ"):
        _ = back.problem.cost


def test_files_of_other_programs_and_versions_are_refused(tmp_path: Path) -> None:
    (tmp_path / "some.json").write_text("{}")
    np.savez(tmp_path / "other.npz", head=np.array(json.dumps({"kind": "else"})))
    np.save(tmp_path / "one.npy", np.arange(3))
    np.savez(tmp_path / "pickled.npz", head=np.array([object()]))
    about = json.dumps({"kind": SOLUTION.kind, "format": 99, "content": None}).encode()
    np.savez(tmp_path / "late.npz", about=np.frombuffer(about, np.uint8))
    two().save(tmp_path / "whole.npz")
    (tmp_path / "part.npz").write_bytes((tmp_path / "whole.npz").read_bytes()[:-30])
    foreign = "expected a file that symfric wrote"
    for name, text in {
        "some.json": foreign, "other.npz": foreign, "one.npy": foreign, "pickled.npz": foreign,
        "missing.npz": "load .*: expected a saved solution, got no such",
        "": "ocp.load .*: expected a saved solution, got a folder",
        "late.npz": "expected format 4 or older, got 99; it was written by a",
        "part.npz": r"ocp\.load '",
    }.items():  # fmt: skip
        with pytest.raises(ValueError, match=text):
            load(tmp_path / name)


def test_files_whose_numbers_do_not_fit_the_problem_are_refused(tmp_path: Path) -> None:
    whole = two()
    best = whole.optimum
    assert best is not None
    made, found = best.transcription, best.iterate
    first, *rest = made.meshes
    for name, wrong in {
        "lam_g": replace(best, iterate=replace(found, lam_g=found.lam_g[1:])),
        "lam_w": replace(best, iterate=replace(found, lam_w=found.lam_w[None])),
        "values": replace(best, values=best.values[1:]),
        "mesh": replace(best, transcription=replace(made, meshes=(first[1:], *rest))),
        "order": replace(best, transcription=replace(made, meshes=(first[[0, 2, 1, -1]], *rest))),
    }.items():
        replace(whole, optimum=wrong).save(tmp_path / name)
        with pytest.raises(ValueError, match="or a damaged one"):
            load(tmp_path / name)


def test_file_that_names_modules_of_older_versions_loads(back: Solution, tmp_path: Path) -> None:
    back.save(tmp_path / "back.npz")
    with np.load(tmp_path / "back.npz") as held:
        arrays = dict(held)
    now = arrays["about"].tobytes().decode()
    pairs = list(storable.names()["moved"].items())
    for order, named in ((pairs, "ocp.formulation.serialise:"), (pairs[::-1], "ocp.text.posed:")):
        text = now
        for old, new in order:
            text = text.replace(f'"{new}:', f'"{old}:')
        assert named in text and "ocp.result.solution:" in text
        np.savez(tmp_path / "old.npz", **arrays | {"about": np.frombuffer(text.encode(), np.uint8)})
        assert load(tmp_path / "old.npz").to_dict() == back.to_dict()


# --- pictures -----------------------------------------------------------------------------------


def curves(axis: Axes) -> list[np.ndarray]:
    return [np.asarray(line.get_ydata()) for line in axis.lines if np.size(line.get_ydata())]


def marked(axis: Axes, marker: str) -> list[Any]:
    lines = [line for line in axis.lines if line.get_marker() == marker]
    return [(list(line.get_xdata()), list(line.get_ydata())) for line in lines]


def test_nodes_bounds_and_conditions_are_drawn(back: Solution) -> None:
    x, a, power = back.plot("x", "a", "power").axes[:3]
    nodes, line = curves(x)[:2]
    np.testing.assert_array_equal(nodes, back["x"][::3])
    np.testing.assert_array_equal(line, back["x"])
    assert [1.0, 1.0] in [list(line.get_xdata()) for line in x.lines]  # between the phases
    assert marked(x, "x") == [([0.0], [0.0]), ([1.0], [1.0]), ([2.0], [0.0])]
    (steps,) = (patch for patch in a.patches if isinstance(patch, StepPatch))
    np.testing.assert_array_equal(steps.get_data().values, back.controls["a"])
    assert steps.get_data().edges[-1] == 2.0
    dashed = [line for line in a.lines if line.get_linestyle() == "--"]
    assert {float(line.get_ydata()[0]) for line in dashed} == {-20.0, 20.0}
    assert [50.0, 50.0] in [list(line.get_ydata()) for line in power.lines]
    end = {"x": (0.9, 1.1), "v": 0.0, "power": (None, 3.0)}
    figure = solve_once(unit_move(end=end), 5).plot("x", "power")
    bars = [marked(axis, "_")[0][1] for axis in figure.axes[:2]]
    assert bars == [[0.9, 1.1], [3.0]]


def test_simulated_motions_are_drawn_where_there_are_some() -> None:
    plain = solve_once(unit_move(), 5)
    checked, figure = verified(plain), verified(plain).plot("x")
    assert plain.trajectories == ()
    (run,) = checked.trajectories
    np.testing.assert_array_equal(curves(figure.axes[0])[1], run["x"])
    assert "lines: simulated" in figure.axes[-1].get_xlabel()
    assert figure.axes[0].get_title().endswith("verified")
    assert "lines: optimised" in plain.plot("x").axes[-1].get_xlabel()


def test_costates_are_drawn_on_request(back: Solution) -> None:
    figure = back.plot("x", "costate x")
    assert [axis.get_ylabel() for axis in figure.axes] == ["x [m]", "costate x [cost/m]"]
    np.testing.assert_array_equal(curves(figure.axes[1])[1], back.costates["x"])
    with pytest.raises(ValueError, match=r"plot of .* did you mean costate x"):
        back.plot("costate y")


def test_modes_are_shaded_in_a_band_for_each_contact(back: Solution) -> None:
    modes = {
        "guide": (Mode("slip+", 0.0, 0.9), Mode("stick", 0.9, 1.1), Mode("slip-", 1.1, 2.0)),
        "wheel": (Mode("stick", 0.0, 2.0),),
    }
    axis = replace(back, modes=modes).plot("v").axes[0]
    bands = [patch for patch in axis.patches if isinstance(patch, Rectangle)]
    places = [(b.get_x(), b.get_y(), b.get_height()) for b in bands]
    assert places == [(0.0, 0.0, 0.5), (0.9, 0.0, 0.5), (1.1, 0.0, 0.5), (0.0, 0.5, 0.5)]
    assert bands[1].get_facecolor() == bands[3].get_facecolor() != bands[0].get_facecolor()
    (legend,) = axis.get_figure(root=True).legends  # type: ignore[union-attr]
    entries = [text.get_text() for text in legend.get_texts()]
    assert entries == ["slip+", "stick", "slip-", "bands from below: guide, wheel"]


def test_several_solutions_and_scenarios_are_overlaid(back: Solution, tmp_path: Path) -> None:
    failed = solve_once(unit_move(bounds={"a": (-1.0, 1.0)}), 4)
    figure = plot_solutions({"a": back, "b": two(), "c": failed}, ["x"], path=tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000
    (legend,) = figure.legends
    entries = [text.get_text() for text in legend.get_texts()]
    assert [entry.split(":")[0] for entry in entries] == ["a", "b dry", "b oiled", "c"]
    assert entries[0].startswith("a: T = 2 s, J = ")
    assert entries[3].endswith("infeasible")
    with pytest.raises(ValueError, match=r"plot of 'double integrator': .* got w"):
        back.plot("w")
    with pytest.raises(ValueError, match="plot: expected at least one solution"):
        plot_solutions({})
