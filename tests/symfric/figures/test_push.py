"""A pushed block against closed forms, on laws and on random contacts."""

import numpy as np
import pytest

from symfric import GenericAsperity, Viscous
from symfric.figures import push


def test_viscous_block_approaches_its_speed() -> None:
    curve = push(Viscous(sigma_2=4.0), force=2.0, t_end=1.0, mass=0.5, samples=11).curves[0]
    assert np.allclose(curve["v"], 0.5 * (1 - np.exp(-8 * curve["t"])), atol=2e-5)
    assert np.allclose(curve["F"], 4 * curve["v"], atol=1e-9)


def test_random_contacts_take_the_momentum_that_is_missing() -> None:
    law = GenericAsperity(k=1e5, count=50)
    curve = push(law, 1.0, force=0.5, t_end=0.1, mass=0.5, samples=4001).curves[0]
    left = np.trapezoid(curve["F_e"] - curve["F"], curve["t"])
    assert abs(0.5 * curve["v"][-1] / left - 1) < 1e-3
    assert 0.04 < curve["F"][-1] < 0.5


def test_bad_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="push: mass: expected"):
        push(Viscous(), force=1.0, t_end=1.0, mass=0.0)
    with pytest.raises(ValueError, match="push: samples: expected"):
        push(Viscous(), force=1.0, t_end=1.0, samples=1)
