"""Calls as Python: evaluated, they give what they were made of."""

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.inverse import InverseDynamics
from identification.residuals.shooting import Shooting
from identification.result.build import written
from identification.unknowns.spec import above, linear, log, tied
from symfric import Linear, LuGre, rabinowicz

DATA = Dataset.of(t=[0.0, 1.0, 2.0], x=[0.0, 1.0, 0.0], force=[0.0, 1.0, 0.0])
NAMES = {
    kind.__name__: kind
    for kind in (Fit, InverseDynamics, Shooting, LuGre, log, linear, above, tied)
}


@pytest.mark.parametrize(
    "text",
    [
        "Fit(InverseDynamics(), 'stribeck', data)",
        "Fit(InverseDynamics(x='pos'), 'lugre', data, normal_force=5.0, loss='huber', starts=8)",
        "Fit(Shooting(windows=4.0, dead_time=(0.0, 0.01)), 'gms', data, noise={'x': 1e-06})",
        "Fit(InverseDynamics(), 'lugre', data, free={'m': log(1.0, 10.0), 'mu_s': above('mu_d')})",
        "Fit(InverseDynamics(), 'lugre', data, free={'m': linear(1.0, 10.0, start=2.0), "
        "'mu_s': above('mu_d', 3.0), 'sigma_2': tied('m', 2.0)}, fixed='others')",
    ],
)
def test_what_is_written_is_what_was_called(text: str) -> None:
    made = eval(text, {**NAMES, "data": DATA})
    assert written(made) == text


def test_long_arrays_are_three_dots() -> None:
    kind = Shooting(inputs={"force": Linear(np.arange(50.0), np.zeros(50))})
    assert written(kind) == "Shooting(inputs={'force': Linear(..., ...)})"


def test_models_and_functions_have_their_names() -> None:
    assert written(Fit(InverseDynamics(), rabinowicz(LuGre()), DATA)).startswith(
        "Fit(InverseDynamics(), rabinowicz, data"
    )
    assert "tied(<lambda>)" in written({"m": tied(lambda p: p["a"])})
    law = LuGre(sigma_0=3e4)
    assert eval(written(law), {"LuGre": LuGre}).sigma_0 == 3e4
