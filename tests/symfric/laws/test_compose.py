"""Laws made of laws: names, states, values, and what they refuse."""

from math import inf

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from symfric import (
    Asymmetric,
    BrownMcPhee,
    Coulomb,
    Dahl,
    Law,
    LoadDependent,
    LuGre,
    SelfTuning,
    Stribeck,
    Sum,
    Viscous,
    parameters,
    symbolise,
    with_values,
)
from symfric.laws import GMS, Karnopp, MaxwellSlip, ModifiedThrelfall, Table, Threlfall

speeds = st.floats(-0.1, 0.1)


@given(v=speeds)
def test_sum_adds_its_terms(v: float) -> None:
    terms = Coulomb(mu_d=0.2), Viscous(sigma_2=3.0)
    expected = terms[0].force(v, 5.0) + terms[1].force(v, 5.0)
    assert Sum(terms).force(v, 5.0) == expected


@given(v=speeds, z=st.tuples(*2 * [st.floats(-1e-5, 1e-5)]))
def test_sum_hands_each_term_its_own_state(v: float, z: tuple[float, float]) -> None:
    law = Sum((LuGre(), Viscous(), Dahl(sigma_0=3e4)))
    column = np.array(z)
    parts = LuGre(), Dahl(sigma_0=3e4)
    forces = [p.force(v, 5.0, column[i : i + 1]) for i, p in enumerate(parts)]
    rates = [p.rate(v, 5.0, column[i : i + 1])[0] for i, p in enumerate(parts)]
    assert law.force(v, 5.0, column) == pytest.approx(sum(forces) + 0.4 * v, rel=1e-14)
    np.testing.assert_array_equal(law.rate(v, 5.0, column), rates)


def test_steady_state_of_a_sum_stacks_those_of_its_terms() -> None:
    found = Sum((LuGre(), Viscous(), Dahl(sigma_0=3e4))).steady_state(0.1, 5.0)
    assert found == pytest.approx([0.5 / 1e5, 0.5 / 3e4])


NAMES: dict[str, tuple[Law, list[str]]] = {
    "different": (Sum((Coulomb(), Viscous())), ["mu_d", "v_eps", "sigma_2"]),
    "shared": (
        Sum((Coulomb(), Viscous(), Viscous())),
        ["mu_d", "v_eps", "sigma_2_2", "sigma_2_3"],
    ),
    "sum of sums": (
        Sum((Sum((Viscous(), Viscous())), Viscous())),
        ["sigma_2_1", "sigma_2_2", "sigma_2_3"],
    ),
    "wrapped sum beside the same laws": (
        Sum((LoadDependent(Sum((Viscous(), Viscous()))), Viscous(), Viscous())),
        ["N_0", "c", "N_eps", "sigma_2_1", "sigma_2_2", "sigma_2_2_2", "sigma_2_3"],
    ),
    "sides": (
        Asymmetric(Viscous(), Viscous()),
        ["v_blend", "sigma_2_pos", "sigma_2_neg"],
    ),
    "sides of a sum": (
        Asymmetric(Sum((Viscous(), Viscous())), Sum((Viscous(), Viscous()))),
        ["v_blend", "sigma_2_1_pos", "sigma_2_2_pos", "sigma_2_1_neg", "sigma_2_2_neg"],
    ),
    "wrapped twice": (
        LoadDependent(LoadDependent(Viscous())),
        ["N_0", "c", "N_eps", "N_0_1", "c_1", "N_eps_1", "sigma_2"],
    ),
}


@pytest.mark.parametrize("name", NAMES)
def test_parameters_have_these_names(name: str) -> None:
    law, expected = NAMES[name]
    assert list(parameters(law)) == expected


@pytest.mark.parametrize("name", NAMES)
def test_every_name_reaches_a_parameter_of_its_own(name: str) -> None:
    law, names = NAMES[name]
    values = {n: 0.5 + i / 10 for i, n in enumerate(names)}
    assert {n: p.value for n, p in parameters(with_values(law, values)).items()} == values
    _, variables = symbolise(law, *names)
    assert [v.name for v in variables] == names


