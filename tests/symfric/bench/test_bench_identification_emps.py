from math import isnan
from pathlib import Path

import numpy as np
import pytest

from identification import Dataset, synthetic_drive_data
from symfric import Coulomb, Sum, Viscous, drive, law_from_text, with_values
from symfric.bench import identification_measured as measured
from symfric.integrator import Hold, simulate


def test_without_data_rows_say_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured, "EMPS", tmp_path)
    rows = list(measured.emps(quick=True))
    assert rows
    assert all(isnan(row.value) and not row.met and "absent" in row.note for row in rows)


def test_a_free_run_of_the_true_drive_leaves_the_noise() -> None:
    model = drive(Sum((Coulomb(20.0), Viscous(200.0))), m=95.0, N=1.0)
    t = np.arange(800) * 1e-3
    force = 60 * np.sin(8 * t)
    x = simulate(model, t[-1], u={"force": Hold(t, force)}, t_eval=t, rtol=1e-8)["x"]
    x = x + 1e-6 * np.random.default_rng(0).standard_normal(t.size)
    (record,) = Dataset.of(t=t, x=x, force=force, units={"x": "m", "force": "N"}, name="true")
    assert measured.free_run(model, record) < 5e-6
    wrong = drive(Sum((Coulomb(20.0), Viscous(250.0))), m=95.0, N=1.0)
    assert measured.free_run(wrong, record) > 1e-5


@pytest.mark.slow
def test_the_law_with_two_directions_is_chosen_where_there_are_two() -> None:
    two = measured.DIRECTIONS[1]
    sides = {"mu_d_pos": 20.0, "mu_d_neg": 24.0, "sigma_2_pos": 160.0, "sigma_2_neg": 240.0}
    law = with_values(law_from_text(two), sides | {"v_eps_pos": 1e-3, "v_eps_neg": 1e-3})
    data = synthetic_drive_data(law, speeds=(0.01, 0.05, 0.1), dwell=0.3)
    assert measured.closed_loop(data).law == two


@pytest.mark.slow
@pytest.mark.skipif(
    not measured.EMPS.is_dir(), reason="needs the EMPS benchmark in ../shared/data/EMPS"
)
def test_the_measured_drive_in_its_loop_reaches_the_goals() -> None:
    rows = {row.what: row for row in measured.emps(quick=True)}
    assert rows["closed loop x [%]"].met
    assert rows["closed loop force [%]"].met
    assert rows["open loop, round windows [mm]"].value < 6.5
    assert rows["open loop [mm]"].value < 9.0
    assert "asymmetric" in rows["open loop [mm]"].note
