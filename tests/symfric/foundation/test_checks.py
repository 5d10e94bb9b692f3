"""Checks of public functions, elementary functions, statuses.

Parametric objects: checks, names, symbols.
"""

from dataclasses import FrozenInstanceError, dataclass
from math import e, inf, nan, pi
from pathlib import Path
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from refusing import not_refused

from symfric import Asymmetric, Coulomb, LuGre, SolveError, Status
from symfric.foundation import checks, numeric
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

NUMBERS: list[Any] = [
    2, 2.0, np.float32(2), np.float64(2), np.int64(2), np.uint8(2), np.array(2.0), np.array(2),
    ca.DM(2), ca.SX(2),
]  # fmt: skip
NO_NUMBERS: list[Any] = [
    None, "2", [2.0], (2.0,), {}, True, np.True_, 2j, object(), float, np.array([2.0]),
    np.array("2"), np.array(None), ca.SX.sym("a"), ca.MX.sym("a"), ca.DM([1, 2]), float("nan"),
    float("inf"), 10**400, lambda: 2,
]  # fmt: skip


def test_every_real_scalar_is_a_number_and_nothing_else_is() -> None:
    for value in NUMBERS:
        found = checks.number("here", value)
        assert found == 2.0
        assert type(found) is float
    for value in NO_NUMBERS:
        with pytest.raises(ValueError, match=r"^here: expected a finite number \[m\], got .+; do"):
            checks.number("here", value, unit="m", hint="do")


def test_counts_are_whole_and_flags_are_truth_values() -> None:
    for value in [*NUMBERS, 2e0]:
        found = checks.count("here", value)
        assert found == 2
        assert type(found) is int
    assert checks.count("here", 10**30) == 10**30
    for value in [*NO_NUMBERS, 2.5, 0, -1]:
        with pytest.raises(ValueError, match=r"^here: expected a whole number >= 1, got "):
            checks.count("here", value)
    with pytest.raises(ValueError, match="whole number from 1 to 3, got 4"):
        checks.count("here", 4, most=3)
    assert checks.flag("here", np.True_) is True
    for value in (None, 1, "yes", [], np.array(1)):
        with pytest.raises(ValueError, match=r"^here: expected True or False, got "):
            checks.flag("here", value)


def test_every_check_reports_place_expectation_and_value() -> None:
    assert not_refused(Path(__file__).with_name("refusals.toml"), checks=checks) == []


def test_what_is_right_comes_back_in_one_type() -> None:
    assert checks.number("w", -3) == -3.0
    assert checks.choice("w", "a", ("a", "b")) == "a"
    assert checks.named("w", None) == {}
    assert checks.named("w", {"a": 1}, ["a"]) == {"a": 1}
    assert checks.names("w", (n for n in ("a", "b")), ["a", "b"]) == ("a", "b")
    for rows in ([1, 2], (1.0, 2.0), np.array([1, 2], np.float32), range(1, 3), ca.DM([1, 2])):
        found = checks.array("w", rows)
        assert found.dtype == np.float64
        assert found.tolist() == [1.0, 2.0]
    assert checks.array("w", []).shape == (0,)
    assert checks.times("w", [0, 1], 0, 1).tolist() == [0.0, 1.0]
    assert checks.path("w", "a.csv") == Path("a.csv")


def test_long_values_and_lists_are_cut_and_the_closest_name_is_offered() -> None:
    """An unknown law used to print all fifty-three before the suggestion."""
    known, hint = [f"law_{i}" for i in range(53)], "symfric laws lists them"
    for name, message in (("law_7x", "did you mean law_7"), ("qqq", hint)):
        with pytest.raises(ValueError, match=f"one of 53 known names, got {name}; {message}"):
            checks.check_names(f"law '{name}'", [name], known, hint)
    with pytest.raises(ValueError, match=r"got 'xxxxx.*\.\.\.$") as caught:
        checks.number("w", "x" * 10_000)
    assert len(str(caught.value)) < 120


