"""Every figure of every law is drawn from finite numbers, or refused in a sentence."""

from collections.abc import Iterable

import numpy as np
import pytest

from symfric import ALL_LAWS, Coulomb, LuGre, figure, law_from_text
from symfric.figures import FIGURES, phenomena
from symfric.laws import GenericAsperity, RandomBristles

pytestmark = pytest.mark.heavy

NEEDS = {
    "profile": set(ALL_LAWS),
    "steady_state": set(ALL_LAWS),
    "sweep_b": {"self_tuning", "rui_wang"},
    "sweep_c": {"self_tuning", "rui_wang"},
    "sweep_e": {"self_tuning", "rui_wang"},
}
SHOWN_WITH = {
    "hysteresis": {"P"},
    "transition": {"P"},
    "lag": {"L"},
    "drift": {"S", "P"},
    "break_away": {"S", "P"},
    "stiction": {"D", "S"},
    "dwell": {"T"},
    "velocity_step": {"L"},
}
OTHER_INPUTS = {"quarter_car_general", "bam"}
"""Laws that need more than a pushed block offers."""


SLOW = ("break_away", "drift")
"""Figures of a second for some laws."""
LED = {
    *("coulomb", "stribeck", "karnopp", "dahl", "lugre", "gms", "bristle_2d", "exact_coulomb"),
    *OTHER_INPUTS, "wojewoda",
}  # fmt: skip
"""Laws without and with states and events, and those that are refused: drawn in every suite."""


def shows(law: str, name: str) -> bool:
    if name in NEEDS:
        return law in NEEDS[name]
    if name in ("drift", "break_away", "stiction") and law in OTHER_INPUTS | {"wojewoda"}:
        return False
    return bool(SHOWN_WITH[name] & set(phenomena(law_from_text(law))))


@pytest.mark.parametrize("law", ALL_LAWS)
def test_every_figure_has_finite_columns_of_one_length_or_is_refused(law: str) -> None:
    every_figure_is_finite_or_refused(law, [n for n in FIGURES if law in LED or n not in SLOW])


@pytest.mark.slow
@pytest.mark.parametrize("law", [law for law in ALL_LAWS if law not in LED])
def test_long_figures_of_the_other_laws_are_finite_or_refused(law: str) -> None:
    every_figure_is_finite_or_refused(law, SLOW)


def every_figure_is_finite_or_refused(law: str, names: Iterable[str]) -> None:
    for name in names:
        if not shows(law, name):
            with pytest.raises(ValueError, match=r"expected a law (that|with)"):
                figure(law_from_text(law), name)
            continue
        data = figure(law_from_text(law), name)
        assert data.name == name
        for curve in data.curves:
            assert len({values.shape for values in curve.columns.values()}) == 1
            assert {column for panel in data.panels for column in panel} <= set(curve.columns)
            assert set(curve.columns) <= set(data.units)
            assert all(np.isfinite(values).all() for values in curve.columns.values())


REFERENCES = {"generic_asperity": GenericAsperity(count=12), "random_bristles": RandomBristles()}


LONG = {("generic_asperity", name) for name in ("break_away", "drift", "dwell", "stiction")}


@pytest.mark.parametrize(
    ("law", "name"),
    [
        pytest.param(law, name, marks=pytest.mark.slow if (law, name) in LONG else ())
        for law in REFERENCES
        for name in FIGURES
        if not name.startswith("sweep")
    ],
)
def test_a_population_has_the_figures_of_its_phenomena(law: str, name: str) -> None:
    reference = REFERENCES[law]
    needed = SHOWN_WITH.get(name)
    if needed and not needed & set(phenomena(reference)):
        with pytest.raises(ValueError, match="expected a law that"):
            figure(reference, name)
        return
    for curve in figure(reference, name).curves:
        assert curve.law == law
        assert all(np.isfinite(values).all() for values in curve.columns.values())


def test_the_refusal_says_what_is_missing_and_who_has_it() -> None:
    with pytest.raises(ValueError, match=r"shows pre-sliding displacement, got .* are dahl, "):
        figure(Coulomb(), "hysteresis")


def test_an_unknown_figure_is_refused_with_the_closest_name() -> None:
    with pytest.raises(ValueError, match="did you mean hysteresis"):
        figure(LuGre(), "histeresis")


def test_a_class_and_a_symbol_are_refused() -> None:
    with pytest.raises(ValueError, match="got the class LuGre"):
        figure(LuGre, "profile")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("N", [0.0, -1.0, float("nan")])
def test_a_normal_force_that_does_not_press_is_refused(N: float) -> None:
    with pytest.raises(ValueError, match="figure: N: expected"):
        figure(LuGre(), "hysteresis", N)
