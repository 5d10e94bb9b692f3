"""Factors of the self-tuning law."""

import numpy as np
import pytest

from symfric import SelfTuning
from symfric.figures import sweep_b, sweep_c, sweep_e


def test_sweep_of_B_moves_the_peak_and_keeps_its_height() -> None:
    data = sweep_b(SelfTuning(), values=(0.5, 1.0))
    slow, fast = data.curves
    assert slow["F"].max() == pytest.approx(fast["F"].max(), rel=1e-3)
    assert slow["v"][slow["F"].argmax()] == pytest.approx(
        2 * fast["v"][fast["F"].argmax()], rel=0.02
    )


def test_sweep_of_C_is_flat_at_zero_monotone_to_one_and_peaked_beyond() -> None:
    data = sweep_c(SelfTuning())
    assert not data["C = 0"]["F"].any()
    assert (np.diff(data["C = 1"]["F"]) > 0).all()
    assert (np.diff(data["C = 0.5"]["F"]) > 0).all()
    falls = [np.diff(data[f"C = {c}"]["F"]).min() < 0 for c in ("1.2", "1.4", "1.6", "1.8", "2")]
    assert all(falls)


def test_sweep_of_E_keeps_the_slope_at_rest() -> None:
    middle = [curve["F"][599:602] for curve in sweep_e(SelfTuning()).curves]
    slopes = [F[2] - F[0] for F in middle]
    assert slopes == pytest.approx(np.full(len(slopes), slopes[0]), rel=1e-3)
