"""Laws made of laws, and laws by the text that a user types."""

from math import inf

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import prescribed_motion

import symfric as sf
from symfric.foundation.numeric import Scalar
from symfric.scenes import FourBar, SliderCrank

N = 7.848
speeds, deflections = st.floats(-0.1, 0.1), st.floats(-1e-5, 1e-5)


@given(v=speeds, z=st.tuples(deflections, deflections))
def test_sum_adds_its_terms_and_hands_each_its_own_state(v: float, z: tuple[float, float]) -> None:
    law, parts = (
        sf.Sum((sf.LuGre(), sf.Viscous(), sf.Dahl(sigma_0=3e4))),
        (sf.LuGre(), sf.Dahl(sigma_0=3e4)),
    )
    column = np.array(z)
    forces = [p.force(v, 5.0, column[i : i + 1]) for i, p in enumerate(parts)]
    rates = [p.rate(v, 5.0, column[i : i + 1])[0] for i, p in enumerate(parts)]
    assert law.force(v, 5.0, column) == pytest.approx(sum(forces) + 0.4 * v, rel=1e-14)
    np.testing.assert_array_equal(law.rate(v, 5.0, column), rates)
    steady = [p.steady_state(v, 5.0)[0] for p in parts]
    np.testing.assert_array_equal(law.steady_state(v, 5.0), steady)


TWO, DYNAMIC = sf.Sum((sf.Viscous(), sf.Viscous())), sf.Sum((sf.LuGre(), sf.Dahl()))
NAMES: dict[sf.Law, str] = {
    sf.Sum((sf.Coulomb(), sf.Viscous())): "mu_d v_eps sigma_2",
    sf.Sum((sf.Coulomb(), sf.Viscous(), sf.Viscous())): "mu_d v_eps sigma_2_2 sigma_2_3",
    sf.Sum((TWO, sf.Viscous())): "sigma_2_1 sigma_2_2 sigma_2_3",
    sf.Sum((sf.LoadDependent(TWO), sf.Viscous(), sf.Viscous())):
        "N_0 c N_eps sigma_2_1 sigma_2_2 sigma_2_2_2 sigma_2_3",
    sf.Asymmetric(sf.Viscous(), sf.Viscous()): "v_blend sigma_2_pos sigma_2_neg",
    sf.Asymmetric(TWO, TWO): "v_blend sigma_2_1_pos sigma_2_2_pos sigma_2_1_neg sigma_2_2_neg",
    sf.LoadDependent(sf.LoadDependent(sf.Viscous())): "N_0 c N_eps N_0_1 c_1 N_eps_1 sigma_2",
}  # fmt: skip
"""Names of the parameters of a law."""
STATES: dict[sf.Law, str] = {
    sf.Sum((sf.LuGre(), sf.Viscous())): "z",
    sf.Sum((sf.LuGre(), sf.Viscous(), sf.Dahl())): "z_1 z_3",
    sf.Sum((sf.LoadDependent(DYNAMIC), sf.LuGre())): "z_1 z_2 z",
    sf.Sum((sf.LoadDependent(DYNAMIC), sf.LuGre(), sf.Dahl())): "z_1 z_2 z_2_2 z_3",
    sf.Asymmetric(sf.LuGre(), sf.LuGre()): "z",
    sf.LoadDependent(sf.Dahl()): "z",
    sf.Sum((sf.Coulomb(), sf.Viscous())): "",
}
"""Names of the states of a law."""


def test_parameters_and_states_have_unique_names_that_reach_them() -> None:
    for law, text in NAMES.items():
        names = text.split()
        assert list(sf.parameters(law)) == names
        values = {n: 0.5 + i / 10 for i, n in enumerate(names)}
        assert {n: p.value for n, p in sf.parameters(sf.with_values(law, values)).items()} == values
        assert [v.name for v in sf.symbolise(law, *names)[1]] == names
    for law, text in STATES.items():
        names = text.split()
        assert [state.name for state in law.states] == names
        assert law.rate(0.1, 5.0, np.zeros(len(names))).shape == (len(names),)
        assert ca.SX(law.rate(ca.SX(0.1), 5.0, ca.SX(len(names), 1))).shape == (len(names), 1)


