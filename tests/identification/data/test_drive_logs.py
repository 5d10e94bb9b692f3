"""Logs of drives in amperes and counts, converted to the motion and force of the load."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from identification import Dataset, Fit, Fitted, InverseDynamics, load_fit, synthetic_drive_data
from identification.data.differentiate import noise_of
from symfric import Drive

SCREW: dict[str, Any] = {
    "torque_constant": 0.12, "gear_ratio": 2.0, "lead": 5e-3, "efficiency": (0.9, 0.8),
    "rotor_inertia": 6e-6, "counts_per_turn": 65536,
}  # fmt: skip
T = np.arange(0.0, 2.0, 1e-3)


def stroke() -> NDArray[np.float64]:
    return 0.05 * np.sin(3 * T)


def read(drive: Drive | None, columns: dict[str, NDArray[np.float64]], **how: Any) -> Any:
    return Dataset.of({"t [s]": T, **columns}, drive=drive, **how)[0]


def lossless(**changes: Any) -> Drive:
    return Drive(**{**SCREW, "efficiency": 1.0, **changes})


@pytest.mark.parametrize("ratio", [2.0, -2.0, 1000.0])
def test_counts_and_currents_become_position_and_force(ratio: float) -> None:
    d, x, i = (
        lossless(gear_ratio=ratio, counter=65536, counts_per_turn=400),
        stroke(),
        np.cos(3 * T),
    )
    counts = np.rint(x / float(d.count or 0))
    record = read(d, {"counts [counts]": counts % 65536, "iq [mA]": 1e3 * i})
    assert (record.units["x"], record.units["force"]) == ("m", "N")
    assert np.abs(np.ptp(record["x"] - x)) <= 2 * abs(float(d.count or 0))
    assert np.allclose(record["force"], i * 0.12 * ratio * 2 * np.pi / 5e-3, rtol=1e-12)
    assert record.drive is d


def test_a_counter_that_wraps_too_fast_is_refused() -> None:
    d = lossless(gear_ratio=1000.0, counter=65536)
    counts = np.rint(stroke() / float(d.count or 0)) % 65536
    with pytest.raises(ValueError, match="at most 35% of the counter 65536 per sample, got 50%"):
        read(d, {"counts [counts]": counts, "current [A]": T})


def test_angles_and_speeds_of_the_motor_become_those_of_the_load() -> None:
    d, x = lossless(), stroke()
    v = np.gradient(x, T)
    turns, rpm = x / 5e-3 * 2, v / 5e-3 * 2 * 60
    record = read(d, {"angle [rev]": turns, "speed [rpm]": rpm, "current [A]": v})
    assert np.allclose(record["x"], x)
    assert np.allclose(record["v"], v)
    assert np.allclose(read(d, {"position [mm]": 1e3 * x, "current [A]": v})["x"], x)
    rotary = Drive(torque_constant=1.0, gear_ratio=10.0, encoder="load")
    record = read(rotary, {"angle [deg]": np.degrees(x), "current [A]": v})
    assert np.allclose(record["x"], x)
    assert np.allclose(record["force"], 10 * v)
    assert record.units["force"] == "N m"


def test_losses_use_the_direction_of_the_measured_motion() -> None:
    d, x = Drive(**SCREW), stroke()
    v, i = 0.15 * np.cos(3 * T), np.full(T.size, 2.0)
    record = read(d, {"counts [counts]": np.rint(x / float(d.count or 0)), "current [A]": i})
    F_m = 2.0 * float(d.force_constant)
    sure = np.abs(v) > 0.02
    expected = np.where(v > 0, 0.9 * F_m, F_m / 0.8)
    assert np.allclose(record["force"][sure], expected[sure], rtol=1e-9)
    uneven = T + 1e-4 * np.sin(40 * T)
    by_rate = Dataset.of({"t [s]": uneven, "x [m]": x, "current [A]": i}, drive=d)[0]
    assert np.allclose(by_rate["force"][sure], expected[sure], rtol=1e-6)


@pytest.fixture(scope="module")
def fits() -> tuple[Fitted, Fitted]:
    """Return the fits to forces of the load, and to the currents and wrapped counts for them."""
    data = synthetic_drive_data(seed=1, rate=500.0, force_noise=0.3)
    x, force = data[0]["x"], data[0]["force"]
    d = Drive(**{**SCREW, "gear_ratio": -2.0, "counter": 65536})
    counts = np.rint(x / float(d.count or 0)) % 65536
    v = np.gradient(x, data[0].time)
    columns = {"t [s]": data[0].time, "counts [counts]": counts}
    log = Dataset.of({**columns, "current [A]": d.current_for(force, v)}, drive=d)
    a, b = (Fit(InverseDynamics(), "stribeck", each, starts=1).solve() for each in (data, log))
    return a, b


def test_a_fit_to_a_log_equals_that_to_the_forces(fits: tuple[Fitted, Fitted]) -> None:
    by_force, by_current = fits
    for name, e in by_force.parameters.items():
        if e.standard_error and not e.nuisance:
            assert by_current.values[name] == pytest.approx(e.value, abs=0.2 * e.standard_error)
    assert by_current.status is by_force.status


def test_results_are_in_the_units_of_the_machine(
    fits: tuple[Fitted, Fitted], tmp_path: Path
) -> None:
    without, fit = fits
    assert without.sides == ()
    sides, d = {s.name: s for s in fit.sides}, Drive(**SCREW)
    k = float(d.force_constant)
    level, mass, viscous = (fit.values[n] for n in ("mu_s", "m", "sigma_2"))
    assert sides["mu_s"].units == ("N", "N m", "A")
    assert sides["mu_s"].current == pytest.approx(level / (0.9 * k))
    assert sides["mu_s"].motor == pytest.approx(0.12 * level / (0.9 * k))
    assert sides["sigma_2"].current * float(d.ratio) == pytest.approx(viscous / (0.9 * k))
    assert sides["m without rotor"].load == pytest.approx(mass - float(d.rotor))
    assert sides["m"].motor == pytest.approx(mass / float(d.ratio) ** 2)
    assert sides["offset"].current == pytest.approx(-fit.values["offset"] / (0.9 * k))
    assert "at the motor" in str(fit)
    fit.to_html(tmp_path / "fit.html")
    assert "m without rotor" in (tmp_path / "fit.html").read_text("utf-8")
    fit.to_json(tmp_path / "fit.json")
    fit.save(tmp_path / "fit.npz")
    for again in (Fitted.from_json(tmp_path / "fit.json"), load_fit(tmp_path / "fit.npz")):
        assert str(again) == str(fit)


def test_files_of_earlier_versions_have_no_units_of_the_machine(
    fits: tuple[Fitted, Fitted], tmp_path: Path
) -> None:
    path = tmp_path / "fit.json"
    fits[0].to_json(path)
    text = path.read_text("utf-8")
    assert text.count('"sides": [], ') == 1
    path.write_text(text.replace('"sides": [], ', ""), "utf-8")
    assert Fitted.from_json(path).sides == ()


def test_a_rotary_axis_has_the_units_of_a_rotary_motor() -> None:
    t, d = T, Drive(torque_constant=0.5, gear_ratio=0.1, rotor_inertia=500.0)
    x = 0.3 * np.sin(9 * t) + 0.2 * np.sin(31 * t)
    v, a = (np.gradient(x, t), np.gradient(np.gradient(x, t), t))
    i = (2.0 * a + 3.0 * np.sign(v) + v) / float(d.force_constant)
    log = Dataset.of({"t [s]": t, "x [rad]": 0.1 * x, "current [A]": i}, drive=d)
    fit = Fit(InverseDynamics(), "coulomb+viscous", log, starts=1).solve(throw=False)
    sides = {s.name: s for s in fit.sides}
    assert sides["m"].units == ("kg m^2", "kg m^2", "A s^2/rad")
    assert sides["m"].load == pytest.approx(2.0, rel=0.05)
    assert sides["m"].motor == pytest.approx(100 * sides["m"].load)
    assert "m is below the inertia of the rotor" in str(fit)


def test_positions_have_at_least_the_noise_of_their_counts() -> None:
    d = lossless(counts_per_turn=8)
    record = read(d, {"x [m]": stroke(), "current [A]": T})
    assert noise_of(record, "x", {}) == pytest.approx(abs(float(d.count or 0)) / np.sqrt(12), 0.01)
    assert noise_of(record, "x", {"x": 2.0}) == 2.0
    assert noise_of(record, "force", {}) is None
    assert noise_of(read(None, {"x [m]": stroke()}), "x", {}) is None


def test_a_current_of_the_wrong_sign_is_reported_and_corrected() -> None:
    data = synthetic_drive_data(seed=1, rate=250.0)[0]
    d = Drive(**SCREW)
    i = d.current_for(data["force"], np.gradient(data["x"], data.time))
    columns = {"t [s]": data.time, "x [m]": data["x"], "current_mA": -1e3 * i}
    wrong = Dataset.of(columns, drive=d)
    assert "make the torque_constant of the drive negative" in str(wrong.check())
    right = Dataset.of(columns, drive=Drive(**{**SCREW, "torque_constant": -0.12}))
    assert not right.check().errors
    far = np.abs(np.gradient(data["x"], data.time)) > 2e-3
    assert np.allclose(right[0]["force"][far], data["force"][far], rtol=1e-3, atol=0.5)


def test_a_missing_counter_is_reported() -> None:
    d = lossless(counts_per_turn=1000)
    counts = np.rint(stroke() / float(d.count or 0)) % 4096
    found = Dataset.of({"t [s]": T, "counts [counts]": counts, "current [A]": T}, drive=d).check()
    assert "the counter wraps after about 409" in str(found)
    assert "set counter of the drive" in str(found)
