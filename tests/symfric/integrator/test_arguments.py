"""Arguments that simulations have in common, and which method "auto" is."""

import warnings

import numpy as np
import pytest

from symfric import (
    ExactCoulomb,
    Model,
    Variable,
    Viscous,
    drive,
    rabinowicz,
    simulate,
    simulate_many,
)
from symfric.integrator import simulate_by_peer
from symfric.integrator.arguments import LOOSE, check_span, check_times, chosen
from symfric.integrator.methods.tableaux import ADAPTIVE, METHODS, RADAU5, RODAS5P

MODEL = drive(Viscous())


def test_tolerance_is_that_of_the_events_at_most_and_then_no_loose_one() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert check_span("here", rabinowicz(ExactCoulomb()), 0.0, 1.0, 1e-3)[2] == 1e-7
    assert check_span("here", rabinowicz(ExactCoulomb()), 0.0, 1.0, 1e-9)[2] == 1e-9
    assert check_span("here", MODEL, 0.0, 1.0, 1e-6)[2] == 1e-6


def test_good_arguments_pass_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_span("here", MODEL, 0.0, 1.0, 1e-5)
    np.testing.assert_array_equal(check_times("here", 0.0, 1.0, [0, 1]), [0.0, 1.0])


@pytest.mark.parametrize(
    ("t_start", "t_end", "rtol", "message"),
    [
        (1.0, 1.0, 1e-6, "here: expected t_end > t_start = 1 s, got 1 s"),
        (np.nan, 1.0, 1e-6, "here: t_start: expected a finite number \\[s\\], got nan"),
        (0.0, np.inf, 1e-6, "here: t_end: expected a finite number \\[s\\], got inf"),
        (0.0, 1.0, 1e-14, "here: rtol: expected 1e-13 <= number <= 0.1, got 1e-14"),
        (0.0, 1.0, np.nan, "here: rtol: expected 1e-13 <= number <= 0.1, got nan"),
    ],
)
def test_empty_span_and_odd_tolerance_are_refused(
    t_start: float, t_end: float, rtol: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        check_span("here", MODEL, t_start, t_end, rtol)


@pytest.mark.parametrize("t_eval", [[], [[0.0]], [0.5, 0.5], [-0.1], [1.1], [np.nan], 0.5])
def test_times_that_are_no_increasing_row_in_the_span_are_refused(t_eval: object) -> None:
    with pytest.raises(
        ValueError, match=r"here: t_eval: expected (increasing times in .0, 1. s|finite)"
    ):
        check_times("here", 0.0, 1.0, t_eval)  # pyright: ignore[reportArgumentType]


def test_loose_tolerance_warns_with_its_place() -> None:
    with pytest.warns(UserWarning, match="here: rtol = 0.001 is above 1e-05; whole stick phases"):
        check_span("here", MODEL, 0.0, 1.0, 1e-3)


@pytest.mark.parametrize("name", ADAPTIVE)
def test_every_adaptive_method_is_chosen_by_its_name(name: str) -> None:
    assert chosen("here", name, 1e-6) is METHODS[name]


@pytest.mark.parametrize(
    ("rtol", "method"), [(1e-13, RODAS5P), (1e-6, RODAS5P), (LOOSE, RODAS5P), (2e-5, RADAU5)]
)
def test_automatic_choice_takes_the_careful_method_at_loose_tolerances(
    rtol: float, method: object
) -> None:
    assert chosen("here", "auto", rtol) is method


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("rodas5", "here: method: expected one of auto, rodas5p.* did you mean rodas5p"),
        ("backward_euler", "here: method: expected one with error control.* which has fixed steps"),
        ("exponential", "use it with flow or in the C of plants"),
    ],
)
def test_what_cannot_control_its_error_is_refused(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        chosen("here", name, 1e-6)


def test_numbers_that_would_change_results_silently_are_refused_by_every_door() -> None:
    """4f644ad took them all: no events, no error control, a mass below zero."""
    model = rabinowicz(Viscous(), free=["m"])
    doors = (simulate, simulate_many, simulate_by_peer)
    cases: list[tuple[tuple[object, ...], dict[str, object], str]] = [
        (doors[:2], {"event_tolerance": -1.0}, r"event_tolerance: expected a number > 0 \[s\]"),
        (doors[:2], {"event_tolerance": np.nan}, r"event_tolerance: expected a number > 0"),
        (doors[::2], {"atol": np.inf}, "atol: expected a number > 0, got inf"),
        (doors[::2], {"atol": -1e-9}, "atol: expected a number > 0, got -1e-09"),
        (doors[::2], {"atol": 0.0}, "atol: expected a number > 0, got 0.0"),
        (doors, {"max_steps": 0}, "max_steps: expected a whole number >= 1, got 0"),
        (doors, {"p": {"m": -1.0}}, r"[.]m: expected a number >= .* \[kg\], got -1"),
        (doors[1:2], {"p": {"m": [1.0, -1.0]}}, r"p[.]m: expected a number >= .*, got -1"),
        (doors[1:2], {"executor": None}, "executor: expected one of serial, .*Executor, got None"),
        (doors[2:], {"peer": "vm"}, "peer: expected one of sundials, rosenbrock, ggl, got vm"),
        (doors[:1], {"backend": "ggl"}, "backend: expected one of auto, vm, compiled, got ggl"),
        (doors[1:2], {"backend": "ggl"}, "expected one of auto, vm, compiled, cuda, got ggl"),
    ]
    for some, arguments, message in cases:
        for door in some:
            with pytest.raises(ValueError, match=message):
                door(model, 1.0, **arguments)  # type: ignore[operator]
    for nominal in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="variable 'x': nominal: expected a"):
            Variable("x", "m", nominal=nominal)


def test_bounds_of_a_parameter_are_allowed_themselves() -> None:
    k = Variable("k", "1/s", start=0.5, lower=0.0, upper=1.0)
    x = Variable("x", "m", start=1.0)
    model = Model("bounded", x=(x,), p=(k,), ode=-k.symbol * x.symbol)
    assert simulate(model, 1.0, p={"k": 0.0}).final["x"] == 1.0
    assert simulate_many(model, 1.0, p={"k": [0.0, 1.0]})["x"][0, -1] == 1.0


def test_a_peer_knows_no_events() -> None:
    with pytest.raises(ValueError, match="simulate_by_peer: expected a model without events"):
        simulate_by_peer(drive(ExactCoulomb()), 1.0)
