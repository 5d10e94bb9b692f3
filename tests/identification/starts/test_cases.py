"""Whole fits from the data's own starts: points, raw files, an arm at low speed, ten elements."""

from pathlib import Path

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.points import Points
from symfric import Dahl
from symfric.bench.identification_measured import FRANKA, franka
from symfric.bench.identification_simulated import gms


def test_a_raw_file_of_points_takes_three_lines(tmp_path: Path) -> None:
    v = np.repeat(np.arange(20, 501, 20), 3)
    F = 2.0 + 2.0 * np.exp(-((v / 100) ** 2)) + 0.003 * v
    np.savetxt(tmp_path / "raw.txt", np.column_stack([v, F]), fmt="%.5f")

    file = tmp_path / "raw.txt"
    data = Dataset.read(file, columns=["v", "F"], units={"v": "mm/min", "F": "N"}, points=True)
    fit = Fit(Points(), "steady_state_lugre", data).solve()

    assert abs(fit.parameters["v_s"].value * 60e3 / 100 - 1) < 1e-2


def test_stiffness_of_a_bristle_from_pre_sliding() -> None:
    t = 0.01 * np.arange(800)
    x = 4e-5 * np.sin(1.7 * t) + 2e-5 * np.sin(4.1 * t)
    F = np.zeros(t.size)
    for i, dx in enumerate(np.diff(x)):
        side = np.sign(dx)
        F[i + 1] = side * 2 + (F[i] - side * 2) * np.exp(-3e5 / 2 * abs(dx))
    F += 0.02 * np.random.default_rng(0).standard_normal(t.size)

    data = Dataset.of(t=t, v=np.gradient(x, t), F=F, units={"v": "m/s", "F": "N"})
    fit = Fit(Points(), Dahl(), data, starts=1).solve(throw=False)

    assert abs(fit.parameters["sigma_0"].value / 3e5 - 1) < 0.05
    assert fit.starts[0].evaluations < 30


@pytest.mark.slow
@pytest.mark.skipif(not FRANKA.is_dir(), reason="needs the arm in ../shared/data")
def test_memory_meets_both_goals_of_the_arm() -> None:
    rows = [row for _, row in franka(quick=False) if "GMS" in row["quantity"]]
    assert [row["met"] for row in rows] == ["yes", "yes"]


@pytest.mark.slow
def test_four_elements_are_found_from_hysteresis() -> None:
    assert all(row["met"] == "yes" for _, row in gms(quick=True))
