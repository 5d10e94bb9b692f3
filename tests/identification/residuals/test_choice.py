"""Lengths of windows are chosen by what was left out."""

from collections.abc import Mapping

import numpy as np
import pytest

from identification.data.dataset import Dataset
from identification.fit import Fit
from identification.residuals.shooting import Shooting, choose
from identification.unknowns.subject import subject
from symfric import Model
from symfric.foundation.parameters import Variable

X, RATE = Variable("x", "m", start=1.0), Variable("rate", "1/s", start=1.0, lower=0.1)
DECAY = Model("decay", x=(X,), p=(RATE,), ode=-RATE.symbol * X.symbol)
T = np.linspace(0.0, 4.0, 401)
DATA = Dataset.of(t=T, x=np.exp(-0.7 * T), units={"x": "m"})


@pytest.mark.parametrize("right", [None, 1.0])
def test_the_length_whose_fits_predict_is_taken(right: float | None) -> None:
    asked, tried = list[float](), list[object]()

    def solve(kind: Shooting, data: Dataset) -> Mapping[str, float]:
        tried.append(kind.windows)
        asked.append(sum(r.size for r in data))
        return {"rate": 0.7 if kind.windows == right else 0.9}

    found = choose(Shooting(windows="choose"), subject(DECAY), DATA, solve)
    assert found.windows == right
    assert len(asked) == 4 * 5
    assert list(dict.fromkeys(tried)) == [None, 2.0, 1.0, 0.5, 0.25]
    assert set(asked) <= {300, 301}  # three quarters


def test_no_length_is_a_sentence() -> None:
    with pytest.raises(ValueError, match="better start values"):
        choose(Shooting(windows="choose"), subject(DECAY), DATA, lambda kind, data: None)


@pytest.mark.slow
def test_a_fit_chooses_for_itself() -> None:
    fit = Fit(Shooting(windows="choose"), DECAY, DATA, starts=1).solve(throw=False)
    assert fit.values["rate"] == pytest.approx(0.7, rel=1e-6)
