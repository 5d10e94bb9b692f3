"""Units of FMI 2.0 through their C interface: the bits of `simulate`, however they are stepped."""

import ctypes as c
from functools import partial

import numpy as np
import pytest
from backends import needs_compiler
from units import DISCARD, ERROR, OK, Second, over

from symfric import Hold, simulate

pytestmark = needs_compiler
RTOL, SPAN = 1e-9, 2.0
TIMES = np.arange(17) / 8
"""Whose sums and differences are exact."""


@pytest.fixture
def made(exported):
    return partial(exported, rtol=RTOL)


def force(times):
    return 2.0 * np.sin(np.pi * times)


def test_a_unit_whose_input_stays_has_the_bits_of_simulate(made):
    archive, model = made("drive")
    unit = Second(archive)
    assert unit.begin(stop=SPAN, force=1.7) == OK
    found = over(unit, TIMES, ["x", "v", "z", "friction"])
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"force": 1.7})
    assert (found == np.array([same[n] for n in ("x", "v", "z", "friction")]).T).all()
    unit.free()


def test_a_unit_whose_input_jumps_has_the_bits_of_simulate(made):
    archive, model = made("drive")
    unit, held = Second(archive), force(TIMES)
    assert unit.begin() == OK
    at = dict(zip(TIMES, held, strict=True))
    found = over(unit, TIMES, ["x", "v"], lambda t: {"force": at[t]})
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"force": Hold(TIMES, held)})
    assert (found == np.array([same["x"], same["v"]]).T).all()
    unit.free()


def test_tiny_and_odd_communication_steps_cost_no_attempts(made):
    archive, _ = made("drive")
    ends, counts = [], []
    for times in (TIMES, np.linspace(0.0, SPAN, 4097), np.cumsum([0.0, 0.313, 1e-12, 0.7, 0.987])):
        unit = Second(archive)
        assert unit.begin(force=1.7) == OK
        ends.append(over(unit, times, ["x", "v"])[-1])
        counts.append(unit.get("attempts")[0])
        unit.free()
    assert counts[1] <= counts[0] + 1
    assert counts[2] <= counts[0] + 1
    assert np.abs(ends[1] - ends[0]).max() < 1e-12


def test_an_input_that_jumps_at_every_point_costs_one_attempt_more_at_most(made):
    archive, _ = made("drive")
    unit, times = Second(archive), np.arange(257) / 128
    assert unit.begin() == OK
    before, spent = 0.0, []
    for t in times[1:]:
        assert unit.set(force=1.2 + 1e-3 * t) == OK
        assert unit.step(t - 1 / 128, 1 / 128) == OK
        now = unit.get("attempts")[0]
        spent.append(now - before)
        before = now
    assert np.median(spent) == 1.0
    unit.free()


def test_algebraic_variables_follow_at_once_and_events_are_carried_out(made):
    archive, model = made("wire")
    unit, held = Second(archive), np.where(TIMES < 1.0, 0.3, -0.5)
    assert unit.begin(f=0.3) == OK
    assert unit.set(f=1.3) == OK
    (z, x, k, f) = unit.get("z", "x", "k", "f")
    assert abs(np.arctan(z) + 0.1 * z - k * x / (4.0 + f * f)) < 1e-14  # before any step
    assert unit.set(f=0.3) == OK
    at = dict(zip(TIMES, held, strict=True))
    names = ["x", "v", "z", "power"]
    found = over(unit, TIMES, names, lambda t: {"f": at[t]})
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"f": Hold(TIMES, held)})
    assert {name for _, name in same.happened} == {"floor"}
    for i, name in enumerate(names[:2]):
        assert np.abs(found[:, i] - same[name]).max() <= 10 * RTOL * np.abs(same[name]).max()
    unit.free()


def test_a_terminal_event_ends_it_and_says_where(made):
    archive, model = made("wire")
    unit = Second(archive)
    assert unit.begin(f=9.0) == OK
    same = simulate(model, SPAN, rtol=RTOL, u={"f": 9.0})
    assert unit.step(0.0, 2.0) == DISCARD
    over_, reached = c.c_int(), c.c_double()
    assert unit.call("GetBooleanStatus", 3, c.byref(over_)) == OK
    assert unit.call("GetRealStatus", 2, c.byref(reached)) == OK
    assert over_.value == 1
    assert abs(reached.value - same.happened[-1][0]) < 1e-9
    assert "terminal event end" in unit.said[-1][1]
    unit.free()


def test_start_values_are_set_and_the_others_follow(made):
    archive, model = made("drive")
    unit = Second(archive)
    assert unit.begin(v=0.3, mu_s=0.2) == OK
    same = simulate(model, SPAN, x0={"v": 0.3}, p={"mu_s": 0.2}, t_eval=TIMES, rtol=RTOL)
    found = over(unit, TIMES, ["x", "v", "z"])
    assert found[0, 2] == same["z"][0] != 0.0
    assert np.abs(found[:, 1] - same["v"]).max() <= RTOL
    unit.free()


