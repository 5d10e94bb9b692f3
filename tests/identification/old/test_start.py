import numpy as np
import pytest

from identification import Dataset, Filter, differentiate, linear_regression
from identification.old.choice import choose
from identification.old.coordinates import coordinates
from identification.old.problem import problem
from identification.old.start import start_values
from symfric import law_from_text


@pytest.mark.parametrize("text", ["stribeck", "coulomb+viscous", "asymmetric(stribeck)"])
def test_start_is_close_to_the_optimum(stage: Dataset, text: str) -> None:
    signals = differentiate(stage, Filter(100.0, 10, v_min=1e-3))
    linear = linear_regression(signals)
    choice = choose(law_from_text(text), float(np.abs(signals.v).max()))
    at = coordinates(choice, linear.values["F_c"], float(signals.v.std()), linear.values["m"])
    task = problem(at, signals, linear.force_rms)
    w = start_values(choice, linear, task)
    started = 0.5 * float(np.mean((task.residuals(w) / task.scale) ** 2))
    assert (at.lower < w).all()
    assert (w < at.upper).all()
    # the regression the start begins with costs 1/2
    assert started < task.solve(w).cost + 0.02
