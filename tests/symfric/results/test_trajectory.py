"""What a trajectory answers beyond its signals: details, expressions, columns of choice."""

import csv
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Trajectory, rabinowicz, simulate
from symfric.integrator import simulate_by_peer
from symfric.results import stored
from symfric.scenes import MECHANISMS, Pendulum


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(Pendulum(BrownMcPhee()).model(["m"]), 1.0, samples=21, p={"m": 2.0}, rtol=1e-8)


def test_a_detail_is_a_signal_by_name(run: Trajectory) -> None:
    """Half a metre, and the mass that was given to the run."""
    assert "rod_x" not in run.units
    assert run.unit("rod_x") == "m"
    assert run["rod_x"] == pytest.approx(0.5 * np.sin(run["phi"]))
    angle, rate = run["phi"], run["phi_rate"]
    assert {"phi_Fx": "N", "phi_Mx": "N m", "friction_work_rate": "W"}.items() <= (
        run.details.items()
    )
    assert not run.details.keys() & run.units.keys()
    assert run["phi_Fx"] == pytest.approx(-2.0 * (9.81 * np.cos(angle) + 0.5 * rate**2))


def test_any_expression_of_the_model_at_any_time(run: Trajectory) -> None:
    model = run.model
    phi, w = (v.symbol for v in model.x)
    column = run.of(ca.vertcat(model.p[0].symbol * w, model.t), [0.25, 0.5])
    assert column.shape == (2, 2)
    assert column[0] == pytest.approx(2.0 * run.at([0.25, 0.5])["phi_rate"])
    assert column[1] == pytest.approx([0.25, 0.5])
    assert run.of(ca.sin(phi)) == pytest.approx(np.sin(run["phi"]))


def test_foreign_symbols_times_and_names_are_refused(run: Trajectory) -> None:
    times, name = r"expected times in \[0, 1\] s", "got phi_Fq; did you mean phi_F"
    for call, message in (
        (lambda: run.of(ca.SX.sym("alien")), r"symbols of its model, got alien"),
        (lambda: run.of(run.model.t, [2.0]), f"{times}, got 2"),
        (lambda: run.integral("phi", [-1.0]), times),
        (lambda: run["phi_Fq"], name),
        (lambda: run.integral("phi_Fq"), name),
        (lambda: run.plot("phi_Fq"), name),
    ):
        with pytest.raises(ValueError, match=message):
            call()


def test_columns_of_choice_are_written(run: Trajectory, tmp_path: Path) -> None:
    run.to_csv(tmp_path / "x.csv", "phi", "phi_Fx")
    with (tmp_path / "x.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["t [s]", "phi [rad]", "phi_Fx [N]"]
    assert [float(row[2]) for row in rows] == pytest.approx(run["phi_Fx"])


def test_a_model_without_details_has_accelerations_alone() -> None:
    run = simulate(rabinowicz(LuGre()), 0.1, samples=3)
    assert run.details == {"x_acc": "m/s^2"}
    with pytest.raises(ValueError, match="got wok_rate"):
        run["wok_rate"]


def test_details_of_a_peer_show_its_drift() -> None:
    """Nothing is refined behind CasADi's integrators, neither signals nor expressions."""
    model = MECHANISMS["four_mass"](BrownMcPhee(v_t=0.1)).model()
    run = simulate_by_peer(model, 0.5, "rosenbrock", samples=5)
    assert run["constraint_position"].max() > 1e-10
    assert run.of(model.expression("constraint_position")) == pytest.approx(
        run["constraint_position"], abs=1e-15
    )


def test_tables_of_pandas_and_xarray(run: Trajectory) -> None:
    pytest.importorskip("pandas", reason="needs the package pandas")
    pytest.importorskip("xarray", reason="needs the package xarray")
    frame, data, some = run.to_dataframe(), run.to_xarray(), run.to_dataframe("phi", "phi_Fx")
    assert list(frame.columns) == list(run.units)
    assert frame.index.name == "t"
    np.testing.assert_array_equal(frame.index.to_numpy(), run.t)
    np.testing.assert_array_equal(frame["phi"].to_numpy(), run["phi"])
    assert list(some.columns) == ["phi", "phi_Fx"]
    assert some.attrs["units"] == {"t": "s", "phi": "rad", "phi_Fx": "N"}
    assert {name: array.attrs["units"] for name, array in data.items()} == run.units
    assert (data["t"].attrs["units"], data.attrs["scene"]) == ("s", "pendulum")
    np.testing.assert_array_equal(data["phi"].values, run["phi"])


def test_without_their_packages_there_is_a_sentence(
    run: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(stored, "import_module", none)
    for call, package in ((run.to_dataframe, "pandas"), (run.to_xarray, "xarray")):
        message = f"expected the package {package}, got none; .*pip install {package}"
        with pytest.raises(ImportError, match=message):
            call()