@pytest.mark.parametrize(
    ("law", "names"),
    [
        (Sum((LuGre(), Viscous())), ["z"]),
        (Sum((LuGre(), Viscous(), Dahl())), ["z_1", "z_3"]),
        (Sum((LoadDependent(Sum((LuGre(), Dahl()))), LuGre())), ["z_1", "z_2", "z"]),
        (
            Sum((LoadDependent(Sum((LuGre(), Dahl()))), LuGre(), Dahl())),
            ["z_1", "z_2", "z_2_2", "z_3"],
        ),
        (Asymmetric(LuGre(), LuGre()), ["z"]),
        (LoadDependent(Dahl()), ["z"]),
        (Sum((Coulomb(), Viscous())), []),
    ],
)
def test_states_have_the_number_of_their_term(law: Law, names: list[str]) -> None:
    assert [state.name for state in law.states] == names
    assert law.rate(0.1, 5.0, np.zeros(len(names))).shape == (len(names),)
    assert ca.SX(law.rate(ca.SX(0.1), 5.0, ca.SX(len(names), 1))).shape == (len(names), 1)


@given(v=st.floats(1e-3, 1.0), sides=st.permutations([0.1, 0.3]))
def test_each_direction_follows_its_own_side(v: float, sides: list[float]) -> None:
    pos, neg = (Stribeck(mu_s=0.4, mu_d=mu, v_s=mu) for mu in sides)
    law = Asymmetric(pos, neg, v_blend=1e-5)
    assert law.force(v, 5.0) == pytest.approx(pos.force(v, 5.0), rel=1e-14)
    assert law.force(-v, 5.0) == pytest.approx(neg.force(-v, 5.0), rel=1e-14)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_bristle_law_keeps_its_one_state_and_slides_at_the_level_of_the_side(
    direction: float,
) -> None:
    law = Asymmetric(LuGre(mu_s=0.5, mu_d=0.4), LuGre(mu_s=0.3, mu_d=0.2))
    v = 0.1 * direction
    z = law.steady_state(v, 5.0)
    assert law.rate(v, 5.0, z) == pytest.approx(0.0, abs=1e-15)
    assert law.force(v, 5.0, z) == pytest.approx(2.0 if direction > 0 else -1.0)


@given(v=speeds, pair=st.tuples(*2 * [st.floats(0.05, 0.5)]), other=st.floats(0.0, 1.0))
def test_blend_never_breaks_the_order_of_the_levels(
    v: float, pair: tuple[float, float], other: float
) -> None:
    """Rounding must not lift mu_d above mu_s, which a law refuses."""
    one = SelfTuning(mu_s=pair[0], mu_d=pair[0])
    two = SelfTuning(mu_s=pair[1], mu_d=other * pair[1])
    force = Asymmetric(one, two).force(v, 5.0)
    assert np.isfinite(force)
    assert force * v >= 0


@pytest.mark.parametrize("N", [0.0, 1.0, 50.0])
def test_load_without_preload_is_the_law_itself(N: float) -> None:
    law = LoadDependent(BrownMcPhee(), N_0=0.0, c=1.0, N_eps=0.0)
    assert law.force(2e-3, N) == BrownMcPhee().force(2e-3, N)


def test_effective_load_is_preload_plus_share() -> None:
    law = LoadDependent(Coulomb(mu_d=0.5), N_0=2.0, c=0.1, N_eps=0.0)
    assert law.force(1.0, 30.0) == pytest.approx(2.5)


@pytest.mark.parametrize("N", [0.0, -1.0, -1e4])
def test_lift_off_leaves_a_finite_friction_of_the_preload(N: float) -> None:
    law = LoadDependent(LuGre(), N_0=2.0)
    z = law.steady_state(0.1, N)
    assert law.force(0.1, N, z) == pytest.approx(0.2, rel=1e-3)
    bare = LoadDependent(LuGre())
    assert 0 <= bare.force(0.1, N, bare.steady_state(0.1, N)) <= 1e-4


@pytest.mark.parametrize("pressed", [1e3, 10.0])
def test_smooth_lift_off_vanishes_under_load(pressed: float) -> None:
    one, other = (LoadDependent(Coulomb(), N_eps=e).force(0.1, pressed) for e in (1e-3, 0.0))
    assert one == pytest.approx(other, rel=1e-8)


