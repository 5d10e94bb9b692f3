"""Units for co-simulation through their C interface: the bits of `simulate` at any step sizes."""

import ctypes as c

import numpy as np
import pytest
from backends import needs_compiler
from device_cases import WEDGES
from scipy.optimize import brentq
from units import DISCARD, ERROR, OK, Second, Third, over

from symfric import Hold, simulate
from symfric.codegen import plant_block
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.runner import run_vm
from symfric.emitter.c99 import DOUBLE

pytestmark = needs_compiler
RTOL, SPAN = 1e-9, 2.0
TIMES = np.arange(17) / 8
"""Times whose sums and differences are exact."""


def steps(unit, *ends, begin=0.0):
    """Make communication steps to each of the `ends`."""
    for end in ends:
        assert unit.step(begin, end - begin) == OK, unit.messages
        begin = end


def test_held_and_jumping_inputs_give_the_bits_of_simulate(opened):
    names = ["x", "v", "z", "friction"]
    unit, model = opened(Second, "drive", {"force": 1.7}, SPAN)
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"force": 1.7})
    assert (over(unit, TIMES, names) == np.array([same[n] for n in names]).T).all()
    force = 2.0 * np.sin(np.pi * TIMES)
    at = dict(zip(TIMES, force, strict=True))
    unit, _ = opened(Second, "drive", {})
    found = over(unit, TIMES, names, lambda t: {"force": at[t]})
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"force": Hold(TIMES, force)})
    assert (found[:, :2] == np.array([same["x"], same["v"]]).T).all()


def test_a_mechanism_has_the_bits_of_simulate_and_stops_at_its_end(opened):
    unit, model = opened(Third, "pendulum", {}, SPAN)
    same = simulate(model, SPAN, t_eval=TIMES[::2], rtol=RTOL)
    found = over(unit, TIMES[::2], list(model.signals))
    assert (found == np.array([same[n] for n in model.signals]).T).all()
    assert unit.reached.value == SPAN
    assert not any(flag.value for flag in unit.flags)
    assert unit.step(SPAN, 0.5) == DISCARD


@pytest.mark.heavy
def test_a_mechanism_with_loops_closes_them_at_the_given_start(opened):
    unit, model = opened(Third, "loop", {"crank": 1.1})
    times, names = np.arange(5) / 8, [v.name for v in model.x]
    same = simulate(model, 0.5, x0={"crank": 1.1}, t_eval=times, rtol=RTOL)
    for column, name in zip(over(unit, times, names).T, names, strict=True):
        assert np.abs(column - same[name]).max() <= 10 * RTOL * np.abs(same[name]).max()


def test_tiny_and_odd_communication_steps_cost_no_attempts(opened):
    ends, counts = [], []
    for times in (TIMES, np.linspace(0.0, SPAN, 1025), np.cumsum([0.0, 0.313, 1e-12, 0.7, 0.987])):
        unit, _ = opened(Second, "drive", {"force": 1.7})
        ends.append(over(unit, times, ["x", "v"])[-1])
        counts.append(unit.get("attempts")[0])
    assert max(counts[1:]) <= counts[0] + 1
    assert np.abs(ends[1] - ends[0]).max() < 1e-12


def test_an_input_that_jumps_at_every_point_costs_one_attempt_a_step(opened):
    unit, _ = opened(Second, "drive", {})
    spent = [0.0]
    for t in np.arange(128) / 128:
        assert unit.set(force=1.2 + 1e-3 * t) == OK
        steps(unit, t + 1 / 128, begin=t)
        spent.append(unit.get("attempts")[0])
    assert np.median(np.diff(spent)) == 1.0


def test_algebraic_variables_follow_inputs_and_events_occur_as_in_simulate(opened):
    unit, model = opened(Second, "wire", {"f": 0.3})
    assert unit.set(f=1.3) == OK
    z, x, k, f = unit.get("z", "x", "k", "f")
    assert abs(np.arctan(z) + 0.1 * z - k * x / (4.0 + f * f)) < 1e-14  # before any step
    held = np.where(TIMES < 1.0, 0.3, -0.5)
    at = dict(zip(TIMES, held, strict=True))
    found = over(unit, TIMES, ["x", "v"], lambda t: {"f": at[t]})
    same = simulate(model, SPAN, t_eval=TIMES, rtol=RTOL, u={"f": Hold(TIMES, held)})
    assert {name for _, name in same.happened} == {"floor"}
    for column, name in zip(found.T, ("x", "v"), strict=True):
        assert np.abs(column - same[name]).max() <= 10 * RTOL * np.abs(same[name]).max()


