"""Fitted parameters of a law, a scene or a model, and their coordinates."""

import pickle

import numpy as np
import pytest

from identification.unknowns.spec import Unknown, above, linear, log, tied
from identification.unknowns.subject import Subject, subject
from identification.unknowns.unknowns import Unknowns, unknowns_of
from symfric.laws import GMS, LuGre, Stribeck
from symfric.laws.catalogue import ALL_LAWS
from symfric.scenes import Rabinowicz

NEED_MORE = {"wojewoda", "quarter_car_general", "bam", "brush_tyre", "lugre_tyre"}
"""Laws with inputs that a drive does not offer."""
BEYOND_ORDER = {"leuven", "rate_and_state"}
"""Laws with conditions that are no order of two parameters: the guard refuses a trial."""


def coordinates(found: Subject) -> Unknowns:
    return unknowns_of(found.unknowns, found.ties, found.names, found.held)


def named(what: object, **given: object) -> dict[str, Unknown]:
    return {u.name: u for u in subject(what, **given).unknowns}  # pyright: ignore


@pytest.mark.parametrize("name", sorted(ALL_LAWS.keys() - NEED_MORE))
def test_every_point_of_the_box_is_a_law_that_can_be_constructed(name: str) -> None:
    found = subject(ALL_LAWS[name](), v_max=0.15)
    at = coordinates(found)
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(2):
        w = np.clip(at.start + 2 * rng.standard_normal(at.start.size), at.lower, at.upper)
        try:
            assert found.close(at.named(w)).law is not None
        except ValueError:
            refused += 1
    assert refused == 0 or name in BEYOND_ORDER


@pytest.mark.parametrize("name", ["stribeck", "velocity_based", "ambrosio", "lugre", "specker"])
def test_slope_is_the_derivative_of_the_values(name: str) -> None:
    found = subject(ALL_LAWS[name](), v_max=0.15, free={"m": (0.1, 10)})
    at = coordinates(found)
    w, h = at.start + 0.01, 1e-6
    numeric = np.stack([(at.values(w + h * e) - at.values(w - h * e)) / (2 * h)
                        for e in np.eye(w.size)], axis=1)  # fmt: skip
    assert at.slope(w) == pytest.approx(numeric, rel=1e-6, abs=1e-8 * np.abs(numeric).max())


def test_values_and_coordinates_invert_each_other() -> None:
    at = coordinates(subject("velocity_based", v_max=0.15))
    values = {"m": 2.0, "mu_s": 3.0, "mu_d": 2.5, "v_s": 0.004, "v_d": 0.02, "offset": -0.3}
    assert at.named(at.of(values)) == pytest.approx(values)


def test_roles_determine_what_is_fitted_and_give_the_reason() -> None:
    found = subject("lugre", v_max=0.1)
    assert found.names == (
        "m", "offset", "mu_s", "mu_d", "v_s", "sigma_0", "sigma_1", "sigma_2",
    )  # fmt: skip
    assert set(found.reasons) == {"N", "delta", "v_eps"}
    steady = subject("lugre", points=True, v_max=0.1)
    assert steady.names == ("mu_s", "mu_d", "v_s", "sigma_2")
    assert "steady" in steady.reasons["sigma_0"]
    moving = subject("lugre", points=True, moving=True, v_max=0.1)
    assert {"sigma_0", "sigma_1"} <= set(moving.names)
    machine = subject(Rabinowicz(Stribeck()), v_max=0.1)
    assert "m" in machine.reasons and "mu_d" in machine.names


def test_widths_follow_the_speeds_unless_the_user_chose_them() -> None:
    for what, v_max, width in (("stribeck", 0.3, 3e-4), (Stribeck(v_eps=1e-5), 0.3, 1e-5),
                               ("stribeck", 0.0, 1e-4)):  # fmt: skip
        assert subject(what, v_max=v_max).held["v_eps"] == pytest.approx(width)


def test_a_drive_that_turns_has_units_that_turn() -> None:
    units = {n: u.unit for n, u in named("stribeck", turning=True).items()}
    assert units["m"] == "kg m^2" and units["v_s"] == "rad/s" and units["sigma_2"] == "N m s/rad"
    assert subject("stribeck", turning=True).drive.turning  # pyright: ignore


def test_specs_bound_tie_and_order() -> None:
    free = {
        "sigma_0": log(1e3, 1e7), "sigma_1": tied(lambda p: 2 * p["sigma_0"] ** 0.5),
        "offset": linear(-1, 1), "v_s": (1e-4, 1e-2), "m": 2.5,
    }  # fmt: skip
    at = coordinates(subject("lugre", free=free))
    assert "sigma_1" in at.names and "sigma_1" not in at.fitted
    values = at.named(at.start)
    assert values["sigma_1"] == pytest.approx(2 * values["sigma_0"] ** 0.5)
    assert values["m"] == pytest.approx(2.5)
    by_name = named("lugre", free=free)
    assert (by_name["sigma_0"].lower, by_name["sigma_0"].upper) == (1e3, 1e7)
    assert by_name["mu_s"].above == "mu_d"
    other = named("lugre", free={"offset": log(1e-3, 10), "sigma_0": linear(1.0, 1e7)})
    assert other["offset"].logarithmic and not other["sigma_0"].logarithmic
    assert named("lugre", free={"sigma_1": above("sigma_2")})["sigma_1"].above == "sigma_2"


