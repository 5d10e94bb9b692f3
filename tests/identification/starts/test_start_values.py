"""Start values of every law of the catalogue from one record, by the roles of its parameters."""

import numpy as np
import pytest

from identification.starts.measured import Measured
from identification.starts.start import start_values
from symfric.foundation.parameters import parameters, with_values
from symfric.laws import LuGre, Stribeck
from symfric.laws.base.law import Law
from symfric.laws.catalogue import ALL_LAWS
from symfric.laws.composed.populations import steady_force
from symfric.scenes import Drive

T = 2.5e-3 * np.arange(4000)
V = 0.3 * np.sin(np.pi * T) * (1 + 0.5 * np.sin(0.7 * T))
NOISE = 0.5
ASKED = ("width", "load", "temperature", "geometry")


def friction(v: np.ndarray) -> np.ndarray:
    return np.sign(v) * (20 + 12 * np.exp(-((v / 0.03) ** 2))) + 40 * v


def record(a: np.ndarray | None = None, m: float = 0.0, offset: float = 0.0) -> Measured:
    noise = NOISE * np.random.default_rng(0).standard_normal(T.size)
    F = friction(V) + offset + noise + (0.0 if a is None else m * a)
    return Measured(V, F, t=T, a=a)


def free_of(law: Law) -> list[str]:
    return [n for n, p in parameters(law).items() if p.role not in ASKED]


@pytest.mark.parametrize("name", ALL_LAWS)
def test_start_of_any_law_can_be_constructed(name: str) -> None:
    law = ALL_LAWS[name]()
    free = free_of(law)
    found = start_values(law, record(), free=free)
    assert set(found) == set(free)
    with_values(law, found)


def test_start_of_a_right_law_is_within_the_noise() -> None:
    law = Stribeck(v_eps=1e-4)
    found = start_values(law, record(), free=["mu_s", "mu_d", "v_s", "sigma_2"])
    moving = np.abs(V) > 2e-3
    error = steady_force(with_values(law, found), V, 1.0) - friction(V)
    assert np.sqrt(np.mean(error[moving] ** 2)) < 0.3 * NOISE


def test_mass_and_offset_of_a_drive() -> None:
    a = np.gradient(V, T)
    found = start_values(
        Drive(Stribeck(), N=1.0),
        record(a, m=30.0, offset=-3.0),
        free=["m", "offset", "mu_s", "mu_d", "v_s", "sigma_2"],
    )
    assert abs(found["m"] - 30) < 0.5
    assert abs(found["offset"] + 3) < 0.2


def test_the_same_data_give_the_same_bits() -> None:
    law = LuGre()
    first, second = (start_values(law, record(), free=free_of(law)) for _ in range(2))
    assert first == second


def test_unknown_name_is_refused() -> None:
    with pytest.raises(ValueError, match="start_values: free"):
        start_values(LuGre(), record(), free=["mu_x"])