@given(v=st.floats(1e-3, 1.0), sides=st.permutations([0.1, 0.3]))
def test_each_direction_follows_its_own_side(v: float, sides: list[float]) -> None:
    pair = [sf.Stribeck(mu_s=0.4, mu_d=mu, v_s=mu) for mu in sides]
    law, bristles = sf.Asymmetric(*pair, v_blend=1e-5), [sf.LuGre(mu_s=mu, mu_d=mu) for mu in sides]
    for sign, side, bristle in zip((1, -1), pair, bristles, strict=True):
        assert law.force(sign * v, 5.0) == pytest.approx(side.force(sign * v, 5.0), rel=1e-14)
        both, u = sf.Asymmetric(*bristles), sign * max(v, 0.01)
        z = both.steady_state(u, 5.0)
        assert both.rate(u, 5.0, z) == pytest.approx(0.0, abs=1e-14)
        assert both.force(u, 5.0, z) == pytest.approx(sign * 5.0 * bristle.mu_d)


@given(v=speeds, pair=st.tuples(*2 * [st.floats(0.05, 0.5)]), other=st.floats(0.0, 1.0))
def test_blend_never_breaks_the_order_of_the_levels(
    v: float, pair: tuple[float, float], other: float
) -> None:
    """Rounding must not lift mu_d above mu_s, which a law refuses."""
    one = sf.SelfTuning(mu_s=pair[0], mu_d=pair[0])
    two = sf.SelfTuning(mu_s=pair[1], mu_d=other * pair[1])
    force = sf.Asymmetric(one, two).force(v, 5.0)
    assert np.isfinite(force)
    assert force * v >= 0


def test_effective_load_is_preload_plus_share_and_finite_at_lift_off() -> None:
    for N in (0.0, 1.0, 50.0):
        law = sf.LoadDependent(sf.BrownMcPhee(), N_0=0.0, c=1.0, N_eps=0.0)
        assert law.force(2e-3, N) == sf.BrownMcPhee().force(2e-3, N)
    law = sf.LoadDependent(sf.Coulomb(mu_d=0.5), N_0=2.0, c=0.1, N_eps=0.0)
    assert law.force(1.0, 30.0) == pytest.approx(2.5)
    for N in (0.0, -1.0, -1e4):
        loaded, bare = sf.LoadDependent(sf.LuGre(), N_0=2.0), sf.LoadDependent(sf.LuGre())
        assert loaded.force(0.1, N, loaded.steady_state(0.1, N)) == pytest.approx(0.2, rel=1e-3)
        assert 0 <= bare.force(0.1, N, bare.steady_state(0.1, N)) <= 1e-4
    for N in (1e3, 10.0):
        one, other = (sf.LoadDependent(sf.Coulomb(), N_eps=e).force(0.1, N) for e in (1e-3, 0.0))
        assert one == pytest.approx(other, rel=1e-8)
    side = sf.Sum((sf.Coulomb(mu_d=0.5), sf.Viscous(sigma_2=2.0)))
    law = sf.LoadDependent(
        sf.Asymmetric(side, sf.with_values(side, {"mu_d": 0.3})), N_0=10.0, c=0.0
    )
    assert [law.force(v, 99.0) for v in (1.0, -1.0)] == pytest.approx([7.0, -5.0])


def test_velocity_scale_is_the_smallest_one_inside() -> None:
    scales: dict[sf.Law, float] = {
        sf.Sum((sf.Stribeck(v_eps=2e-4), sf.Coulomb(v_eps=1e-3), sf.Viscous())): 2e-4,
        sf.Sum((sf.Viscous(), sf.Dahl())): inf,
        sf.Asymmetric(sf.Coulomb(v_eps=1e-3), sf.Coulomb(v_eps=3e-4)): 3e-4,
        sf.LoadDependent(sf.BrownMcPhee(v_t=0.02)): 0.02,
        sf.SelfTuning(B=500.0): 2e-3,
    }
    assert {law: law.velocity_scale for law in scales} == pytest.approx(scales)


def test_step_of_a_sum_is_the_steps_of_its_terms_below_each_other() -> None:
    one, other = sf.GMS(form="event"), sf.MaxwellSlip(form="event")
    z = np.linspace(0.1, 0.4, 16)
    z[4:8], z[12:] = 1.0, 0.0
    found = sf.Sum((one, sf.Viscous(), other)).held_step(1e-3, 5.0, z, 2e-3)
    first, second = one.held_step(1e-3, 5.0, z[:8], 2e-3), other.held_step(1e-3, 5.0, z[8:], 2e-3)
    for rows, a, b in zip(found, first, second, strict=True):  # pyright: ignore[reportArgumentType]
        np.testing.assert_array_equal(rows, [*a, *b])
    assert sf.Sum((one, sf.LuGre())).held_step(1e-3, 5.0, np.zeros(9), 1e-3) is None
    assert sf.Sum((sf.Coulomb(), sf.Viscous())).held_step(1e-3, 5.0, (), 1e-3) is None


