"""Units of a model whose events have closed forms: where they are found, once each, and its end."""

import ctypes as c

import numpy as np
import pytest
from backends import needs_compiler
from device_cases import WEDGES
from scipy.optimize import brentq
from units import DISCARD, ERROR, OK, Second, Third

pytestmark = needs_compiler
RTOL = 1e-9


def test_an_input_that_jumps_over_an_event_lets_it_happen_there(exported):
    """Also what the steps beyond that point have seen is forgotten: the gate has only risen."""
    unit = Second(exported("gate", rtol=RTOL)[0])
    assert unit.begin() == OK
    for k in range(4):
        assert unit.step(k / 8, 1 / 8) == OK
    assert unit.set(u=0.2) == OK
    for k in range(4, 6):
        assert unit.step(k / 8, 1 / 8) == OK
    assert unit.get("begun", "at", "falls", "caught") == pytest.approx([1, 0.5, 0, 0], abs=1e-12)
    assert unit.set(u=0.75 + 1e-9) == OK  # ahead of the point for a nanosecond
    assert unit.step(6 / 8, 1 / 8) == OK
    assert unit.get("caught")[0] == 1.0
    unit.free()


def test_an_end_beyond_the_communication_point_is_none_yet(exported):
    unit = Third(exported("gate", 3)[0])
    assert unit.begin() == OK
    for k in range(7):
        assert unit.step(k / 8, 1 / 8) == OK
        assert not any(flag.value for flag in unit.flags)
        assert unit.reached.value == (k + 1) / 8
    assert unit.step(7 / 8, 1 / 4) == OK
    event, terminate, early = (flag.value for flag in unit.flags)
    assert (event, terminate, early) == (False, True, True)
    assert unit.reached.value == pytest.approx(1.0, abs=1e-9)
    unit.free()


def test_what_has_been_terminated_does_not_go_on(exported):
    unit = Second(exported("gate", rtol=RTOL)[0])
    assert unit.begin() == OK
    assert unit.step(0.0, 0.25) == OK
    assert unit.call("Terminate") == OK
    assert unit.step(0.25, 0.25) == DISCARD
    assert unit.get("time", "x") == pytest.approx([0.25, 0.25], abs=1e-12)
    assert unit.set(u=1.0) == ERROR
    unit.free()


def test_a_tolerance_is_no_larger_than_events_want_it(exported):
    unit = Second(exported("gate", rtol=RTOL)[0])
    assert unit.setup(rtol=1e-2) == OK
    assert unit.get("rtol")[0] == 1e-5
    unit.free()


def test_a_start_value_counts_though_others_were_looked_at_before(exported):
    unit = Second(exported("wire", rtol=RTOL)[0])
    assert unit.setup() == OK
    assert unit.call("EnterInitializationMode") == OK
    first = unit.get("z")[0]
    assert unit.set(x=2.0) == OK
    assert unit.get("x", "v").tolist() == [2.0, 0.0]
    assert unit.get("z")[0] > first
    assert unit.call("ExitInitializationMode") == OK
    unit.free()


def test_the_state_of_another_model_is_refused(exported):
    unit, other = Second(exported("wire", rtol=RTOL)[0]), Second(exported("gate", rtol=RTOL)[0])
    assert unit.begin() == other.begin() == OK
    kept = c.c_void_p()
    assert unit.call("GetFMUstate", c.byref(kept)) == OK
    assert other.call("SetFMUstate", kept) == ERROR
    assert unit.call("FreeFMUstate", c.byref(kept)) == OK
    for one in (unit, other):
        one.free()


@pytest.mark.parametrize(("k", "x"), [(0.0, 1.0), (5.0, 2.0), (50.0, 3.9), (0.2, 0.01)])
def test_algebraic_variables_are_found_from_far_away(exported, k, x):
    unit = Second(exported("wire", rtol=RTOL)[0])
    for guess in (0.5, 470.0, -470.0):
        assert unit.call("Reset") == OK
        assert unit.begin(k=k, x=x, z=guess) == OK
        wanted = brentq(lambda z: np.arctan(z) + 0.1 * z - k * x / 4.0, -1e3, 1e3, xtol=1e-13)
        assert unit.get("z")[0] == pytest.approx(wanted, abs=1e-10)
    unit.free()


def test_algebraic_variables_follow_a_parameter_that_falls_to_zero(exported):
    """From 470: undamped, Newton's method goes to and fro between -13.4 and 13.4."""
    unit = Second(exported("wire", rtol=RTOL)[0])
    assert unit.begin(k=50.0, x=3.9) == OK
    assert unit.get("z")[0] > 400.0
    assert unit.set(k=0.0) == OK
    assert unit.get("z")[0] == pytest.approx(0.0, abs=1e-10)
    unit.free()


def test_signals_without_a_solution_are_refused_and_come_back(exported):
    """z^2 = 1 - u: the step would say so, and what is read before it does, too."""
    unit = Second(exported("root", rtol=RTOL)[0])
    assert unit.begin() == OK
    assert unit.set(u=0.75) == OK
    assert unit.get("z")[0] == pytest.approx(0.5)
    assert unit.set(u=2.0) == OK
    reference, number = (c.c_uint * 1)(unit.archive.reference["z"]), (c.c_double * 1)()
    assert unit.call("GetReal", reference, c.c_size_t(1), number) == ERROR
    assert "no solution" in unit.said[-1][1]
    assert unit.set(u=0.0) == OK
    assert unit.get("z")[0] == pytest.approx(1.0)
    assert unit.step(0.0, 0.1) == OK
    unit.free()


def test_a_start_at_which_friction_jams_is_refused(exported):
    for slope, wanted in zip(WEDGES, (OK, ERROR), strict=True):
        unit = Third(exported("wedge", 3)[0])
        found = unit.begin(x=0.0, phi=float(np.arctan(slope)), x_rate=1.0, phi_rate=0.0)
        assert found == wanted, unit.said
        assert wanted == OK or "friction jams" in unit.said[-1]
        unit.free()
