"""A law that did not make the data is found out; at the truth its own law leaves noise alone."""

import numpy as np
import pytest
from made_up_gms import LAW, NOISE, gms_data

from identification.fit import Fit
from identification.residuals.evaluation import Evaluation
from identification.residuals.shooting import Shooting
from identification.unknowns.subject import subject
from symfric.foundation.status import Status
from symfric.scenes import Drive


def test_the_law_that_made_the_data_leaves_their_noise() -> None:
    drive = Drive(LAW, m=1.0, N=1.0)
    made = subject(drive, free=["k_1"], fixed="others")
    found = Shooting(x0="given").prepare(made, gms_data(), {"k_1": 50000.0})
    there = found.at(np.array([50000.0]))
    assert isinstance(there, Evaluation)
    assert np.std(there.r) == pytest.approx(NOISE, rel=0.1)


@pytest.mark.slow
def test_lugre_fitted_to_generalised_maxwell_slip_is_doubtful() -> None:
    known = {"m": 1.0, "offset": 0.0}
    fit = Fit(Shooting(x0="given"), "lugre", gms_data(), fixed=known).solve()
    assert fit.status is Status.DOUBTFUL
    assert not fit.verdict.good
    assert fit.errors["gms", "x"].rms > 10 * NOISE
