"""Verification finds errors of C; rounding and ties are no errors."""

import json
from math import erf, remainder

import casadi as ca
import numpy as np
import pytest
from one_program import block_of
from tables import Names, table

from symfric import BrownMcPhee, LuGre, Model, Output, Stribeck, Variable, law_from_text
from symfric.codegen import Block, generate, guards, law_block, plant_block, verify
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.compared import ComparedRun, magnitudes, modes, rounded, terms, ulp
from symfric.codegen.runner import in_type, run_vm
from symfric.codegen.verification import excitation, longest_step, runs_away, spoiled, varied
from symfric.compensation import (
    compensator,
    gms_observer,
)
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.laws import GMS
from symfric.model.kinds import CONSTRAINTS

LUGRE = block_of(LuGre())


@pytest.fixture(autouse=True)
def few_steps(monkeypatch):
    for name, steps in {"STEPS": 600, "FEWER": 300}.items():
        monkeypatch.setattr(f"symfric.codegen.verification.{name}", steps)


LAWS = {"stribeck": Stribeck(), "lugre": LuGre(), "brown_mcphee": BrownMcPhee()}
TABLE = table(__file__)


@pytest.mark.parametrize("name", TABLE["wrong"])
def test_wrong_c_is_found(name, compiler, tmp_path):
    law, real, old, new, why = TABLE["wrong"][name]
    made = generate(
        LAWS[law], tmp_path, real=real, free=() if law == "stribeck" else None, kit=False
    )
    file = made.source(real)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    found = verify(made)
    (check,) = found.checks
    if name == "foreign" and check.foreign is None:
        pytest.skip("no nm on this machine")
    assert not found.ok
    assert found.status.startswith(f"failed in {real}: ")
    assert why in found.status
    assert (check.worst or "-") in found.table()
    if name == "last bit":
        assert 1 <= check.ulp < 10
    if name == "NaN":
        assert check.error == np.inf


def test_without_a_compiler_or_an_object_nothing_is_verified(compiler, tmp_path, monkeypatch):
    made = generate(LuGre(), tmp_path, kit=False, real="double")
    with pytest.raises(ValueError, match="got 'no-such-compiler'"):
        verify(made, compiler="no-such-compiler")
    file = made.source("double")
    file.write_text(file.read_text().replace("const double", "konst double"))
    found = verify(made)
    assert found.status.startswith("not verified: ")
    assert "konst" in found.status
    monkeypatch.setenv("CC", "/no/such")
    assert "$CC is '/no/such', which does not exist" in verify(made).status
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    found = verify(made)
    assert (found.ok, found.checks) == (False, ())
    none = "no C compiler found; install gcc or clang, or set CC"
    assert found.table() == f"lugre: not verified: {none}"


def test_verification_results_convert_to_json_and_a_table(compiler, tmp_path):
    found = verify(generate(law_from_text("coulomb+viscous"), tmp_path, kit=False))
    content = json.loads(json.dumps(found.to_dict()))
    assert content["ok"] is True
    assert [check["real"] for check in content["checks"]] == ["double", "float"]
    assert content["checks"][0]["ulp"] == 0
    table = found.table().splitlines()
    assert table[0] == f"coulomb_viscous: verified ({found.compiler})"
    assert table[2].split()[:4] == ["double", "1200", "0", "equal"]
    assert len(table) == 4


def test_inputs_are_of_every_kind():
    v, N = excitation(LUGRE, 20_000).T
    for kind in (v == 0, np.abs(v) >= 1.5, (v != 0) & (np.abs(v) < 1e-6), N == 0):
        assert kind.sum() > 100
    assert (v[1:] * v[:-1] < 0).sum() > 1000
    jumps = N[1:] / np.where(N[:-1] > 0, N[:-1], np.inf)
    assert min((jumps > 10).sum(), ((jumps > 0) & (jumps < 0.1)).sum()) > 10
    bad = spoiled(LUGRE, excitation(LUGRE, 4000))
    for kind in (np.isnan(bad), np.isinf(bad), np.abs(bad) > 1e8, bad < 0):
        assert (kind.sum(axis=0) > 5).all()
    values = dict(zip([v.name for v in LUGRE.parameters], varied(LUGRE, 4000, 10.0).T, strict=True))
    assert 1e-5 <= values["h"].min() < 3e-5
    assert 3e-3 < values["h"].max() <= 1e-2
    assert len(np.unique(values["mu_s"])) == 40
    assert values["mu_s"] == pytest.approx(0.15, rel=0.21)


A, B = Variable("a", "1"), Variable("b", "1")
LARGE = 1e6
LEFT = (A.symbol + B.symbol) - LARGE
"""Its value is 2 for a = 2 and b = 1e6."""


