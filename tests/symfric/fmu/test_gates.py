"""Units of a model whose events have closed forms: where they are found, once each, and its end."""

import ctypes as c

import casadi as ca
import numpy as np
import pytest
from backends import needs_compiler
from device_cases import WEDGES, wedge
from scipy.optimize import brentq
from units import DISCARD, ERROR, OK, Archive, Second, Third
from wires import wire

from symfric.fmu import export_fmu
from symfric.foundation.parameters import Variable
from symfric.model import Event, Model

pytestmark = needs_compiler


def gate() -> Model:
    """A point at 1 m/s that passes gates: which and where. The last one ends it."""
    x, u = Variable("x", "m"), Variable("u", "m", start=9.0)
    begun, at, falls, caught = (Variable(n, "m") for n in ("begun", "at", "falls", "caught"))
    return Model(
        "gate",
        x=(x, begun, at, falls, caught),
        u=(u,),
        ode=ca.vertcat(1.0, 0.0, 0.0, 0.0, 0.0),
        events=(
            Event("begin", x.symbol + 1.0, 1, reset={"begun": begun.symbol + 1}, at_start=True),
            Event("moved", x.symbol - u.symbol, 1, reset={"at": x.symbol}, rtol=1e-5),
            Event("fall", x.symbol - 0.6, -1, reset={"falls": falls.symbol + 1}),
            Event("catch", u.symbol - x.symbol, 1, reset={"caught": caught.symbol + 1}),
            Event("end", x.symbol - 1.0, 1, terminal=True),
        ),
    )


def root() -> Model:
    """An algebraic variable that an input takes away."""
    x, z, u = Variable("x", "m"), Variable("z", "1", start=1.0), Variable("u", "1")
    equation = z.symbol**2 + u.symbol - 1.0
    return Model("root", x=(x,), z=(z,), u=(u,), ode=-x.symbol, alg=equation)


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """Archives by the name of the model and the version, exported once."""
    known, models = {}, {"gate": gate, "wire": wire, "wedge": wedge, "root": root}

    def make(name: str, fmi: int) -> Archive:
        if (name, fmi) not in known:
            folder = tmp_path_factory.mktemp(name)
            unit = export_fmu(models[name](), folder / "unit.fmu", fmi=fmi, t_end=2.0)
            known[name, fmi] = Archive(unit.path, folder / "open")
        return known[name, fmi]

    return make


def test_an_input_that_jumps_over_an_event_lets_it_happen_there(archives):
    """Also what the steps beyond that point have seen is forgotten: the gate has only risen."""
    unit = Second(archives("gate", 2))
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


def test_an_end_beyond_the_communication_point_is_none_yet(archives):
    unit = Third(archives("gate", 3))
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


def test_what_has_been_terminated_does_not_go_on(archives):
    unit = Second(archives("gate", 2))
    assert unit.begin() == OK
    assert unit.step(0.0, 0.25) == OK
    assert unit.call("Terminate") == OK
    assert unit.step(0.25, 0.25) == DISCARD
    assert unit.get("time", "x") == pytest.approx([0.25, 0.25], abs=1e-12)
    assert unit.set(u=1.0) == ERROR
    unit.free()


def test_a_tolerance_is_no_larger_than_events_want_it(archives):
    unit = Second(archives("gate", 2))
    assert unit.setup(rtol=1e-2) == OK
    assert unit.get("rtol")[0] == 1e-5
    unit.free()


def test_a_start_value_counts_though_others_were_looked_at_before(archives):
    unit = Second(archives("wire", 2))
    assert unit.setup() == OK
    assert unit.call("EnterInitializationMode") == OK
    first = unit.get("z")[0]
    assert unit.set(x=2.0) == OK
    assert unit.get("x", "v").tolist() == [2.0, 0.0]
    assert unit.get("z")[0] > first
    assert unit.call("ExitInitializationMode") == OK
    unit.free()


def test_the_state_of_another_model_is_refused(archives):
    unit, other = Second(archives("wire", 2)), Second(archives("gate", 2))
    assert unit.begin() == other.begin() == OK
    kept = c.c_void_p()
    assert unit.call("GetFMUstate", c.byref(kept)) == OK
    assert other.call("SetFMUstate", kept) == ERROR
    assert unit.call("FreeFMUstate", c.byref(kept)) == OK
    for one in (unit, other):
        one.free()


@pytest.mark.parametrize(("k", "x"), [(0.0, 1.0), (5.0, 2.0), (50.0, 3.9), (0.2, 0.01)])
def test_algebraic_variables_are_found_from_far_away(archives, k, x):
    unit = Second(archives("wire", 2))
    for guess in (0.5, 470.0, -470.0):
        assert unit.call("Reset") == OK
        assert unit.begin(k=k, x=x, z=guess) == OK
        wanted = brentq(lambda z: np.arctan(z) + 0.1 * z - k * x / 4.0, -1e3, 1e3, xtol=1e-13)
        assert unit.get("z")[0] == pytest.approx(wanted, abs=1e-10)
    unit.free()


def test_algebraic_variables_follow_a_parameter_that_falls_to_zero(archives):
    """From 470: undamped, Newton's method goes to and fro between -13.4 and 13.4."""
    unit = Second(archives("wire", 2))
    assert unit.begin(k=50.0, x=3.9) == OK
    assert unit.get("z")[0] > 400.0
    assert unit.set(k=0.0) == OK
    assert unit.get("z")[0] == pytest.approx(0.0, abs=1e-10)
    unit.free()


def test_signals_without_a_solution_are_refused_and_come_back(archives):
    """z^2 = 1 - u: the step would say so, and what is read before it does, too."""
    unit = Second(archives("root", 2))
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


def test_a_start_at_which_friction_jams_is_refused(archives):
    for slope, wanted in zip(WEDGES, (OK, ERROR), strict=True):
        unit = Third(archives("wedge", 3))
        found = unit.begin(x=0.0, phi=float(np.arctan(slope)), x_rate=1.0, phi_rate=0.0)
        assert found == wanted, unit.said
        assert wanted == OK or "friction jams" in unit.said[-1]
        unit.free()