def test_a_terminal_event_ends_the_run_and_is_reported(opened):
    unit, model = opened(Second, "wire", {"f": 9.0})
    same = simulate(model, SPAN, rtol=RTOL, u={"f": 9.0})
    assert unit.step(0.0, 2.0) == DISCARD
    ended, reached = c.c_int(), c.c_double()
    assert unit.call("GetBooleanStatus", 3, c.byref(ended)) == OK
    assert unit.call("GetRealStatus", 2, c.byref(reached)) == OK
    assert ended.value == 1
    assert abs(reached.value - same.happened[-1][0]) < 1e-9
    assert "terminal event end" in unit.messages[-1][1]


class Early(Third):
    """An instance whose communication steps may end at events."""

    def __init__(self, archive):
        super().__init__(archive, early=True)


@pytest.mark.parametrize("size", [0.01, 0.3, 2.0])
def test_events_end_communication_steps_early_where_that_is_allowed(opened, size):
    unit, model = opened(Early, "wire", {"f": 0.3})
    same = simulate(model, 6.0, rtol=RTOL, u={"f": 0.3})
    assert len(same.happened) == 2
    t, found = 0.0, []
    while t < 6.0:
        wanted = min(size, 6.0 - t)
        assert unit.step(t, wanted) == OK, unit.messages
        event, over, early = (flag.value for flag in unit.flags)
        assert not (event or over) and early == (unit.reached.value < t + wanted)
        t = unit.reached.value
        found += [(t, *unit.get("x", "v"))] * early
    times = np.array([at for at, _ in same.happened])
    assert np.abs(np.array(found)[:, 0] - times).max() < 1e-8 and len(found) == times.size
    assert same.at(times)["x"] == pytest.approx(np.array(found)[:, 1], abs=1e-7)
    whole, _ = opened(Third, "wire", {"f": 0.3})
    steps(whole, 6.0)
    assert whole.reached.value == 6.0 and not whole.flags[2].value
    assert unit.get("x", "v") == pytest.approx(whole.get("x", "v"), rel=1e-7)


def test_start_values_and_tuned_parameters_act_as_in_simulate(opened):
    unit, model = opened(Second, "drive", {"v": 0.3, "mu_s": 0.2})
    same = simulate(model, SPAN, x0={"v": 0.3}, p={"mu_s": 0.2}, t_eval=TIMES, rtol=RTOL)
    found = over(unit, TIMES, ["v", "z"])
    assert found[0, 1] == same["z"][0] != 0.0
    assert np.abs(found[:, 0] - same["v"]).max() <= RTOL
    unit, _ = opened(Second, "drive", {"force": 1.7})
    steps(unit, 1.03)
    x0 = dict(zip(("x", "v", "z"), unit.get("x", "v", "z"), strict=True))
    assert unit.set(m=2.0) == OK
    steps(unit, 1.53, begin=1.03)
    same = simulate(model, 0.5, x0=x0, p={"m": 2.0}, u={"force": 1.7}, rtol=RTOL)
    assert unit.get("v")[0] == pytest.approx(same.final["v"], rel=10 * RTOL)


def test_states_of_a_unit_are_stored_restored_and_serialised(opened):
    (unit, _), (other, _) = (opened(Second, "drive", start) for start in ({"force": 1.7}, {}))
    steps(unit, 0.7)
    kept, size = c.c_void_p(), c.c_size_t()
    assert unit.call("GetFMUstate", c.byref(kept)) == OK
    steps(unit, 1.1, begin=0.7)
    once = unit.get("x", "v", "attempts").tolist()
    assert unit.call("SetFMUstate", kept) == OK
    steps(unit, 1.1, begin=0.7)
    assert unit.get("x", "v", "attempts").tolist() == once
    assert unit.call("SerializedFMUstateSize", kept, c.byref(size)) == OK
    data = (c.c_char * size.value)()
    assert unit.call("SerializeFMUstate", kept, data, size) == OK
    assert unit.call("FreeFMUstate", c.byref(kept)) == OK
    assert kept.value is None
    assert other.call("DeSerializeFMUstate", data, size, c.byref(kept)) == OK
    assert other.call("SetFMUstate", kept) == OK
    steps(other, 1.1, begin=0.7)
    assert other.get("x", "v", "attempts").tolist() == once
    foreign, _ = opened(Second, "wire", {})
    assert foreign.call("SetFMUstate", kept) == ERROR  # the state of another model
    data[0] = bytes([ord(data[0]) ^ 1])
    assert other.call("DeSerializeFMUstate", data, size, c.byref(kept)) == ERROR
    assert "state of this model" in other.messages[-1][1]


