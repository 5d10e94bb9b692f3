"""Windows divide a record, and start where a contact slides."""

import numpy as np
import pytest

from identification.residuals.initial import cut

T = np.linspace(0.0, 10.0, 1001)


@pytest.mark.parametrize(("length", "count"), [(None, 1), (20.0, 1), (10.0, 1), (2.5, 4), (3.0, 3)])
def test_windows_follow_each_other(length: float | None, count: int) -> None:
    windows = cut(T, length)
    assert len(windows) == count
    assert [w.start for w in windows[1:]] == [w.stop for w in windows[:-1]]
    assert (windows[0].start, windows[-1].stop) == (0, T.size)


def test_cuts_move_to_where_the_motion_is_fast() -> None:
    speed = np.abs(np.sin(np.pi * T / 2.5))  # slowest where equal windows end
    for window in cut(T, 2.5, speed)[1:]:
        assert speed[window.start] > 0.5


def test_windows_of_few_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 8 samples"):
        cut(T, 0.05)