def test_a_tied_value_is_a_multiple_of_its_partner() -> None:
    at = coordinates(subject("stribeck", free={"mu_s": tied("mu_d", 1.2)}))
    values = at.named(at.of({"mu_d": 3.0}))
    assert values["mu_s"] == pytest.approx(3.6)
    i, j = at.names.index("mu_s"), at.names.index("mu_d")
    assert at.slope(at.start)[i] == pytest.approx(1.2 * at.slope(at.start)[j])


def test_bounds_of_the_upper_one_of_a_pair_leave_the_lower_one_its_range() -> None:
    for free in ({"mu_s": (2.0, 2.5)}, {"mu_s": (2.0, 2.5), "mu_d": (0.5, 9.0)}):
        at, rng = coordinates(subject("stribeck", free=free)), np.random.default_rng(0)
        for _ in range(50):
            w = at.start + rng.uniform(-3, 3, at.start.size)
            values = at.named(np.clip(w, at.lower, at.upper))
            assert 2.0 <= values["mu_s"] <= 2.5
            assert values["mu_d"] <= values["mu_s"]
        wanted = {"mu_s": 2.4, "mu_d": 0.7}
        named = at.named(at.of(wanted))
        assert {n: named[n] for n in wanted} == pytest.approx(wanted)


def test_a_fixed_partner_of_an_order_becomes_a_bound() -> None:
    assert named("stribeck", fixed={"mu_d": 3.0})["mu_s"].lower == 3.0
    assert named("stribeck", fixed={"mu_s": 3.0})["mu_d"].upper == 3.0
    assert [*named("stribeck", free=["mu_d"], fixed="others")] == ["mu_d"]


def test_a_model_keeps_orders_and_gives_its_law() -> None:
    model = Rabinowicz(LuGre()).model(free=["mu_s", "mu_d", "sigma_0"])
    found = subject(model, fixed={"sigma_0": 2e5})
    assert {u.name: u.above for u in found.unknowns} == {"mu_s": "mu_d", "mu_d": ""}
    law, _, closed = found.close({"mu_s": 0.4, "mu_d": 0.3})
    assert isinstance(law, LuGre) and (law.mu_s, law.sigma_0) == (0.4, 2e5)
    for one in (closed, closed.open):
        assert [v.start for v in one.p] == [0.4, 0.3, 2e5]


def test_what_processes_need_pickles() -> None:
    for what in ("gms", Rabinowicz(GMS()).model(free=["mu_d", "k_1"])):
        found = subject(what)
        at, guard = pickle.loads(pickle.dumps((coordinates(found), found.guard)))
        assert (at.values(at.start) == coordinates(found).values(at.start)).all()
        guard(at.named(at.start))


def test_bounds_of_the_lower_level_take_the_upper_one_along() -> None:
    found = named("stribeck", free={"mu_d": (5.0, 15.0)})
    assert 5.0 <= found["mu_d"].start <= 15.0
    assert found["mu_s"].start > found["mu_d"].start


def box(*unknowns: Unknown) -> Unknowns:
    return unknowns_of(unknowns, {}, [u.name for u in unknowns])


def test_values_that_want_to_be_nothing_or_infinite_are_at_their_bound() -> None:
    k = Unknown("k", "N/m", 2.0, 0.0, logarithmic=True)
    mu_d, mu_s = Unknown("mu_d", "1", 0.3), Unknown("mu_s", "1", 0.4, above="mu_d", scale=0.1)
    made = box(k, mu_d)
    gone = np.array([-700.0, 0.0])
    assert made.at_bound(gone).tolist() == [True, False]
    there = np.maximum(gone, made.limits[0])
    assert made.values(there)[0] == pytest.approx(2e-12)
    assert np.linalg.det(made.slope(there)) > 0
    made = box(k, mu_d, mu_s)
    far = np.array([700.0, 1e9, 300.0])
    assert made.at_bound(far).tolist() == [True, False, True]
    stiff, low, high = made.values(np.minimum(far, made.limits[1]))
    assert (stiff, high - low) == pytest.approx((2e12, 0.2e12), rel=1e-3)
    assert not made.at_bound(made.start).any()


def test_a_value_goes_back_to_the_far_bound_that_its_law_has() -> None:
    made = box(Unknown("v_s", "m/s", 1e-3, lower=1e-12, upper=1e6, logarithmic=True))
    low, high = (made.values(limit)[0] for limit in made.limits)
    assert 1e-12 < low < 1.001e-12 and 0.999e6 < high < 1e6


def test_both_ends_of_a_box_are_bounds() -> None:
    made = box(Unknown("a", "m", 2.0, 1.0, 3.0), Unknown("b", "m", 0.0))
    for value, there in ((1.0, True), (2.0, False), (3.0, True)):
        assert made.at_bound(np.array([value, 0.0])).tolist() == [there, False]
