"""What a trajectory answers beyond its signals: details, expressions, columns of choice."""

import csv
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, LuGre, Trajectory, rabinowicz, simulate
from symfric.integrator import simulate_by_peer
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
    assert run["phi_Fx"] == pytest.approx(-2.0 * (9.81 * np.cos(angle) + 0.5 * rate**2))


def test_details_have_units_and_no_name_twice(run: Trajectory) -> None:
    assert {"phi_Fx": "N", "phi_Mx": "N m", "friction_work_rate": "W"}.items() <= (
        run.details.items()
    )
    assert not run.details.keys() & run.units.keys()


def test_any_expression_of_the_model_at_any_time(run: Trajectory) -> None:
    model = run.model
    phi, w = (v.symbol for v in model.x)
    column = run.of(ca.vertcat(model.p[0].symbol * w, model.t), [0.25, 0.5])
    assert column.shape == (2, 2)
    assert column[0] == pytest.approx(2.0 * run.at([0.25, 0.5])["phi_rate"])
    assert column[1] == pytest.approx([0.25, 0.5])
    assert run.of(ca.sin(phi)) == pytest.approx(np.sin(run["phi"]))


def test_foreign_symbols_and_times_are_refused(run: Trajectory) -> None:
    with pytest.raises(ValueError, match=r"symbols of its model, got alien"):
        run.of(ca.SX.sym("alien"))
    with pytest.raises(ValueError, match=r"expected times in \[0, 1\] s, got 2"):
        run.of(run.model.t, [2.0])
    with pytest.raises(ValueError, match=r"expected times in \[0, 1\] s"):
        run.integral("phi", [-1.0])


@pytest.mark.parametrize("ask", [lambda r: r["phi_Fq"], lambda r: r.integral("phi_Fq"),
                                 lambda r: r.plot("phi_Fq")])  # fmt: skip
def test_unknown_names_get_a_hint_among_details_too(run: Trajectory, ask: object) -> None:
    with pytest.raises(ValueError, match=r"got phi_Fq; did you mean phi_F"):
        ask(run)  # type: ignore[operator]


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
