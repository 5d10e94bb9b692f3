import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from phases import there_and_back, unit_move

from ocp import Phase, Problem, integral, solve, verify
from ocp.solving.motion import along
from ocp.solving.one_solve import solve_once
from ocp.solving.solution import SOLUTION, Solution, load
from ocp.solving.starts import start_of
from ocp.transcription.schemes import Legendre, make_meshes
from ocp.transcription.transcribe import discretise
from symfric.foundation import storable
from symfric.laws import BrownMcPhee
from symfric.scenes import drive


@pytest.fixture(scope="module")
def back() -> Solution:
    return solve_once(there_and_back(), [5, 7], Legendre(2))


def test_what_is_saved_comes_back(back: Solution, tmp_path: Path) -> None:
    back.save(tmp_path / "back.npz")
    loaded = load(tmp_path / "back.npz")
    assert loaded.to_dict() == back.to_dict()
    assert loaded.plot().axes
    old, new = back.stored, loaded.stored
    for name in ("name", "status", "message", "cost", "structure", "chosen"):
        assert getattr(old, name) == getattr(new, name)
    for name in ("w", "lam_w", "lam_g"):
        np.testing.assert_array_equal(getattr(old.iterate, name), getattr(new.iterate, name))
    for one, two in zip(old.spans, new.spans, strict=True):
        assert (one.scenario, one.phase, one.T) == (two.scenario, two.phase, two.T)
        assert dict(one.x_end) == dict(two.x_end)
        for letter in "xzu":
            np.testing.assert_equal(dict(getattr(one, letter)), dict(getattr(two, letter)))
        np.testing.assert_array_equal(one.mesh, two.mesh)
    again = discretise(back.problem, Legendre(2)).on(make_meshes(back.problem, [5, 7]))
    start, warm = start_of(again, new)
    assert warm
    np.testing.assert_allclose(start.w, back.iterate.w, atol=1e-12)


@pytest.mark.slow
def test_all_of_a_solution_comes_back_to_the_bit(tmp_path: Path) -> None:
    """One with re-simulated motions and modes, by lambdas that no file takes."""
    law = BrownMcPhee(mu_s=6.0, mu_d=4.0, mu_v=0.5, v_t=1e-5, N_t=1e-3)
    ends = {"start": {"x": 0.0, "v": 0.0}, "end": {"x": 0.1, "v": 0.0}}
    path = [lambda s: s.force <= 20.0, lambda s: s.force >= -20.0]
    phase = Phase(drive(law, m=1.0, N=1.0), T=0.2, **ends, path=path)
    found = solve(Problem(phase, integral(lambda s: s.force**2)), intervals=12)
    found.save(tmp_path / "move.npz")
    back = load(tmp_path / "move.npz")
    for copy in (back, pickle.loads(pickle.dumps(found)), load_again(back, tmp_path)):
        assert copy.to_dict() == found.to_dict()
        assert (repr(copy), str(copy)) == (repr(found), str(found))
        for name, values in found.signals.items():
            np.testing.assert_array_equal(copy[name], values)
        for one, other in zip(found.trajectories, copy.trajectories, strict=True):
            t = np.linspace(*one.span, 77)
            np.testing.assert_array_equal(one.at(t)["v"], other.at(t)["v"])
        assert len(copy.plot().axes) == len(found.plot().axes)
    assert verify(back).to_dict() == verify(found).to_dict()
    assert solve_once(found.problem, 12, guess=back).ok
    with pytest.raises(ValueError, match="solve: expected a problem"):
        solve(back.problem)
    with pytest.raises(AttributeError, match="keeps, got cost; write the problem again"):
        _ = back.problem.cost


def load_again(back: Solution, folder: Path) -> Solution:
    back.save(folder / "again.npz")
    return load(folder / "again.npz")


