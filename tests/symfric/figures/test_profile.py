"""Force-velocity profiles."""

import pytest

from symfric import SelfTuning
from symfric.figures import profile


def test_profile_of_the_self_tuning_law_peaks_at_mu_s_N() -> None:
    F = profile(SelfTuning(), N=2.0)["self_tuning"]["F"]
    assert F.max() == pytest.approx(0.3, rel=1e-4)
    assert -F[::-1] == pytest.approx(F)
