"""Arguments that simulations have in common, checked once for a model; the method "auto"."""

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
from symfric.integrator.arguments import LOOSE, check_span, chosen
from symfric.integrator.methods.tableaux import RADAU5, RODAS5P
from symfric.integrator.simulate import REMEMBERED

MODEL = drive(Viscous())


def test_tolerance_is_that_of_the_events_at_most_and_then_no_loose_one() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert check_span("here", rabinowicz(ExactCoulomb()), 0.0, 1.0, 1e-3)[2] == 1e-7
    assert check_span("here", rabinowicz(ExactCoulomb()), 0.0, 1.0, 1e-9)[2] == 1e-9
    assert check_span("here", MODEL, 0.0, 1.0, 1e-6)[2] == 1e-6


def test_methods_by_name_and_by_tolerance() -> None:
    for rtol, method in ((1e-13, RODAS5P), (1e-6, RODAS5P), (LOOSE, RODAS5P), (2e-5, RADAU5)):
        assert chosen("here", "auto", rtol) is method
    for name, message in (
        ("rodas5", "here: method: expected one of auto, rodas5p.* did you mean rodas5p"),
        ("backward_euler", "here: method: expected one with error control.* which has fixed steps"),
    ):
        with pytest.raises(ValueError, match=message):
            chosen("here", name, 1e-6)


def test_settings_are_checked_once_and_true_is_no_time() -> None:
    """Equal numbers of another type are other settings."""
    model = drive(Viscous())
    first = simulate(model, 1.0, samples=5)
    again = simulate(model, 1.0, samples=5)
    assert again.t.tolist() == first.t.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    again.t[:] = 0.0
    assert simulate(model, 1.0, samples=5).t[-1] == 1.0
    assert len(model.memory["settings"]) == 1
    with pytest.raises(ValueError, match="t_end"):
        simulate(model, True, samples=5)
    assert simulate(model, np.array(1.0), samples=5).t[-1] == 1.0
    for k in range(REMEMBERED + 4):
        simulate(model, 0.01 * (k + 1), samples=5)
    assert len(model.memory["settings"]) == REMEMBERED


def test_every_loose_call_is_warned_of_where_it_is_made() -> None:
    assert simulate(MODEL, 0.1, rtol=LOOSE, samples=5).status.ok
    for call in (simulate, simulate, simulate_by_peer):
        with pytest.warns(UserWarning, match="rtol = 0.001 is above 1e-05; whole stick") as seen:
            call(MODEL, 0.1, rtol=1e-3, samples=5)
        assert [w.filename for w in seen] == [__file__]


def test_numbers_that_would_change_results_silently_are_refused_by_every_entry_point() -> None:
    """4f644ad took them all: no events, no error control, a mass below zero."""
    model = rabinowicz(Viscous(), free=["m"])
    functions = (simulate, simulate_many, simulate_by_peer)
    cases: list[tuple[tuple[object, ...], dict[str, object], str]] = [
        (functions[:2], {"event_tolerance": -1.0}, r"event_tolerance: expected a number > 0 \[s\]"),
        (functions[::2], {"atol": 0.0}, "atol: expected a number > 0, got 0.0"),
        (functions, {"max_steps": 0}, "max_steps: expected a whole number >= 1, got 0"),
        (functions, {"p": {"m": -1.0}}, r"[.]m: expected a number >= .* \[kg\], got -1"),
        (functions[1:2], {"p": {"m": [1.0, -1.0]}}, r"p[.]m: expected a number >= .*, got -1"),
        (
            functions[1:2],
            {"executor": None},
            "executor: expected one of serial, .*Executor, got None",
        ),
        (functions[2:], {"peer": "vm"}, "peer: expected one of sundials, rosenbrock, ggl, got vm"),
        (functions[:1], {"backend": "ggl"}, "backend: expected one of auto, vm, compiled, got ggl"),
        (functions[1:2], {"backend": "ggl"}, "expected one of auto, vm, compiled, cuda, got ggl"),
    ]
    for some, arguments, message in cases:
        for function in some:
            with pytest.raises(ValueError, match=message):
                function(model, 1.0, **arguments)  # type: ignore[operator]
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
