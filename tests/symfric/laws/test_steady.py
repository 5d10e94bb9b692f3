"""Force in steady sliding of laws with and without states and further inputs, and populations."""

import numpy as np
import pytest

import symfric
from symfric import ALL_LAWS, Karnopp, Law, LuGre, Stribeck, law_from_text
from symfric.laws import BAM, POPULATIONS, GenericAsperity, steady_force, steady_inputs

V = np.array([-1e-2, -3e-4, 3e-4, 1e-2])
N = 7.848


def test_a_bristle_law_is_taken_in_its_steady_state() -> None:
    expected = Stribeck(v_eps=1e-9).force(V, N)
    assert steady_force(LuGre(), V, N) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", [n for n, kind in ALL_LAWS.items() if kind.facts.odd])
def test_it_is_odd_with_the_inputs_in_the_title(name: str) -> None:
    found = steady_force(law_from_text(name), V, N)
    assert found == pytest.approx(-found[::-1], rel=1e-12)


def test_an_applied_force_pulls_forward_and_is_named() -> None:
    found = steady_force(Karnopp(), np.array([-1e-9, 1e-9]), N)
    assert found == pytest.approx([-1.0, 1.0])
    assert steady_inputs(Karnopp()) == ", F_e = 1 N"
    assert steady_inputs(BAM()) == ", tau_m = 1 N m, tau_e = 0.5 N m"


def test_what_takes_no_input_has_none_in_its_title() -> None:
    assert steady_inputs(LuGre()) == steady_inputs(GenericAsperity()) == ""


@pytest.mark.parametrize("kind", [*ALL_LAWS.values(), *POPULATIONS.values()])
def test_every_law_is_found_in_the_package_itself(kind: type[Law]) -> None:
    assert getattr(symfric, kind.__name__) is kind