@given(v=speeds, w=speeds)
def test_lagged_force_is_that_of_the_velocity_it_follows(v: float, w: float) -> None:
    law, z = sf.Lagged(sf.Stribeck(), tau_L=0.02), np.array([w])
    assert law.force(v, N, z) == sf.Stribeck().force(w, N)
    assert law.rate(v, N, z)[0] == pytest.approx((v - w) / 0.02)
    assert law.force(v, N, law.steady_state(v, N)) == sf.Stribeck().force(v, N)


def test_force_lags_behind_a_swinging_velocity_as_a_filter_does() -> None:
    """Viscous friction shows the velocity that it follows, in closed form."""
    w, tau = 2 * np.pi * 5, 0.02
    law = sf.Lagged(sf.Viscous(sigma_2=2.0), tau_L=tau)
    run = sf.simulate(prescribed_motion(law, N, lambda t: 0.1 * ca.sin(w * t)), 1.0, rtol=1e-9)
    late = run.t > 0.5
    expected = 0.2 * np.sin(w * run.t - np.arctan(w * tau)) / np.hypot(1, w * tau)
    assert run["friction"][late] == pytest.approx(expected[late], abs=1e-6)
    run = sf.simulate(sf.rabinowicz(sf.Lagged(sf.Coulomb(), tau_L=1e-4)), 5.0, rtol=1e-6)
    assert run["x"].max() == pytest.approx(0.4354, abs=0.01)


@given(T=st.floats(253.15, 353.15), v=speeds, z=deflections)
def test_coefficients_fall_exponentially_with_the_temperature(T: float, v: float, z: float) -> None:
    parts = sf.Sum((sf.Coulomb(mu_d=0.1), sf.Viscous(sigma_2=3.0)))
    law = sf.TemperatureDependent(parts, T=T, k_dry=0.002, k_wet=0.03)
    expected = sf.Coulomb(mu_d=0.1).force(v, N) * np.exp(-0.002 * (T - 293.15))
    expected += 3.0 * v * np.exp(-0.03 * (T - 293.15))
    assert law.force(v, N) == pytest.approx(expected, rel=1e-12, abs=1e-300)
    bristle, state = sf.LuGre(sigma_2=0.4), np.array([z])
    wrapped = sf.TemperatureDependent(bristle)
    assert wrapped.force(v, N, state) == bristle.force(v, N, state)
    assert wrapped.rate(v, N, state) == bristle.rate(v, N, state)


def test_every_law_feels_the_temperature_by_the_roles_of_its_parameters() -> None:
    for name, kind in sf.ALL_LAWS.items():
        law = kind()
        warm = sf.TemperatureDependent(law, T=303.15, k_dry=0.01, k_wet=0.03).inner
        share = {"level": np.exp(-0.1), "viscous": np.exp(-0.3)}
        for key, p in sf.parameters(law).items():
            expected = float(p.value) * share.get(p.role, 1.0)
            assert float(sf.parameters(warm)[key].value) == pytest.approx(expected), (name, key)
        assert {"level", "viscous"} & {p.role for p in sf.parameters(law).values()}, name
    kept = sf.parameters(sf.TemperatureDependent(sf.Bittencourt(), k_dry=0.1, T=300.0).inner)
    assert kept["T"].value == sf.Bittencourt().T  # a temperature of the law is no coefficient
    T = ca.SX.sym("T")
    F = ca.Function("F", [T], [sf.TemperatureDependent(sf.Viscous(sigma_2=2.0), T=T).force(0.1, N)])
    assert float(F(303.15)) == pytest.approx(0.2 * np.exp(-0.3))


def test_wrappers_hand_on_all_members_of_the_law_inside() -> None:
    law = sf.GMS(form="event", sigma_2=0.4)
    z, v, load, h = law.steady_state(0.01, N) * 0.5, 0.01, N, 1e-3
    same = sf.Asymmetric(law, sf.with_values(law, {}))
    normalised, warm = sf.LoadNormalised(law, N_0=N), sf.TemperatureDependent(law)
    wrappers = same, sf.LoadDependent(law, N_eps=0.0), warm, normalised
    for wrapper in wrappers:
        assert (wrapper.states, wrapper.inputs) == (law.states, law.inputs)
        assert wrapper.velocity_scale == law.velocity_scale
        assert wrapper.warnings() == law.warnings()
        assert wrapper.force(v, load, z) == law.force(v, load, z)
        assert (wrapper.rate(v, load, z) == law.rate(v, load, z)).all()
        assert (wrapper.steady_state(v, load) == law.steady_state(v, load)).all()
        steps = wrapper.held_step(v, load, z, h), law.held_step(v, load, z, h)
        assert all((a == b).all() for a, b in zip(*steps, strict=True))  # type: ignore[arg-type]
        for one, other in zip(wrapper.switches(v, load, z), law.switches(v, load, z), strict=True):
            assert (one.name, one.direction) == (other.name, other.direction)
            assert one.expression == other.expression
    lagged = sf.Lagged(sf.Karnopp(), tau_L=0.01)
    assert (lagged.inputs, lagged.velocity_scale) == (
        sf.Karnopp().inputs,
        sf.Karnopp().velocity_scale,
    )
    assert lagged.switches(v, load, np.array([v])) == ()
    assert lagged.held_step(v, load, np.array([v]), h) is None