def test_a_difference_has_the_magnitude_of_its_larger_term():
    names, none = Names(globals()), np.zeros((1, 0))
    for expression, closing, wanted in TABLE["magnitudes"]:
        y = Output(names.value(expression), "1", kind=CONSTRAINTS if closing else "")
        block = Block("b", inputs=(A, B), outputs={"y": y})
        found = magnitudes(block, none, none[0], np.array([[2.0, LARGE]]))
        assert float(found[0]) == pytest.approx(names.value(wanted)), expression
    assert terms(block) is terms(block)


def test_last_places_are_counted_across_zero_and_states_have_their_nominal_value():
    tiny = 5e-324
    for a, b, wanted in (
        (0.0, -0.0, 0), (tiny, -tiny, 2), (1.0, np.nextafter(1.0, 2.0), 1),
        (-1.0, np.nextafter(-1.0, 0.0), 1), (1.0, 2.0, 2**52),
    ):  # fmt: skip
        assert ulp(np.array([a]), np.array([b])) == wanted
        assert ulp(np.array([b]), np.array([a])) == wanted
    assert ulp(np.array([1.0]), np.array([-1.0])) > 2**62
    assert ulp(np.array([np.inf]), np.array([np.inf])) == np.iinfo(np.int64).max
    x = Variable("x", "m", nominal=5.0)
    block = Block("b", states=(x,), next=1e-3 * x.symbol)
    assert magnitudes(block, np.ones((3, 1)), np.zeros(0), np.zeros((3, 0))).tolist() == [5.0]


def in_float(block: Block, inputs: np.ndarray, change: dict | None = None) -> ComparedRun:
    """Run of a block without states in float, with operations rounded, and some changed results."""
    c = CBlock(block, FLOAT, guards=False)
    inputs = FLOAT.rounded(inputs)
    p = np.zeros((len(inputs), 0), "f4")
    rows = in_type(block.step, [p, p, inputs.astype("f4")], "f4")
    for place, value in (change or {}).items():
        rows[place] = value
    return ComparedRun(c, inputs, None, rows, run_vm(c, inputs))


def test_the_worst_signal_is_the_one_with_the_largest_error_relative_to_its_magnitude():
    outputs = {"large": Output(1e3 * A.symbol, "1"), "small": Output(A.symbol**2 - 1.0, "1")}
    c, inputs = CBlock(Block("pair", inputs=(A,), outputs=outputs), FLOAT), np.array([[3.0], [1.1]])
    expected = run_vm(c, inputs)
    rows = expected + np.array([[0.0] * 3, [1e-2, 1e-3, 0.0]])
    run = ComparedRun(c, inputs, None, rows, expected)
    assert run.worst == "small"
    assert run.error == pytest.approx(1e-3 / 9.0)  # of 3 squared
    assert 0.0 < run.rounding < 1e-7


def test_rounding_is_distinguished_from_a_wrong_formula(compiler, tmp_path):
    """A belt at 1 m/s and a contact that changes over 1 um/s: the last bit of v is 0.06 of it."""
    v, N = Variable("v", "m/s"), Variable("N", "N", lower=0.0, upper=10.0)
    x = Variable("x", "m/s", start=1.0)
    moved = x.symbol + 1e-7 * ca.sin(1e3 * v.symbol)
    block = Block(
        "belt", states=(x,), inputs=(v, N), next=moved,
        outputs={"F": Output(N.symbol * ca.tanh((moved - 1.0) / 1e-6), "N")},
    )  # fmt: skip
    found = verify(generate(block, tmp_path, real="float", kit=False))
    assert found.status.startswith("failed in float: F is off by ")
    assert ", by rounding: float moves it by " in found.status


def test_operations_are_rounded_to_either_neighbour_unless_exact():
    x = ca.SX.sym("x", 2)
    both = ca.Function("f", [x], [ca.vertcat(x[0] * x[1], x[0] + x[1])])
    rows = np.tile(np.array([0.1, 0.125], "f4"), (1000, 1))
    found = in_type(both, [rows], "f4", np.random.default_rng(0))
    assert (found[:, 0] == rows[0, 0].astype(float) * 0.125).all()  # by a power of two
    sides = np.unique(found[:, 1])
    assert sides[0] < float(rows[0, 0]) + 0.125 < sides[1]
    assert np.nextafter(np.float32(sides[0]), np.float32(1)) == sides[1]
    assert 400 < (found[:, 1] == sides[0]).sum() < 600
    p = np.array([[v.start for v in LUGRE.parameters]] * 2)
    rest = np.array([[0.0, 1.0], [1e-3, 1.0]])
    spread = np.ptp(rounded(LUGRE, np.zeros((2, 1)), p, rest), axis=0).max(axis=1)
    assert spread[0] == 0.0 < spread[1] < 1e-6  # nothing is rounded at rest
    own = ca.Function("f", [x], [ca.vertcat(ca.erf(x[0]), ca.remainder(x[0], x[1]))])
    rows = np.array([[0.7, 0.5], [1.3, 0.5], [1.0, 0.0], [np.inf, 1.0]], "f4")
    wanted = [[np.float32(erf(float(a))), remainder(a, b) if b and a < 9 else np.nan]
              for a, b in rows.tolist()]  # fmt: skip
    np.testing.assert_array_equal(in_type(own, [rows], "f4"), wanted)


