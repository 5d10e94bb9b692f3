from dataclasses import replace

import numpy as np

from identification import Dataset, Filter, Identification, evaluate
from identification.old.errors import predicted_force
from symfric import Coulomb, Stribeck, Sum, Viscous
from symfric.scenes import Drive

FILTER = Filter(100.0, 10)
TRUE = Drive(Stribeck(28.0, 20.0, 0.01, 2.0, 1e-4, 200.0), m=95.0, N=1.0, offset=-3.0)


def test_predicted_force_is_newtons_law() -> None:
    law = Sum((Coulomb(2.0, 1e-12), Viscous(3.0)))
    force = predicted_force(
        Drive(law, m=5.0, N=1.0, offset=7.0), np.array([1.0, -1.0]), np.array([10.0, 0.0])
    )
    np.testing.assert_allclose(force, [50 + 2 + 3 + 7, -2 - 3 + 7], rtol=1e-12)


def test_the_true_drive_leaves_little(stage: Dataset) -> None:
    errors = evaluate(TRUE, stage, replace(FILTER, v_min=1e-3))
    assert errors.force_rms < 0.25
    assert errors.position_rms < 2e-3
    assert errors.closed_loop is not None
    assert errors.closed_loop.x < 1e-3


def test_a_wrong_mass_shows_in_every_error(stage: Dataset) -> None:
    good, bad = (evaluate(drive, stage, FILTER) for drive in (TRUE, replace(TRUE, m=120.0)))
    assert bad.force_rms > 2 * good.force_rms
    assert bad.position_rms > 2 * good.position_rms
    assert good.closed_loop is not None
    assert bad.closed_loop is not None
    assert bad.closed_loop.force > 2 * good.closed_loop.force


def test_a_record_without_controller_has_no_closed_loop_error(stage: Dataset) -> None:
    assert evaluate(TRUE, replace(stage, loop=None), FILTER).closed_loop is None


def test_emps_closed_loop_beats_the_published_simulation(emps_symmetric: Identification) -> None:
    published = [(0.013752, 0.229, 8.60, 5.85), (0.0080248, 0.479, 19.8, 8.94)]
    records = (emps_symmetric.errors, emps_symmetric.validation)
    for errors, bars in zip(records, published, strict=True):
        assert errors is not None
        closed = errors.closed_loop
        assert closed is not None
        assert closed.x < bars[0] / 4
        assert closed.v < bars[1]
        assert closed.a < bars[2]
        assert closed.force < bars[3]


def test_emps_position_without_feedback(
    emps_symmetric: Identification, emps_directions: Identification
) -> None:
    expected = {emps_symmetric: (6.6e-3, 9.2e-3), emps_directions: (4e-3, 14e-3)}
    for found, (estimation, validation) in expected.items():
        assert found.errors.position_rms < estimation
        assert found.validation is not None
        assert found.validation.position_rms < validation
