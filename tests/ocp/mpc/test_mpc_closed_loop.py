"""Closed loops with plants whose friction differs from that of the controller."""

import csv
from pathlib import Path

import numpy as np
import pytest
from receding import controller, rubbing

from ocp.mpc.closed_loop import ClosedLoopRun
from ocp.mpc.design import CycleStatus
from symfric import ExactCoulomb, LuGre, drive, rabinowicz
from symfric.model import Model

PLANTS = {
    "sharper": lambda: rubbing(1e-4),
    "LuGre": lambda: drive(
        LuGre(mu_s=6.0, mu_d=4.0, v_s=1e-2, sigma_0=1e5, sigma_1=300.0, sigma_2=0.0), m=1.0, N=1.0
    ),
    "exact": lambda: drive(ExactCoulomb(mu_s=6.0, mu_d=4.0), m=1.0, N=1.0),
}


def loop(plant: Model, t_end: float = 0.6) -> ClosedLoopRun:
    return controller().simulate(plant, t_end, {"goal": 0.1})


@pytest.mark.parametrize("plant", PLANTS)
def test_drive_reaches_its_goal_and_reports_failures(plant: str) -> None:
    found = loop(PLANTS[plant]())
    assert found["x"][-1] == pytest.approx(0.1, abs=1e-3)
    assert found["x"].max() < 0.102
    assert found.unreported == 0
    assert found.unconverged <= 6
    assert np.abs(found["force"]).max() <= 20.0
    assert found.t.size == 60


def test_second_opinion_is_the_residual() -> None:
    found = loop(rubbing(), 0.3)
    np.testing.assert_allclose(found.checked, found.residual, rtol=1e-5, atol=1e-8)


def test_claims_that_are_wrong_are_found() -> None:
    found = loop(rubbing(), 0.05)
    found.status[0] = CycleStatus.CONVERGED
    found.checked[0] = 1.0
    assert found.unreported == 1


def test_noise_is_the_same_every_time() -> None:
    a, b = (
        controller().simulate(rubbing(), 0.05, {"goal": 0.1}, noise={"v": 1e-3}, check=False)
        for _ in range(2)
    )
    assert a["x"].tolist() == b["x"].tolist()
    assert np.isnan(a.checked).all()


def test_run_has_a_table_a_plot_and_a_file(tmp_path: Path) -> None:
    found = controller().simulate(
        rubbing(), 0.03, {"goal": lambda t: 0.1 * np.sin(t)}, x0={"x": 0.02}, check=False
    )
    assert "unreported      0" in found.table()
    assert found.to_dict()["cycles"] == 3
    found.to_csv(tmp_path / "loop.csv")
    rows = list(csv.reader((tmp_path / "loop.csv").read_text().splitlines()))
    assert rows[0][:2] == ["t [s]", "x [m]"]
    assert len(rows) == 4
    found.plot("x", "force", path=tmp_path / "loop.png")
    assert (tmp_path / "loop.png").stat().st_size > 1000


def test_plant_without_the_signals_is_refused() -> None:
    with pytest.raises(ValueError, match="inputs of plant 'rabinowicz'"):
        controller().simulate(rabinowicz(LuGre()), 0.1, {"goal": 0.1})