def test_nested_wrappers_act_in_order() -> None:
    side = Sum((Coulomb(mu_d=0.5), Viscous(sigma_2=2.0)))
    law = LoadDependent(Asymmetric(side, with_values(side, {"mu_d": 0.3})), N_0=10.0, c=0.0)
    assert law.force(1.0, 99.0) == pytest.approx(7.0)
    assert law.force(-1.0, 99.0) == pytest.approx(-5.0)


@pytest.mark.parametrize(
    ("law", "scale"),
    [
        (Sum((Stribeck(v_eps=2e-4), Coulomb(v_eps=1e-3), Viscous())), 2e-4),
        (Sum((Viscous(), Dahl())), inf),
        (Asymmetric(Coulomb(v_eps=1e-3), Coulomb(v_eps=3e-4)), 3e-4),
        (LoadDependent(BrownMcPhee(v_t=0.02)), 0.02),
        (SelfTuning(B=500.0), 2e-3),
    ],
)
def test_velocity_scale_is_the_smallest_one_inside(law: Law, scale: float) -> None:
    assert law.velocity_scale == pytest.approx(scale)


def test_sum_of_sums_is_one_sum() -> None:
    law = Sum((Sum((Coulomb(), Viscous())), Dahl()))
    assert [type(term) for term in law.laws] == [Coulomb, Viscous, Dahl]


@pytest.mark.parametrize("laws", [(), (Coulomb(),)])
def test_sum_of_less_than_two_is_refused(laws: tuple[Law, ...]) -> None:
    with pytest.raises(ValueError, match=f"Sum: expected at least two laws, got {len(laws)}"):
        Sum(laws)


@pytest.mark.parametrize(
    ("positive", "negative"),
    [
        (Dahl(), LuGre()),
        (Threlfall(), ModifiedThrelfall()),
        (Coulomb(), Coulomb(shape="atan")),
        (Sum((Coulomb(), Viscous())), Sum((Viscous(), Coulomb()))),
        (LoadDependent(Karnopp()), LoadDependent(Karnopp(form="original"))),
        (Table((0.0, 1.0), (0.1, 0.2)), Table((0.0, 2.0), (0.1, 0.2))),
    ],
)
def test_sides_that_differ_in_more_than_numbers_are_refused(positive: Law, negative: Law) -> None:
    names = f"{type(positive).__name__} and {type(negative).__name__}"
    with pytest.raises(ValueError, match=f"expected the same law on both sides, got {names}; only"):
        Asymmetric(positive, negative)


@pytest.mark.parametrize(
    ("make", "got"),
    [
        (lambda: Sum((Coulomb, Viscous())), r"Sum: .* got the class Coulomb"),
        (lambda: Asymmetric("lugre", "lugre"), r"Asymmetric: .* got 'lugre'"),
        (lambda: LoadDependent(3.0), r"LoadDependent: .* got 3\.0"),
    ],
)
def test_what_is_not_a_law_is_refused(make: object, got: str) -> None:
    with pytest.raises(ValueError, match=got):
        make()  # type: ignore[operator]


def test_bounds_hold_inside_wrappers() -> None:
    with pytest.raises(ValueError, match=r"Coulomb: mu_d: expected 0 <= mu_d <= inf \[1\], got -1"):
        with_values(LoadDependent(Coulomb()), {"mu_d": -1.0})


def test_step_of_a_sum_is_the_steps_of_its_terms_below_each_other() -> None:
    one, other = GMS(form="event"), MaxwellSlip(form="event")
    z = np.linspace(0.1, 0.4, 16)
    z[4:8], z[12:] = 1.0, 0.0
    end, mean = Sum((one, Viscous(), other)).held_step(1e-3, 5.0, z, 2e-3) or ((), ())
    first, second = one.held_step(1e-3, 5.0, z[:8], 2e-3), other.held_step(1e-3, 5.0, z[8:], 2e-3)
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(end, [*first[0], *second[0]])
    np.testing.assert_array_equal(mean, [*first[1], *second[1]])


def test_sum_with_a_term_of_unknown_step_knows_none() -> None:
    assert Sum((GMS(form="event"), LuGre())).held_step(1e-3, 5.0, np.zeros(9), 1e-3) is None
    assert Sum((Coulomb(), Viscous())).held_step(1e-3, 5.0, (), 1e-3) is None
