"""Instructions, bytes, results and unit tests of C on Cortex-M cores under QEMU."""

import casadi as ca
import numpy as np
import pytest
from cortex import on_target

from symfric import BrownMcPhee, Dahl, LuGre, VelocityBased
from symfric.codegen import Block, generate, law_block
from symfric.compensation import compensator
from symfric.embedded import CORES, measure, wrong_on_target
from symfric.embedded.measure import day, regimes
from symfric.embedded.target import Absent, find_tools
from symfric.foundation.parameters import Variable
from symfric.foundation.programs import CompileError
from symfric.model import Output


def sum_of_squares(count: int) -> Block:
    """`count` multiplications and count - 1 additions."""
    inputs = tuple(Variable(f"x_{i}", "1", symbol=ca.SX.sym(f"x_{i}")) for i in range(count))
    total = ca.sumsqr(ca.vertcat(*(v.symbol for v in inputs)))
    return Block("squares", inputs=inputs, outputs={"y": Output(total, "1", "sum")})


@on_target
def test_instructions_are_counted_one_by_one():
    """Ten more terms are ten loads, multiplications and additions, or at most a little more."""
    ten, twenty = (measure(sum_of_squares(n), steps=100, guards=False) for n in (10, 20))
    assert 30.0 <= twenty.average - ten.average <= 60.0
    for found in (ten, twenty):  # no branches: every step costs the same, a whole number
        assert found.average == pytest.approx(found.maximum, abs=0.05)


@on_target
@pytest.mark.heavy
@pytest.mark.parametrize(
    "core", [c if c in ("m0plus", "m7") else pytest.param(c, marks=pytest.mark.slow) for c in CORES]
)
def test_every_core_agrees_with_the_host(core):
    found = measure(law_block(VelocityBased()), core=core, steps=100)
    assert found.ok
    assert found.error < 1e-6
    assert found.equal > 0.9
    assert found.text > 0
    assert found.stack > 0


@on_target
def test_double_has_the_bits_of_the_host():
    found = measure(law_block(Dahl()), "double", "m7", steps=100)
    assert (found.error, found.equal) == (0.0, 1.0)


@on_target
@pytest.mark.slow
def test_casadi_calls_functions_of_double():
    block = law_block(LuGre())
    own = measure(block, steps=100, guards=False)
    mapped, raw = (
        measure(block, by=by, steps=100) for by in ("casadi, functions of float", "casadi")
    )
    assert own.average < mapped.average < raw.average
    assert own.error < 1e-6
    assert own.data == 4 * (1 + len(block.parameters))
    assert own.error == pytest.approx(raw.error, rel=2.0)
    assert np.isnan(raw.equal)  # it has no program for the host here


def test_absent_tools_are_named(monkeypatch):
    found = measure(law_block(LuGre()), tools=Absent(("qemu-system-arm",)))
    assert not found.ok
    assert found.status.startswith("skipped: qemu-system-arm not found; on Debian")
    assert found.to_dict()["average"] is None
    monkeypatch.setenv("PATH", "")
    missing = find_tools()
    assert isinstance(missing, Absent)
    assert missing.names == ("arm-none-eabi-gcc", "newlib for arm-none-eabi", "qemu-system-arm")
    assert "gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm" in missing.advice


def test_the_measured_inputs_contain_jumps_of_the_load():
    v, N = day(law_block(LuGre()), 400).T
    assert (v == 0).sum() == 80
    assert N.max() / N.min() > 80
    assert (np.abs(N[1:] / N[:-1]) > 10).any()


def test_regimes_are_steady_motions_with_and_without_load():
    found = regimes(law_block(LuGre()))
    assert [*found] == ["rest", "creeping", "sliding", "no load"]
    v, N = np.array([rows[0] for rows in found.values()]).T
    assert v.tolist() == [0.0, 1e-3, 0.5, 0.5]
    assert (N > 0).tolist() == [True, True, True, False]
    servo = compensator(LuGre(), N=10.0)  # its load is a parameter, `enable` stays 1
    found = regimes(servo)
    assert [*found] == ["rest", "creeping", "sliding"]
    enable = [v.name for v in servo.inputs].index("enable")
    assert all((rows[:, enable] == 1.0).all() for rows in found.values())


@on_target
def test_sliding_costs_more_than_a_step_without_load():
    found = measure(law_block(LuGre()), steps=100)
    assert found.regimes["no load"] < found.regimes["sliding"] < found.maximum
    assert max(found.regimes.values()) <= found.maximum


@on_target
@pytest.mark.heavy
@pytest.mark.parametrize(
    ("real", "core"),
    [("float", "m4f"), ("double", "m3"),
     *(pytest.param(*pair, marks=pytest.mark.slow) for pair in (("float", "m0plus"),
                                                                ("double", "m7")))],
)  # fmt: skip
def test_a_kit_passes_its_own_test(real, core, tmp_path):
    assert wrong_on_target(generate(LuGre(), tmp_path, real=real), real, core) == 0


@on_target
@pytest.mark.heavy
def test_wrong_results_are_counted(tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float")
    file = made.source("float")
    text = file.read_text(encoding="utf-8")
    assert "SF_TANHF tanhf" in text
    file.write_text(text.replace("SF_TANHF tanhf", "SF_TANHF sinf"), encoding="utf-8")
    assert wrong_on_target(made) > 0


def test_absent_tools_and_types_are_named(tmp_path):
    made = generate(BrownMcPhee(), tmp_path, real="float")
    with pytest.raises(CompileError, match="qemu-system-arm not found"):
        wrong_on_target(made, tools=Absent(("qemu-system-arm",)))
    with pytest.raises(ValueError, match="embedded: real"):
        wrong_on_target(made, "double")
