"""Parametric objects: checks, names, symbols."""

from dataclasses import FrozenInstanceError, dataclass
from math import inf, nan
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

from symfric import Asymmetric, Coulomb
from symfric.foundation.numeric import Scalar
from symfric.foundation.parameters import (
    Parametric,
    distinct,
    option,
    options,
    param,
    parameters,
    symbolise,
    with_values,
)


@dataclass(frozen=True, eq=False)
class Spring(Parametric):
    ordered: ClassVar[tuple[tuple[str, str], ...]] = (("soft", "hard"),)

    soft: Scalar = param(1.0, unit="N/m", doc="soft stiffness", lower=0.0)
    hard: Scalar = param(2.0, unit="N/m", doc="hard stiffness", lower=0.0, upper=100.0)


@dataclass(frozen=True, eq=False)
class Pair(Parametric):
    first: Spring
    second: Spring
    soft: Scalar = param(5.0, unit="1", doc="own parameter of the same name")


@dataclass(frozen=True, eq=False)
class Chain(Parametric):
    links: tuple[Spring, ...]


def test_what_is_not_a_finite_number_within_its_bounds_is_refused() -> None:
    """Arrays skipped bounds and finiteness: `BrownMcPhee(mu_s=np.array(-5.0))` ran."""
    no_numbers = (nan, inf, -inf, "1", None, True, np.float64(nan), np.float32(inf), [1.0],
                  np.array([1.0, nan]), np.array(["a"]), np.zeros(0), ca.DM(nan))  # fmt: skip
    for value in no_numbers:
        with pytest.raises(ValueError, match=r"Spring: soft: expected a finite number \[N/m\] or"):
            Spring(soft=value)
    for value in (-1.0, -1, np.float64(-1.0), np.int64(-1), np.array(-1.0), np.array([1.5, -1.0]),
                  ca.DM(-1.0), ca.SX(-1.0)):  # fmt: skip
        with pytest.raises(ValueError, match=r"soft: expected 0 <= soft <= inf \[N/m\], got -1"):
            Spring(soft=value)
    for value in (ca.SX.sym("k"), ca.MX.sym("k"), ca.DM(3.0), np.ones(3)):
        assert Spring(hard=value).hard is value
    with pytest.raises(ValueError, match=r"soft: .* got -1; hard: .* got 200$"):
        Spring(soft=-1.0, hard=200.0)


def test_order_is_checked_of_numbers_and_left_open_for_symbols() -> None:
    for call, message in (
        (lambda: Spring(soft=3.0), "expected soft <= hard, got soft = 3 and hard = 2"),
        (lambda: Spring(soft=np.array([1.0, 3.0])), r"got soft = \[1. 3.\] and hard = 2"),
        (lambda: Window(low=1.0), "expected low < high, got low = 1 and high = 1"),
        (lambda: Window(low=2.0), "expected low < high, got low = 2 and high = 1"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
    assert Spring(soft=ca.SX.sym("soft")).hard == 2.0
    assert Spring(soft=2.0).soft == 2.0
    assert Spring(soft=np.array([0.5, 1.0]), hard=np.array([0.5, 7.0]))
    assert Window(low=ca.SX.sym("low")).high == 1.0


def test_role_is_one_of_the_known_ones_and_handed_on() -> None:
    with pytest.raises(ValueError, match=r"param: role: expected one of level, .*, got 'levle'"):
        param(1.0, unit="1", doc="x", role="levle")
    found = parameters(Asymmetric(Coulomb(), Coulomb(mu_d=0.2)))["mu_d_pos"]
    assert (found.role, found.field, found.name) == ("level", "mu_d", "mu_d_pos")


def test_parameters_are_frozen_and_compared_by_identity() -> None:
    spring = Spring()
    with pytest.raises(FrozenInstanceError):
        spring.soft = 2.0  # type: ignore[misc]
    assert spring != Spring()
    assert len({spring, Spring(soft=ca.SX.sym("k"))}) == 2


def test_values_reach_their_owners_and_are_checked_together() -> None:
    pair = Pair(Spring(), Spring())
    assert list(parameters(pair)) == ["soft", "soft_1", "hard_1", "soft_2", "hard_2"]
    changed = with_values(pair, {"soft": 7.0, "hard_2": 4.0, "soft_2": 3.5})
    assert (changed.soft, changed.second.soft, changed.second.hard) == (7.0, 3.5, 4.0)
    assert changed.first is pair.first
    assert pair.second.hard == 2.0
    chain = with_values(Chain((Spring(), Spring())), {"hard_2": 4.0})
    assert [link.hard for link in chain.links] == [2.0, 4.0]
    # moving both ends of an order at once must not fail half way
    assert with_values(Spring(), {"soft": 50.0, "hard": 60.0}).soft == 50.0
    with pytest.raises(ValueError, match="expected soft <= hard"):
        with_values(pair, {"soft_1": 50.0})


def test_symbolise_gives_symbols_with_start_nominal_and_bounds() -> None:
    spring, (hard, soft) = symbolise(Spring(soft=0.0, hard=50.0), "hard", "soft")
    assert spring.hard is hard.symbol
    assert spring.soft is soft.symbol
    assert (hard.start, hard.nominal, hard.lower, hard.upper) == (50.0, 50.0, 0.0, 100.0)
    assert (soft.start, soft.nominal) == (0.0, 1.0)
    assert (hard.unit, hard.doc) == ("N/m", "hard stiffness")


def test_symbolise_refuses_unknown_and_repeated_names() -> None:
    assert symbolise(Spring())[1] == ()
    with pytest.raises(ValueError, match="expected one of soft, hard, got softt, q; did you mean"):
        symbolise(Spring(), "softt", "q")
    with pytest.raises(ValueError, match="Spring: expected every name once, got soft, soft"):
        symbolise(Spring(), "soft", "soft")


def test_distinct_names() -> None:
    for groups, taken, expected in (
        ([["a"], ["b"]], [], [["a"], ["b"]]),
        ([["a"], ["a"]], [], [["a_1"], ["a_2"]]),
        ([["a"], ["b"]], ["b"], [["a"], ["b_2"]]),
        ([["a_2"], ["a"], ["a"]], [], [["a_2"], ["a_2_2"], ["a_3"]]),
        ([["a", "a_1"], ["a"]], [], [["a_1_1", "a_1"], ["a_2"]]),
        ([[], ["a"]], ["a"], [[], ["a_2"]]),
    ):
        assert distinct(groups, taken) == expected


@dataclass(frozen=True, eq=False)
class Window(Parametric):
    strictly_ordered: ClassVar[tuple[tuple[str, str], ...]] = (("low", "high"),)

    low: Scalar = param(0.0, unit="m", doc="lower edge")
    high: Scalar = param(1.0, unit="m", doc="upper edge")
    form: str = option("smooth", choices=("smooth", "original"), doc="edges")


def test_option_is_one_of_its_choices_no_parameter_and_stays_when_values_change() -> None:
    window = Window(form="original")
    assert options(window)["form"].value == "original"
    assert list(parameters(window)) == ["low", "high"]
    assert with_values(window, {"high": 3.0}).form == "original"
    with pytest.raises(ValueError, match=r"form: expected one of smooth, original, got 'sharp'"):
        Window(form="sharp")
