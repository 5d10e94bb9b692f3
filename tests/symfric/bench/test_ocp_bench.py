"""The referee of optimal control, the other solvers, and what is measured."""

import numpy as np
import pytest

from ocp import solve
from ocp.problems import out_and_back
from symfric.bench import ocp as bench
from symfric.bench.ocp import NEAR, attempt_of, bench_ocp, landed, starts_of
from symfric.bench.ocp_contenders import Attempt, opti
from symfric.bench.ocp_costs import size_rows


def test_opti_solves_the_smooth_problem_and_misses_the_sharp_one() -> None:
    """The cost is that of our own findings by three transcriptions: 68.118 on 100 intervals."""
    found = opti(out_and_back(v_t=0.1), 100)
    assert found.cost == pytest.approx(68.118, abs=1e-3)
    assert landed(out_and_back(v_t=0.1), found) == pytest.approx(1e-3, rel=0.1)
    assert landed(out_and_back(), found) > 0.05


def test_referee_sees_a_force_that_holds_nothing() -> None:
    """5 N does not break away: the mass is 1 m off where it should be."""
    held = ({"force": np.full(4, 5.0)}, {"force": np.full(4, 5.0)})
    still = Attempt(0.0, 0, "", 0.0, (1.0, 1.0), held)
    assert landed(out_and_back(), still, exact=True) == pytest.approx(10.0)  # of 0.1 m nominal
    assert landed(out_and_back(), still) == pytest.approx(10.0, rel=1e-3)


def test_starts_are_the_default_and_others() -> None:
    first, second = list(starts_of(out_and_back(), 2, NEAR))
    assert first.keys() == {"x", "v", "force"}
    assert first["x"][[0, 100, -1]] == pytest.approx([0.0, 1.0, 0.0], abs=0.02)
    assert np.abs(second["x"] - first["x"]).max() > 0.01


def test_rows_say_what_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "INTERVALS", 50)
    result = bench_ocp(quick=True, cases=["bryson_denham"])
    ours, other = result.rows
    assert (ours.solver, other.solver) == ("symfric", "Opti")
    assert ours.count == 3
    assert ours.landed == 1.0
    assert ours.best == 1.0
    assert result.to_dict()["rows"][0]["case"] == "bryson_denham"


def test_attempt_holds_the_controls_of_each_phase() -> None:
    found = solve(out_and_back(v_t=0.1), friction="smooth", intervals=20, throw=False)
    attempt = attempt_of(found, 0.0)
    assert attempt.durations == (1.0, 1.0)
    assert attempt.meshes is not None
    assert sum(mesh.size for mesh in attempt.meshes) == found.t_control.size


def test_programs_grow_with_their_intervals() -> None:
    small, large = list(size_rows(True))[:2]
    assert large.nonzeros == pytest.approx(4 * small.nonzeros, rel=0.01)