def copies() -> Block:
    """q copies r, and r copies the input: neither is a mode, although a decision selects q."""
    q, r, v = Variable("q", "1"), Variable("r", "1"), Variable("v", "m/s")
    taken = ca.if_else(v.symbol > 0, r.symbol, q.symbol)
    return Block("copies", states=(q, r), inputs=(v,), next=ca.vertcat(taken, v.symbol))


PULLS = ["p_1", "p_2", "p_3", "p_4"]


@pytest.mark.parametrize(
    ("block", "wanted"),
    [
        (LUGRE, []), (copies(), []),
        (law_block(GMS(form="event")), PULLS),
        (gms_observer(GMS(form="event", mu_s=6.0, mu_d=4.0), 20.0), PULLS),
        (compensator(LuGre(), hold=(1e-5, 1e-3)), ["hold"]),
    ],
)  # fmt: skip
def test_modes_are_determined_by_decisions_alone(block, wanted):
    names = CBlock(block, DOUBLE, guards=False).signals
    found = [n for n, mode in zip(names, modes(block), strict=True) if mode]
    assert found == wanted + [f"{reset}.{n}" for reset in block.resets for n in wanted]


def tie(lowest: float = -2.0) -> Block:
    """3 a - 2 a = a is exact in double; in float 3 a is rounded."""
    left = (3.0 * A.symbol - A.symbol) - A.symbol - A.symbol
    outputs = {"mode": Output((left <= 0.0) * (A.symbol >= lowest), "1"),
               "F": Output(2.0 * A.symbol, "N")}  # fmt: skip
    return Block("tie", inputs=(A,), outputs=outputs)


def test_a_mode_that_ties_is_counted_and_a_wrong_mode_or_force_is_an_error(compiler, tmp_path):
    inputs = np.zeros((1000, 1))
    inputs[:6, 0] = np.linspace(0.1, 0.7, 6)
    run = in_float(tie(), inputs)
    count = int(run.tied.sum())
    assert 0 < count < 6
    assert run.error == 0.0
    row = int(np.argmax(run.tied[:, 0]))
    for place, value, worst in (
        ((500, 0), 0.0, "mode"),
        ((row, 0), 0.5, "mode"),
        ((row, 1), 0.0, "F"),
    ):
        wrong = in_float(tie(), inputs, {place: value})
        assert wrong.error > 0.1
        assert wrong.worst == worst
    many = in_float(tie(), np.random.default_rng(0).uniform(size=(1000, 1)))
    assert many.error == 1.0  # more than one step in a hundred differs
    assert not many.tied.any()
    found = verify(generate(tie(1.9), tmp_path, kit=False, real="float"))
    (check,) = found.checks
    assert found.ok, found.table()
    assert 0 < check.ties < 20
    head, row = (line.split() for line in found.table().splitlines()[1:])
    assert row[head.index("ties")] == str(check.ties)


X = Variable("x", "m", start=1.0, nominal=2.0)


def decay(h: float | None = None) -> Block:
    """x' = -1000 x by an explicit method, which is stable up to h = 3.3 ms."""
    return plant_block(Model("decay", x=(X,), ode=-1000 * X.symbol), h=h, method="dopri5")


def test_a_step_that_is_too_long_is_found_with_a_shorter_one(compiler, tmp_path):
    c = CBlock(decay(), DOUBLE, guards=False)
    assert runs_away(c, np.full((5, 1), 1.9e10)) is None
    for lost in (np.nan, np.inf, -2.1e10):
        assert runs_away(c, np.array([[1.0], [1.0], [lost], [lost]])) == 3
    status = np.column_stack([np.ones(3), [0, guards.Status.CLAMPED, guards.Status.OUTPUT]])
    assert runs_away(CBlock(decay(), DOUBLE), status) == 3
    for below in (4e-3, 0.02, 0.01):
        assert longest_step(decay(), np.zeros((200, 0)), below) == 2e-3
    growing = plant_block(Model("grow", x=(X,), ode=2e3 * X.symbol))
    for block, steps in ((growing, 20_000), (decay(1e-3), 200)):
        assert longest_step(block, np.zeros((steps, 0)), 1e-3) is None
    made = generate(decay(4e-3), tmp_path, real="double", kit=False)
    found = verify(made, adjustable=decay)
    assert not found.ok
    assert found.status.startswith("failed: after ")
    assert "steps of 0.004 s it runs away, in CasADi as in C: that step is too long" in found.status
    assert found.status.endswith(", 0.002 s is not")
    stable = "try a shorter one, or the method backward_euler, which is the most robust"
    assert verify(made).status.endswith(stable)
    eager = Block("eager", states=(X,), next=3.0 * X.symbol)
    found = verify(generate(eager, tmp_path, real="double", kit=False))
    assert "it runs away within" in found.status