def test_instances_are_independent_and_can_be_reset(opened):
    (one, _), (two, _) = (opened(Second, "drive", {"force": 1.7, "m": m}) for m in (0.8, 2.0))
    for unit in (one, two):
        steps(unit, *TIMES[1:5])
    first, mass = one.get("v", "m")
    assert two.get("v")[0] != first
    assert two.call("Reset") == OK
    assert two.get("m")[0] == mass
    assert two.begin(force=1.7) == OK
    steps(two, 0.5)
    assert abs(two.get("v")[0] - first) < 1e-12


@pytest.mark.parametrize(
    ("t", "size", "message"),
    [(0.0, 0.0, "more than 0 s"), (0.0, -1.0, "more than 0 s"), (0.5, 0.1, "from t = 0 s on"),
     (0.0, float("nan"), "more than 0 s"), (0.0, 3.0, "beyond the stop time")],
)  # fmt: skip
def test_invalid_communication_steps_are_refused_without_effect(opened, t, size, message):
    unit, _ = opened(Second, "drive", {}, SPAN)
    assert unit.step(t, size) == DISCARD
    assert message in unit.messages[-1][1]
    steps(unit, 0.1)


def test_lengths_and_start_values_are_fixed_after_the_initialisation(opened):
    unit, _ = opened(Second, "loop", {"r": 0.06})
    assert unit.set(m_slider=1.5, r=0.06) == OK
    for name in ("r", "omega"):
        assert unit.set(**{name: 0.07}) == DISCARD
        assert f"set {name}: expected a value before the end of the init" in unit.messages[-1][1]
    assert unit.get("r", "m_slider").tolist() == [0.06, 1.5]


def test_invalid_values_and_calls_out_of_order_are_refused(opened, exported):
    unit, _ = opened(Second, "wire")
    assert unit.step(0.0, 0.1) == ERROR
    assert "before the initialisation" in unit.messages[-1][1]
    assert unit.setup(rtol=1.0) == ERROR
    assert unit.begin() == OK
    assert unit.set(k=-1.0) == DISCARD
    assert "set k: expected a finite number from 0 to 50, got -1" in unit.messages[-1][1]
    assert unit.set(f=float("nan")) == DISCARD
    assert unit.get("k", "f").tolist() == [3.0, 0.0]
    assert unit.set(x=1.0) == ERROR
    assert "start value" in unit.messages[-1][1]
    assert not Second(exported("wire", 2)[0], token="{other}").handle


def test_a_failure_is_reported_with_its_time_and_equation(opened):
    unit, _ = opened(Second, "wire", {"x": 3.0, "v": 40.0, "k": 0.0})
    assert unit.step(0.0, 1.0) == DISCARD  # the terminal event precedes the imaginary root of 6 - x
    assert unit.begin() == ERROR
    unit, _ = opened(Second, "wire", {"x": 5.0, "v": 10.0, "k": 0.0})  # beyond the terminal event
    assert unit.step(0.0, 1.0) == ERROR
    assert "stopped at t = 0.0" in unit.messages[-1][1]
    assert "equation" in unit.messages[-1][1]
    assert 0.0 < unit.get("time")[0] < 0.2


def test_a_jump_of_an_input_across_an_event_triggers_it_once(opened):
    """Events that steps beyond that point have found are discarded: the gate has only risen."""
    unit, _ = opened(Second, "gate", {})
    steps(unit, *TIMES[1:5])
    assert unit.set(u=0.2) == OK
    steps(unit, *TIMES[5:7], begin=0.5)
    assert unit.get("begun", "at", "falls", "caught") == pytest.approx([1, 0.5, 0, 0], abs=1e-12)
    assert unit.set(u=0.75 + 1e-9) == OK  # a nanosecond later
    steps(unit, 0.875, begin=0.75)
    assert unit.get("caught")[0] == 1.0


def test_a_terminal_event_beyond_the_communication_point_is_not_reported_yet(opened):
    unit, _ = opened(Third, "gate", {})
    for k in range(7):
        steps(unit, (k + 1) / 8, begin=k / 8)
        assert not any(flag.value for flag in unit.flags)
        assert unit.reached.value == (k + 1) / 8
    steps(unit, 9 / 8, begin=7 / 8)
    assert [flag.value for flag in unit.flags] == [False, True, True]
    assert unit.reached.value == pytest.approx(1.0, abs=1e-9)


