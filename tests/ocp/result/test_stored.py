import json
from pathlib import Path

import numpy as np
import pytest
from phases import there_and_back, unit_move

from ocp.result.solution import Solution
from ocp.result.stored import KIND, along, load
from ocp.solving.one_solve import solve_once
from ocp.solving.starts import start_of
from ocp.transcription.grid import make_meshes
from ocp.transcription.schemes import Legendre
from ocp.transcription.transcribe import discretise


@pytest.fixture(scope="module")
def back() -> Solution:
    return solve_once(there_and_back(), [5, 7], Legendre(2))


def test_what_is_saved_comes_back(back: Solution, tmp_path: Path) -> None:
    back.save(tmp_path / "back.npz")
    old, new = back.stored, load(tmp_path / "back.npz")
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
        with pytest.raises(ValueError, match=r"expected a file that solution\.save\(path\) wrote"):
            load(tmp_path / name)
    with pytest.raises(ValueError, match=r"load .*: expected a saved solution, got no such file"):
        load(tmp_path / "missing.npz")
    with pytest.raises(ValueError, match=r"load .*: expected a saved solution, got a folder"):
        load(tmp_path)


def test_another_version_is_told(tmp_path: Path) -> None:
    head = {"kind": KIND, "format": 99}
    np.savez(tmp_path / "late.npz", head=np.array(json.dumps(head)))
    with pytest.raises(ValueError, match="expected format 1, got 99; it was written by another"):
        load(tmp_path / "late.npz")


def test_a_file_that_ends_too_early_is_refused(tmp_path: Path) -> None:
    solve_once(unit_move(), 5).save(tmp_path / "whole.npz")
    data = (tmp_path / "whole.npz").read_bytes()
    for part in (10, len(data) // 2, len(data) - 30):
        (tmp_path / "part.npz").write_bytes(data[:part])
        with pytest.raises(ValueError, match="load '"):
            load(tmp_path / "part.npz")
    assert len(list(tmp_path.iterdir())) == 2