def test_a_parameter_that_is_tuned_acts_from_then_on(made):
    archive, model = made("drive")
    unit = Second(archive)
    assert unit.begin(force=1.7) == OK
    assert unit.step(0.0, 1.03) == OK
    x0 = dict(zip(("x", "v", "z"), unit.get("x", "v", "z"), strict=True))
    assert unit.set(m=2.0) == OK
    assert unit.step(1.03, 0.5) == OK
    same = simulate(model, 0.5, x0=x0, p={"m": 2.0}, u={"force": 1.7}, rtol=RTOL)
    assert abs(unit.get("v")[0] - same.final["v"]) < 10 * RTOL * abs(same.final["v"])
    unit.free()


def test_states_of_the_unit_are_kept_put_back_and_written_as_bytes(made):
    archive, _ = made("drive")
    unit, other = Second(archive, "one"), Second(archive, "other")
    assert unit.begin(force=1.7) == other.begin() == OK
    assert unit.step(0.0, 0.7) == OK
    kept, size = c.c_void_p(), c.c_size_t()
    assert unit.call("GetFMUstate", c.byref(kept)) == OK
    assert unit.step(0.7, 0.4) == OK
    once = unit.get("x", "v", "attempts")
    assert unit.call("SetFMUstate", kept) == OK
    assert unit.step(0.7, 0.4) == OK
    assert (unit.get("x", "v", "attempts") == once).all()
    assert unit.call("SerializedFMUstateSize", kept, c.byref(size)) == OK
    data = (c.c_char * size.value)()
    assert unit.call("SerializeFMUstate", kept, data, size) == OK
    assert unit.call("FreeFMUstate", c.byref(kept)) == OK
    assert kept.value is None
    assert other.call("DeSerializeFMUstate", data, size, c.byref(kept)) == OK
    assert other.call("SetFMUstate", kept) == OK
    assert other.step(0.7, 0.4) == OK
    assert (other.get("x", "v", "attempts") == once).all()
    data[0] = bytes([ord(data[0]) ^ 1])
    assert other.call("DeSerializeFMUstate", data, size, c.byref(kept)) == ERROR
    assert "state of this model" in other.said[-1][1]
    for one in (unit, other):
        one.free()


def test_instances_go_their_own_ways_and_reset(made):
    archive, _ = made("drive")
    one, two = Second(archive), Second(archive)
    assert one.begin(force=1.7) == two.begin(force=1.7, m=2.0) == OK
    for t in TIMES[:4]:
        assert one.step(t, 1 / 8) == two.step(t, 1 / 8) == OK
    first, second = one.get("v")[0], two.get("v")[0]
    assert first != second
    assert two.call("Reset") == OK
    assert two.get("m")[0] == one.get("m")[0]
    assert two.begin(force=1.7) == OK
    assert two.step(0.0, 0.5) == OK
    assert abs(two.get("v")[0] - first) < 1e-12
    one.free()
    two.free()


@pytest.mark.parametrize(
    ("t", "size", "message"),
    [(0.0, 0.0, "more than 0 s"), (0.0, -1.0, "more than 0 s"), (0.5, 0.1, "from t = 0 s on"),
     (0.0, float("nan"), "more than 0 s"), (0.0, 3.0, "beyond the stop time")],
)  # fmt: skip
def test_what_is_no_communication_step_is_refused_and_nothing_has_happened(made, t, size, message):
    archive, _ = made("drive")
    unit = Second(archive)
    assert unit.begin(stop=SPAN) == OK
    assert unit.step(t, size) == DISCARD
    assert message in unit.said[-1][1]
    assert unit.step(0.0, 0.1) == OK
    unit.free()


def test_what_cannot_be_set_is_refused_with_its_range(made):
    archive, _ = made("wire")
    unit = Second(archive)
    assert unit.begin() == OK
    assert unit.set(k=-1.0) == DISCARD
    assert "set k: expected a finite number from 0 to 50, got -1" in unit.said[-1][1]
    assert unit.set(f=float("nan")) == DISCARD
    assert unit.get("k", "f").tolist() == [3.0, 0.0]
    assert unit.set(x=1.0) == ERROR
    assert "start value" in unit.said[-1][1]
    unit.free()


def test_calls_out_of_order_and_foreign_descriptions_are_refused(made):
    archive, _ = made("wire")
    unit = Second(archive)
    assert unit.step(0.0, 0.1) == ERROR
    assert "before the initialisation" in unit.said[-1][1]
    assert unit.setup(rtol=1.0) == ERROR
    unit.free()
    assert not Second(archive, token="{other}").handle


def test_a_failure_says_when_which_equation_and_what_to_do(made):
    archive, _ = made("wire")
    unit = Second(archive)
    assert unit.begin(x=3.0, v=40.0, k=0.0) == OK
    # a terminal event comes first; without it the root of 6 - x would not be real
    assert unit.step(0.0, 1.0) == DISCARD
    assert unit.begin() == ERROR
    unit.free()
    unit = Second(archive)
    assert unit.begin(x=5.0, v=10.0, k=0.0) == OK  # beyond the end, which has no way back
    assert unit.step(0.0, 1.0) == ERROR
    assert "stopped at t = 0.0" in unit.said[-1][1]
    assert "equation" in unit.said[-1][1]
    assert 0.0 < unit.get("time")[0] < 0.2
    unit.free()
