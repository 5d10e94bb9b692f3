import numpy as np
import pytest

from ocp.layout import Layout, Points

CASES = [Layout(2, 0, 1, 3, 4, True), Layout(1, 2, 0, 2, 3, False), Layout(3, 1, 2, 1, 1, True)]


@pytest.mark.parametrize("layout", CASES)
def test_stack_and_unstack_are_inverse(layout: Layout) -> None:
    w = np.random.default_rng(1).normal(size=layout.size)
    np.testing.assert_array_equal(layout.stack(layout.unstack(w)), w)


@pytest.mark.parametrize("layout", CASES)
def test_unknowns_stand_in_the_order_of_time(layout: Layout) -> None:
    points = layout.unstack(np.arange(layout.size))
    assert (np.diff(points.x, axis=1) > 0).all()
    assert (np.diff(points.z, axis=1) > 0).all()
    assert (np.diff(points.u, axis=1) > 0).all()
    # each input comes before the states it drives and after those before
    d = layout.degree
    assert (points.u < points.x[:1, 1::d]).all()
    assert (points.u > points.x[:1, :-1:d]).all()


def test_spread_repeats_values_at_every_point() -> None:
    points = Layout(2, 1, 1, 3, 2, True).spread(5.0, [1.0, 2.0], [3.0], [4.0])
    assert isinstance(points, Points)
    np.testing.assert_array_equal(points.x, [[1.0] * 7, [2.0] * 7])
    np.testing.assert_array_equal(points.z, [[3.0] * 6])
    np.testing.assert_array_equal(points.u, [[4.0] * 2])
    np.testing.assert_array_equal(points.T, [5.0])
