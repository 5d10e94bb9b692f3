"""Arguments that simulations have in common, checked once for a model; the method "auto"."""

import warnings

import numpy as np
import pytest

from symfric import ExactCoulomb, Viscous, drive, rabinowicz, simulate, simulate_many
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
    for call in (simulate, simulate, simulate_by_peer, simulate_many):
        with pytest.warns(UserWarning, match="rtol = 0.001 is above 1e-05; whole stick") as seen:
            call(MODEL, 0.1, rtol=1e-3)
        assert [w.filename for w in seen] == [__file__]