def test_a_table_of_pandas() -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    found = solve_once(unit_move(), 5)
    frame = found.to_dataframe()
    np.testing.assert_array_equal(frame.index, found.t)
    np.testing.assert_array_equal(frame["x"], found["x"])
    assert frame.attrs["units"]["x"] == found.units["x"]


def test_a_saved_solution_starts_another_mesh_and_scheme(back: Solution, tmp_path: Path) -> None:
    back.save(tmp_path / "back")
    finer = solve_once(back.problem, 12, guess=load(tmp_path / "back"))
    assert finer.ok


def test_signals_anywhere_are_those_of_the_polynomials(back: Solution) -> None:
    """x is a cubic in time where a is linear over phases; here a is constant on intervals."""
    out = back.stored.spans[0]
    s = np.linspace(0.0, 1.0, 21)
    k = np.minimum((s * 5).astype(int), 4)
    t = s - k / 5
    x, v, a = out.x["x"][k, 0], out.x["v"][k, 0], out.u["a"][k]
    found = out.at("x", s)
    np.testing.assert_allclose(found, x + v * t + a * t**2 / 2, atol=1e-9)  # type: ignore[arg-type]
    assert out.at("y", s) is None
    joined = along(back.stored.spans, "x", np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(joined, [0.0, 1.0, 0.0], atol=1e-8)  # type: ignore[arg-type]
    assert along(back.stored.spans, "y", s) is None


def test_files_of_others_are_refused(tmp_path: Path) -> None:
    text = tmp_path / "some.json"
    text.write_text("{}")
    np.savez(tmp_path / "other.npz", head=np.array(json.dumps({"kind": "else"})))
    np.savez(tmp_path / "plain.npz", a=np.arange(3))
    np.save(tmp_path / "one.npy", np.arange(3))
    np.savez(tmp_path / "pickled.npz", head=np.array([object()]))
    for name in ("some.json", "other.npz", "plain.npz", "one.npy", "pickled.npz"):
        with pytest.raises(ValueError, match="expected a file that symfric wrote"):
            load(tmp_path / name)
    with pytest.raises(ValueError, match=r"load .*: expected a saved solution, got no such"):
        load(tmp_path / "missing.npz")
    with pytest.raises(ValueError, match=r"ocp.load .*: expected a saved solution, got a folder"):
        load(tmp_path)


def test_another_version_is_told(tmp_path: Path) -> None:
    about = json.dumps({"kind": SOLUTION.kind, "format": 99, "content": None}).encode()
    np.savez(tmp_path / "late.npz", about=np.frombuffer(about, np.uint8))
    with pytest.raises(ValueError, match="expected format 3 or older, got 99; it was written by a"):
        load(tmp_path / "late.npz")


def test_a_file_that_ends_too_early_is_refused(tmp_path: Path) -> None:
    solve_once(unit_move(), 5).save(tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    for part in (10, len(data) // 2, len(data) - 30):
        (tmp_path / "part.npz").write_bytes(data[:part])
        with pytest.raises(ValueError, match=r"ocp\.load '"):
            load(tmp_path / "part.npz")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("oldest", "named"), [(False, "ocp.formulation.serialise:"), (True, "ocp.text.posed:")]
)
def test_file_that_names_modules_of_an_older_version_loads(
    back: Solution, tmp_path: Path, oldest: bool, named: str
) -> None:
    back.save(tmp_path / "back.npz")
    with np.load(tmp_path / "back.npz") as held:
        arrays = dict(held)
    text = arrays["about"].tobytes().decode()
    pairs = list(storable.names()["moved"].items())
    for old, new in pairs[::-1] if oldest else pairs:
        text = text.replace(f'"{new}:', f'"{old}:')
    assert named in text
    assert "ocp.result.solution:" in text
    arrays["about"] = np.frombuffer(text.encode(), np.uint8)
    np.savez(tmp_path / "old.npz", **arrays)
    assert load(tmp_path / "old.npz").to_dict() == back.to_dict()
