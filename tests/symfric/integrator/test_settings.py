"""How to run is checked once for a model; what is loose is warned of every time."""

import numpy as np
import pytest

from symfric import BrownMcPhee, rabinowicz, simulate
from symfric.integrator import simulate_by_peer
from symfric.integrator.simulate import REMEMBERED


def test_settings_are_checked_once_and_true_is_no_time() -> None:
    """What is remembered is what was asked for: equal numbers of another kind are others."""
    model = rabinowicz(BrownMcPhee())
    first = simulate(model, 1.0, samples=5)
    again = simulate(model, 1.0, samples=5)
    assert again.t.tolist() == first.t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    again.t[:] = 0.0
    assert simulate(model, 1.0, samples=5).t[-1] == 1.0
    assert len(model.memory["settings"]) == 1
    with pytest.raises(ValueError, match="t_end"):
        simulate(model, True, samples=5)
    assert simulate(model, np.array(1.0), samples=5).t[-1] == 1.0
    for k in range(40):
        simulate(model, 1.0 + k / 10, samples=5)
    assert len(model.memory["settings"]) == REMEMBERED


def test_every_loose_call_is_warned_of_where_it_is_made() -> None:
    model = rabinowicz(BrownMcPhee())
    for _ in range(2):
        with pytest.warns(UserWarning, match="stick phases") as seen:
            simulate(model, 0.1, rtol=1e-3, samples=5)
        assert [w.filename for w in seen] == [__file__]
    with pytest.warns(UserWarning, match="stick phases") as seen:
        simulate_by_peer(model, 0.1, rtol=1e-3, samples=5)
    assert [w.filename for w in seen] == [__file__]
