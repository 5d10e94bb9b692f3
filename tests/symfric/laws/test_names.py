"""Laws by the text that a user types."""

import pytest

from symfric import (
    ALL_LAWS,
    Asymmetric,
    Coulomb,
    LoadDependent,
    LoadNormalised,
    LuGre,
    StaticLaw,
    law_from_text,
)
from symfric.foundation.numeric import Scalar
from symfric.laws import POPULATIONS, RandomBristles, any_from_text, law_name


@pytest.mark.parametrize("name", ALL_LAWS)
def test_name_gives_the_law_with_default_parameters(name: str) -> None:
    assert type(law_from_text(name)) is ALL_LAWS[name]


@pytest.mark.parametrize(
    "text",
    [
        *ALL_LAWS,
        "coulomb+viscous",
        "coulomb+viscous+lugre",
        "asymmetric(coulomb+viscous)",
        "load_dependent(lugre)",
        "lagged(stribeck+viscous)",
        "temperature_dependent(load_dependent(lugre))",
        "load_dependent(asymmetric(dahl+viscous))+stribeck",
        "asymmetric(lugre)+load_dependent(coulomb)",
    ],
)
def test_text_and_law_name_are_inverse(text: str) -> None:
    assert law_name(law_from_text(text)) == text


@pytest.mark.parametrize("name", POPULATIONS)
def test_a_population_has_a_name_and_no_scene(name: str) -> None:
    assert type(any_from_text(name)) is POPULATIONS[name]
    assert law_name(any_from_text(name)) == name
    with pytest.raises(ValueError, match=rf"expected a law with equations, got {name}, a popul"):
        law_from_text(name)


def test_another_name_of_a_population_is_known() -> None:
    assert isinstance(any_from_text("haessig_friedland_bristles"), RandomBristles)
    assert any_from_text(" adams ") is not None


def test_spaces_are_ignored() -> None:
    assert law_name(law_from_text(" coulomb + viscous ")) == "coulomb+viscous"


def test_wrappers_start_with_equal_sides() -> None:
    law = law_from_text("asymmetric(coulomb)")
    assert isinstance(law, Asymmetric)
    assert law.positive is law.negative
    assert isinstance(law_from_text("load_dependent(coulomb)"), LoadDependent)
    assert isinstance(law_from_text("load_normalised(lugre)"), LoadNormalised)
    assert law_name(LoadNormalised(LuGre())) == "load_normalised(lugre)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lugree", "expected one of .. known names, got lugree; did you mean lugre"),
        ("coulomb+brownmcphee", "law 'coulomb.brownmcphee': .* did you mean brown_mcphee"),
        ("asymmetric(lugree)", "law 'lugree': .* did you mean lugre"),
        ("qqq", "got qqq; .symfric laws. lists them"),
        ("", "law: expected the name of a law, such as lugre, got ''"),
        ("coulomb+", "got an empty term; write one as in coulomb.viscous"),
        ("coulomb++viscous", "got an empty term"),
        ("asymmetric(coulomb+)", "law 'coulomb.': .* got an empty term"),
        ("lagged", r"expected a law to wrap, as in lagged\(stribeck\), got none"),
        ("coulomb+asymmetric", "expected a law to wrap"),
        ("asymmetric(coulomb", "expected balanced parentheses"),
        ("asymmetric(coulomb))", "expected balanced parentheses"),
        ("asymmetric(coulomb)(viscous)", "expected balanced parentheses"),
        (")coulomb(", "expected balanced parentheses"),
        ("asymmetric()", "got asymmetric\\(\\)"),
    ],
)
def test_bad_text_is_refused_with_a_hint(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        law_from_text(text)


def test_own_law_goes_by_its_class_name() -> None:
    class Sandpaper(StaticLaw):
        velocity_scale = 1.0

        def force(self, v: Scalar, N: Scalar, z: Scalar = ()) -> Scalar:
            return Coulomb().force(v, N)

    assert law_name(Sandpaper()) == "Sandpaper"
