"""A velocity that jumps."""

import numpy as np
import pytest

from symfric import Coulomb, RateAndState
from symfric.figures import velocity_step


def test_rate_and_state_jumps_by_a_and_falls_by_b() -> None:
    law, N = RateAndState(), 2.0
    curve = velocity_step(law, N, factor=10.0).curves[0]
    F, x, fast = curve["F"], curve["x"], curve["v"] > 2 * curve["v"][0]
    before, peak, settled = F[~fast][0], F[fast].max(), F[fast][-1]
    a, b = float(law.a), float(law.b)
    assert peak - before == pytest.approx(a * np.log(10.0) * N, rel=0.01)
    assert peak - settled == pytest.approx(b * np.log(10.0) * N, rel=0.01)
    at = x[fast] - x[fast][0]  # slip law and ageing law: 1/e of the fall over about D_c
    fallen = at[np.argmax(F[fast] < settled + (peak - settled) / np.e)]
    assert 0.3 * float(law.D_c) < fallen < 3 * float(law.D_c)


def test_the_way_is_the_same_at_each_velocity_and_ends_where_it_began() -> None:
    """Half as much before; behind the second jump the contact is as old as at first."""
    law = RateAndState()
    curve = velocity_step(law, 2.0, factor=10.0).curves[0]
    F, x, v = curve["F"], curve["x"], curve["v"]
    fast = np.flatnonzero(v > 2 * v[0])
    way = 20 * float(law.D_c)
    jumps = x[fast[0]], x[fast[-1]], x[-1]
    assert jumps == pytest.approx((0.5 * way, 1.5 * way, 2.5 * way), rel=1e-2)  # to a sample
    assert v[-1] == pytest.approx(v[0])
    assert F[-1] == pytest.approx(F[0], rel=1e-6)


def test_a_law_without_lag_is_refused() -> None:
    with pytest.raises(ValueError, match="velocity_step of coulomb: expected a law that shows"):
        velocity_step(Coulomb())