def test_lugre_becomes_its_own_load_normalised_form() -> None:
    ours = sf.LoadNormalised(sf.LuGre(sigma_2=0.4), N_0=5.0)
    other = sf.LuGreNormalised(sigma_0=1e5 / 5, sigma_1=190.0 / 5, sigma_2=0.4 / 5)
    for v, N, z in ((0.01, 3.0, 1e-6), (-0.3, 700.0, 2e-5), (1e-4, 0.0, -1e-6)):
        for what, arguments in (("force", (v, N, z)), ("rate", (v, N, z)), ("steady_state", (v, N)),
                                ("sliding", (v, N, 1)), ("static_level", (N,))):  # fmt: skip
            found, wanted = (np.ravel(getattr(law, what)(*arguments)) for law in (ours, other))
            assert found == pytest.approx(wanted, rel=1e-12), what
    dry, v = sf.Stribeck(), np.linspace(-0.1, 0.1, 7)
    np.testing.assert_allclose(
        sf.LoadNormalised(dry, N_0=3.0).force(v, 70.0), dry.force(v, 70.0), rtol=1e-12
    )


def test_bristles_that_stop_a_crank_go_on() -> None:
    for law in (sf.LuGre(), sf.HaessigFriedland()):
        with pytest.raises(sf.SolveError):
            sf.simulate(SliderCrank(law).model(), 0.02)
        run = sf.simulate(SliderCrank(sf.LoadNormalised(law, N_0=4700.0)).model(), 0.02)
        assert run.status is sf.Status.SUCCESS, law
        assert np.abs(run["crank_friction"] / run["crank_N"]).max() < 0.3


def test_the_advice_for_bristles_appears_once_and_can_be_copied() -> None:
    run = sf.simulate(FourBar(sf.LuGre()).model(), 0.1, throw=False)
    assert not run.status.ok
    assert run.message.count("keep the deflection") == 1
    assert "joints theta_crank, theta_coupler, theta_rocker" in run.message
    begin = run.message.index("LoadNormalised(")
    line = run.message[begin : run.message.index(" for LuGre", begin)].replace("...", "")
    advised = eval(line, {"LoadNormalised": sf.LoadNormalised, "LuGre": sf.LuGre})
    assert sf.simulate(FourBar(advised).model(), 0.1).status is sf.Status.SUCCESS


class Sandpaper(sf.StaticLaw):
    """A law of a user."""

    velocity_scale = 1.0

    def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
        return sf.Coulomb().force(v, N)


TEXTS = (
    "coulomb+viscous",
    "coulomb+viscous+lugre",
    "asymmetric(coulomb+viscous)",
    "exact(asymmetric(stribeck+viscous))",
    "load_dependent(lugre)",
    "load_normalised(lugre)",
    "lagged(stribeck+viscous)",
    "temperature_dependent(load_dependent(lugre))",
    "load_dependent(asymmetric(dahl+viscous))+stribeck",
    "asymmetric(lugre)+load_dependent(coulomb)",
)


def test_text_and_law_name_are_inverse() -> None:
    for text in (*sf.ALL_LAWS, *TEXTS):
        assert sf.law_name(sf.law_from_text(text)) == text
        assert type(sf.law_from_text(text)) is sf.ALL_LAWS.get(text, type(sf.law_from_text(text)))
    for name, kind in sf.POPULATIONS.items():
        assert type(sf.any_from_text(name)) is kind
        assert sf.law_name(sf.any_from_text(name)) == name
    assert isinstance(sf.any_from_text("haessig_friedland_bristles"), sf.RandomBristles)
    assert sf.any_from_text(" adams ") is not None
    assert sf.law_name(sf.law_from_text(" coulomb + viscous ")) == "coulomb+viscous"
    assert sf.law_name(Sandpaper()) == "Sandpaper"
    pair = sf.law_from_text("asymmetric(coulomb)")
    assert isinstance(pair, sf.Asymmetric)
    assert pair.positive is pair.negative
