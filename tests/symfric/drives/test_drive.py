"""The nameplate of a drive: ratios, losses of the gear, files, and rejected values."""

from math import pi
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import Drive

KEYS = """
"torque_constant [mN m/A]" = 120
gear_ratio = -10
efficiency = [0.92, 0.88]
"rotor_inertia [kg cm^2]" = 0.6
"lead [mm]" = 5
"max_current [A]" = 8
"max_torque [mN m]" = 600
counts_per_turn = 4096
"speed_width [mm/s]" = 2
"""


def test_a_screw_has_the_ratio_of_its_lead() -> None:
    drive = Drive(torque_constant=0.12, gear_ratio=-10, lead=5e-3, rotor_inertia=6e-5)
    assert drive.ratio == pytest.approx(-10 * 2 * pi / 5e-3)
    assert drive.force_constant == pytest.approx(0.12 * drive.ratio)
    assert drive.rotor == pytest.approx(6e-5 * drive.ratio**2)
    assert not drive.turning
    assert Drive(torque_constant=1.0, gear_ratio=3, drum_radius=0.1).ratio == pytest.approx(30)
    assert Drive(torque_constant=1.0, gear_ratio=3).ratio == 3


def test_the_count_is_that_of_the_side_of_the_encoder() -> None:
    given = {"torque_constant": 1.0, "gear_ratio": 10, "lead": 0.02, "counts_per_turn": 1000}
    assert Drive(**given).count == pytest.approx(0.02 / 10_000)
    assert Drive(**given, encoder="load").count == pytest.approx(0.02 / 1000)
    assert Drive(torque_constant=1.0, resolution=1e-6).count == 1e-6
    assert Drive(torque_constant=1.0).count is None


def test_losses_take_a_share_of_the_power_in_both_directions() -> None:
    drive = Drive(torque_constant=1.0, efficiency=(0.9, 0.6), force_width=1e-9)
    for v in (-1.0, 1.0):
        for F in (-5.0, 5.0):
            expected = 0.9 * F if F * v > 0 else F / 0.6
            assert drive.at_load(F, v) == pytest.approx(expected, rel=1e-12)
    assert drive.at_load(5.0, 0.0) == 5.0
    assert Drive(torque_constant=1.0).at_load(5.0, -1.0) == 5.0


def test_losses_are_never_negative_and_their_inverse_is_exact() -> None:
    random = np.random.default_rng(1)
    for eta in random.uniform(0.05, 1.0, (50, 2)):
        drive = Drive(torque_constant=0.3, gear_ratio=-7.0, efficiency=tuple(eta), force_width=0.0)
        F, v = 10.0 * random.standard_normal(200), 2e-3 * random.standard_normal(200)
        out = np.asarray(drive.at_load(F, v))
        assert ((F - out) * v >= -1e-15 * np.abs(F * v)).all()
        assert np.allclose(drive.from_load(out, v), F, rtol=1e-12)
        assert np.allclose(drive.current_for(out, v), F / (-7.0 * 0.3), rtol=1e-12)


def test_the_force_at_the_load_has_finite_derivatives_at_rest() -> None:
    F, v = ca.SX.sym("F"), ca.SX.sym("v")
    drive = Drive(torque_constant=1.0, efficiency=(0.9, 0.6))
    both = ca.vertcat(F, v)
    out = drive.at_load(F, v)
    at = ca.Function("at", [F, v], [ca.gradient(out, both), ca.hessian(out, both)[0]])
    for point in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
        assert all(np.isfinite(part.full()).all() for part in at(*point))
    assert at(1.0, 0.0)[0].full().ravel() == pytest.approx([1.0, 0.0])


def test_the_smaller_limit_counts() -> None:
    assert Drive(torque_constant=0.5, max_current=8, max_torque=2).current_limit == 4
    assert Drive(torque_constant=0.5, max_current=3, max_torque=2).current_limit == 3
    assert Drive(torque_constant=0.5).current_limit is None


def test_a_file_has_the_numbers_of_the_nameplate(tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(KEYS)
    read = Drive.read(path)
    assert read.torque_constant == pytest.approx(0.12)
    assert read.rotor_inertia == pytest.approx(6e-5)
    assert (read.lead, read.max_torque) == pytest.approx((5e-3, 0.6))
    assert read.speed_width == pytest.approx(2e-3)
    assert (read.gear_ratio, read.efficiency, read.counts_per_turn) == (-10, (0.92, 0.88), 4096)


def test_all_problems_of_a_file_are_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text('torque_constant = 1\ngear_ration = 3\ndiameter = 1\n"lead [N]" = 2\n')
    both = "got gear_ration, diameter; did you mean gear_ratio"
    with pytest.raises(ValueError, match=both) as error:
        Drive.read(path)
    for part in (r'such as "torque_constant [N m/A]", got none', 'such as "lead [m]", got N'):
        assert part in str(error.value)
    path.write_text('"torque_constant [N m/A]" = 1\nefficiency = 2\n')
    with pytest.raises(ValueError, match=r"drive '.*drive.toml': efficiency: expected a number"):
        Drive.read(path)
    path.write_text("x = [")
    with pytest.raises(ValueError, match="expected TOML"):
        Drive.read(path)
    with pytest.raises(ValueError, match="expected a readable file"):
        Drive.read(tmp_path / "none.toml")