def test_a_terminated_unit_does_not_continue_and_events_limit_the_tolerance(opened):
    unit, _ = opened(Second, "gate")
    assert unit.setup(rtol=1e-2) == OK
    assert unit.get("rtol")[0] == 1e-5
    unit, _ = opened(Second, "gate", {})
    steps(unit, 0.25)
    assert unit.call("Terminate") == OK
    assert unit.step(0.25, 0.25) == DISCARD
    assert unit.get("time", "x") == pytest.approx([0.25, 0.25], abs=1e-12)
    assert unit.set(u=1.0) == ERROR


def test_a_start_value_counts_after_others_have_been_read(opened):
    unit, _ = opened(Second, "wire")
    assert unit.setup() == unit.call("EnterInitializationMode") == OK
    first = unit.get("z")[0]
    assert unit.set(x=2.0) == OK
    assert unit.get("x", "v").tolist() == [2.0, 0.0]
    assert unit.get("z")[0] > first
    assert unit.call("ExitInitializationMode") == OK


def test_algebraic_variables_are_found_from_distant_guesses(opened):
    unit, _ = opened(Second, "wire")
    for k, x in ((0.0, 1.0), (5.0, 2.0), (50.0, 3.9), (0.2, 0.01)):
        wanted = brentq(lambda z, k=k, x=x: np.arctan(z) + 0.1 * z - k * x / 4.0, -1e3, 1e3)
        for guess in (0.5, 470.0, -470.0):
            assert unit.call("Reset") == OK
            assert unit.begin(k=k, x=x, z=guess) == OK
            assert unit.get("z")[0] == pytest.approx(wanted, abs=1e-10)
    unit, _ = opened(Second, "wire", {"k": 50.0, "x": 3.9})
    assert unit.get("z")[0] > 400.0
    assert unit.set(k=0.0) == OK  # undamped, Newton's method alternates between -13.4 and 13.4
    assert unit.get("z")[0] == pytest.approx(0.0, abs=1e-10)


def test_signals_without_a_solution_are_refused_until_there_is_one(opened):
    """z^2 = 1 - u."""
    unit, _ = opened(Second, "root", {})
    assert unit.set(u=0.75) == OK
    assert unit.get("z")[0] == pytest.approx(0.5)
    assert unit.set(u=2.0) == OK
    reference, number = (c.c_uint * 1)(unit.archive.reference["z"]), (c.c_double * 1)()
    assert unit.call("GetReal", reference, c.c_size_t(1), number) == ERROR
    assert "no solution" in unit.messages[-1][1]
    assert unit.set(u=0.0) == OK
    assert unit.get("z")[0] == pytest.approx(1.0)
    steps(unit, 0.1)


def test_a_start_at_which_friction_jams_is_refused(opened):
    for slope, wanted in zip(WEDGES, (OK, ERROR), strict=True):
        unit, _ = opened(Third, "wedge")
        found = unit.begin(x=0.0, phi=float(np.arctan(slope)), x_rate=1.0, phi_rate=0.0)
        assert found == wanted, unit.messages
        assert wanted == OK or "friction jams" in unit.messages[-1]


def test_fixed_steps_are_those_of_the_plant(opened):
    unit, model = opened(Third, "drive", {"force": 1.7}, step=1e-3)
    found = over(unit, np.arange(33) / 32, ["x", "v", "attempts"])
    block = plant_block(model, h=1 / 1024, name="plant")
    same = run_vm(CBlock(block, DOUBLE), np.full((1024, 1), 1.7))[31::32]
    names = [s.name for s in block.states]
    assert found[-1, 2] == 1024  # 1/32 s in 32 equal steps of at most 1 ms
    assert np.abs(found[1:, :2] - same[:, [names.index(n) for n in ("x", "v")]]).max() <= 1e-13
    steps(unit, 1.3, begin=1.0)
    before = unit.get("attempts")[0]
    steps(unit, 1.4, begin=1.3)  # 1.4 - 1.3 is slightly more than 0.1
    assert unit.get("attempts")[0] == before + 100


def test_all_calls_of_the_standard_exist_and_unsupported_ones_fail(opened):
    unit, _ = opened(Third, "drive", step=1e-3)
    one, number, flag, none = (c.c_uint32 * 1)(0), (c.c_int32 * 1)(), c.c_size_t(1), c.c_size_t(0)
    assert unit.call("GetInt32", one, flag, number, flag) == ERROR
    assert unit.call("GetInt32", one, none, number, none) == OK
    assert unit.call("EnterEventMode") == ERROR
    assert not unit.library.fmi3InstantiateModelExchange(None, None, None, 0, 0, None, None)
    assert unit.call("GetClock", one, flag, number) == ERROR
