import pytest

from identification.old.choice import choose, one_digit
from symfric import Coulomb, law_from_text, parameters, symbolise


@pytest.mark.parametrize(
    ("text", "free"),
    [
        ("coulomb+viscous", {"m", "offset", "mu_d", "sigma_2"}),
        ("stribeck", {"m", "offset", "mu_s", "mu_d", "v_s", "sigma_2"}),
        ("brown_mcphee", {"m", "offset", "mu_s", "mu_d", "v_t", "mu_v"}),
        ("self_tuning", {"m", "offset", "mu_s", "mu_d", "B"}),
        ("asymmetric(coulomb)", {"m", "mu_d_pos", "mu_d_neg"}),
        ("load_dependent(coulomb)", {"m", "offset", "mu_d"}),
        ("steady_state_lugre", {"m", "offset", "F_S", "F_C", "v_s", "sigma_2"}),
        ("quarter_car_simple", {"m", "offset", "C_e", "e_1", "sigma_v"}),
        ("rui_wang", {"m", "offset", "D", "B"}),
        ("capstan", {"m", "offset", "mu_d"}),
    ],
)
def test_fitted_by_default(text: str, free: set[str]) -> None:
    choice = choose(law_from_text(text), 0.1)
    assert set(choice.free) == free
    assert set(choice.reasons) == set(parameters(choice.drive)) - free


def test_what_only_a_change_of_load_or_temperature_could_tell_apart_is_held() -> None:
    """A level without load and one by load; what nothing could tell apart is left to the fit."""
    choice = choose(law_from_text("bittencourt"), 1.0)
    alike = "load and temperature are constant: it cannot be told from "
    assert choice.reasons["F_cl"] == f"{alike}F_c0"
    assert choice.reasons["F_sT"].startswith(alike)
    assert "F_c0" in choice.free
    asked = choose(law_from_text("bittencourt"), 1.0, free=["F_cl"])
    assert "F_cl" in asked.free
    assert asked.reasons["F_c0"] == f"{alike}F_cl"
    assert {"mu_d_1", "mu_d_2"} <= set(choose(law_from_text("coulomb+coulomb"), 1.0).free)


def test_smoothing_widths_follow_the_speeds() -> None:
    values = parameters(choose(law_from_text("asymmetric(coulomb)"), 0.23).drive)
    assert values["v_eps_pos"].value == pytest.approx(2e-4)
    assert values["v_blend"].value == pytest.approx(2e-5)


def test_a_width_that_the_user_chose_is_kept() -> None:
    assert parameters(choose(Coulomb(v_eps=3e-5), 0.23).drive)["v_eps"].value == 3e-5


def test_free_and_fixed_override() -> None:
    choice = choose(law_from_text("stribeck"), 0.1, 9.0, ["delta"], {"offset": 0.5})
    assert "delta" in choice.free
    assert "offset" not in choice.free
    values = parameters(choice.drive)
    assert (values["offset"].value, values["N"].value) == (0.5, 9.0)
    assert choice.reasons["offset"] == "given"


@pytest.mark.parametrize(
    ("text", "free", "fixed", "message"),
    [
        ("lugre", [], {}, "expected a static law, got LuGre with internal states z"),
        ("coulomb+dahl", [], {}, "expected a static law, got Sum with internal states"),
        ("coulomb", ["mu_x"], {}, "got mu_x; did you mean mu_d"),
        ("coulomb", ["N"], {}, "expected one of m, offset, .* got N"),
        ("coulomb", ["m"], {"m": 2.0}, "expected each name free or fixed, got both for m"),
        ("stribeck", [], {"mu_s": 1.0, "mu_d": 2.0}, "expected mu_d <= mu_s, got mu_d = 2"),
        ("coulomb", [], {"m": -2.0}, r"m: expected .* \[kg\], got -2"),
    ],
)
def test_bad_choices_are_refused(
    text: str, free: list[str], fixed: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        choose(law_from_text(text), 0.1, 1.0, free, fixed)


@pytest.mark.parametrize(
    ("fixed", "free", "start"), [({"mu_d": 12.0}, "mu_s", 12.0), ({"mu_s": 0.01}, "mu_d", 0.01)]
)
def test_a_held_level_takes_the_free_one_along(
    fixed: dict[str, float], free: str, start: float
) -> None:
    choice = choose(law_from_text("viscous+stribeck"), 0.1, fixed=fixed)
    assert free in choice.free
    assert parameters(choice.drive)[free].value == start


def test_symbols_are_refused_as_start_values() -> None:
    law, _ = symbolise(Coulomb(), "mu_d")
    with pytest.raises(ValueError, match="got symbols for mu_d; name them in free="):
        choose(law, 0.1)


@pytest.mark.parametrize(("value", "rounded"), [(1.28e-4, 1e-4), (0.00096, 0.001), (7.6, 8.0)])
def test_one_digit(value: float, rounded: float) -> None:
    assert one_digit(value) == pytest.approx(rounded, rel=1e-12)