def test_integers_that_no_float_holds_are_refused_in_a_sentence() -> None:
    for call, where in (
        (lambda: LuGre().force(0.1, 10**5000, [0.0]), r"LuGre\.force: N: expected a number"),
        (lambda: LuGre(mu_s=10**5000), "LuGre: mu_s: expected a finite number"),
    ):
        with pytest.raises(ValueError, match=f"{where} .*16610 bits"):
            call()


FUNCTIONS = (
    (numeric.exp, 1.0, e), (numeric.log, e, 1.0), (numeric.sqrt, 9.0, 3.0),
    (numeric.sin, pi / 6, 0.5), (numeric.cos, pi / 3, 0.5), (numeric.tan, pi / 4, 1.0),
    (numeric.atan, 1.0, pi / 4), (numeric.asin, 0.5, pi / 6), (numeric.expm1, 1e-20, 1e-20),
    (numeric.tanh, 0.5, (e - 1) / (e + 1)), (numeric.erf, 0.5, 0.5204998778130465),
)  # fmt: skip


def test_functions_of_every_type() -> None:
    for function, x, expected in FUNCTIONS:
        assert function(x) == pytest.approx(expected, rel=1e-14)
        many = function(np.full((2, 3), x))
        assert isinstance(many, np.ndarray)
        assert many.shape == (2, 3)
        for kind in (ca.SX, ca.DM, ca.MX):
            assert isinstance(function(kind(x)), kind)
        assert float(function(ca.DM(x))) == pytest.approx(expected, rel=1e-14)


def test_plain_numbers_and_symbols_are_distinguished() -> None:
    numbers = (1.0, 2, np.float64(1.0), np.int64(3))
    others = (True, np.ones(2), "1", None, ca.DM(1.0), ca.SX(1.0))
    symbols = (ca.SX.sym("x"), ca.MX.sym("x"))
    assert [numeric.is_number(x) for x in (*numbers, *others, *symbols)] == [True] * 4 + [False] * 8
    assert [numeric.equals(x, 1.0) for x in (*numbers, *others)] == [True, False] * 2 + [False] * 6
    assert [numeric.is_symbolic(x) for x in (*others, *symbols)] == [False] * 6 + [True] * 2


def test_columns_of_floats_arrays_and_matrices() -> None:
    assert numeric.column(1.0, 2.0).tolist() == [1.0, 2.0]
    assert numeric.column(1.0, np.array([2.0, 3.0])).tolist() == [[1.0, 1.0], [2.0, 3.0]]
    assert numeric.column(ca.SX.sym("x"), 1.0).shape == (2, 1)
    assert numeric.column().shape == numeric.empty(1.0).shape == (0,)
    assert numeric.empty(np.ones(4)).shape == (0, 4)
    for kind in (ca.SX, ca.MX):  # joins without a trace
        assert ca.vertcat(kind.sym("x"), numeric.empty(kind(1.0))).shape == (1, 1)


def test_smallest_of_floats_arrays_and_symbols() -> None:
    assert numeric.smallest(3.0, 1.0, 2.0) == 1.0
    assert numeric.smallest(np.array([1.0, 5.0]), 3.0).tolist() == [1.0, 3.0]
    s = ca.SX.sym("s")
    least = ca.Function("least", [s], [numeric.smallest(2.0, s)])
    assert [float(least(x)) for x in (1.0, 3.0)] == [1.0, 2.0]


def test_values_are_sentences() -> None:
    for status in Status:
        assert status.value[0].isupper() and status.value.endswith(".") and len(status.value) < 160


def test_results_that_met_their_tolerances_can_be_used_and_no_others() -> None:
    good = {"SUCCESS", "TERMINATED", "SOLVED", "ACCEPTABLE", "DOUBTFUL"}
    assert {status.name for status in Status if status.ok} == good
    assert "time" not in Status.INTERRUPTED.value  # fits use it too


def test_error_carries_message_status_and_what_there_is_so_far() -> None:
    error = SolveError("stopped after t = 1 s", Status.NOT_FINITE, partial=[1, 2])
    assert str(error) == "stopped after t = 1 s"
    assert (error.status, error.partial) == (Status.NOT_FINITE, [1, 2])
    assert isinstance(error, RuntimeError)
    assert SolveError("x", Status.SINGULAR).partial is None


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
