"""Guards of single numbers, also under -ffast-math; runs of blocks of every shape."""

import casadi as ca
import numpy as np
import pytest
from one_program import OneProgram
from tables import Names, table

from symfric import Output, Variable
from symfric.codegen import Block, generate, runner
from symfric.codegen.blocks.block import CBlock
from symfric.codegen.blocks.variables import arranged
from symfric.codegen.guards import Status, parameter_range, range_of, state_limit
from symfric.codegen.runner import compile_object, compiled, needed_symbols, run_c, run_vm
from symfric.emitter.c99 import DOUBLE
from symfric.foundation.programs import CompileError


def test_ranges_are_the_bounds_or_a_million_times_the_nominal_value() -> None:
    load = range_of(Variable("N", "N", nominal=10.0, lower=0.0))
    assert load == (0.0, 1e7, 0.0)
    assert range_of(Variable("u", "V", start=2.0, lower=1.0, upper=5.0)) == (1.0, 5.0, 2.0)
    assert range_of(Variable("u", "V", lower=1.0)) == (1.0, 1e6, 1.0)
    assert range_of(Variable("u", "V", start=3e6)) == (-1e6, 3e6, 3e6)
    assert range_of(Variable("u", "V", upper=-2e6)) == (-2e6, -2e6, -2e6)
    assert (
        range_of(Variable("w", "m/s", nominal=1e28)).high == 1e30
    )  # half of it has a finite square
    small = parameter_range(Variable("v_eps", "m/s", start=1e-15, nominal=1e-15, lower=0.0))
    assert small == (0.0, pytest.approx(1e6), 1e-15)
    assert parameter_range(Variable("k", "1", nominal=50.0)).high == pytest.approx(5e7)
    assert parameter_range(Variable("h", "s", start=1e-3, lower=0.0)) == (1e-9, 1e3, 1e-3)
    assert parameter_range(Variable("h", "s", start=1e-10)).low == 1e-10
    assert state_limit(Variable("z", "m", nominal=1e-5)) == pytest.approx(1e5)
    assert state_limit(Variable("z", "m", start=-1e4)) == pytest.approx(1e14)


def bench() -> Block:
    """Block with ranges of every shape, two arrays, and an output that may be undefined."""
    valve = Variable("valve", "V", start=2.0, lower=1.0, upper=5.0)
    lever = Variable("lever", "1", lower=-1.0, upper=3.0)
    big = Variable("big", "1", start=1e4)
    F = tuple(Variable(f"F_{i + 1}", "N") for i in range(8))
    k = tuple(Variable(f"k_{i + 1}", "N", start=1.0) for i in range(8))
    gain = Variable("gain", "1", start=0.5, lower=-2.0, upper=1.0)
    bias = Variable("bias", "V", lower=0.0)
    h = Variable("h", "s", start=1e-3, lower=0.0)
    ends = [f.symbol + 1e6 * lever.symbol * ca.tanh(b.symbol) * b.symbol
            for f, b in zip(F, k, strict=True)]  # fmt: skip
    return arranged(Block(
        "bench", states=(*F, big), inputs=(valve, lever), parameters=(*k, gain, bias, h),
        next=ca.vertcat(*ends, big.symbol + 1e15 * h.symbol * lever.symbol),
        outputs={"y": Output(bias.symbol + valve.symbol / (gain.symbol - 0.25), "V")},
    ))  # fmt: skip


STEPS = table(__file__)["steps"]


@pytest.mark.parametrize("flags", ["-O0", "-O2 -ffast-math"])
def test_every_repair_in_c_is_that_in_numpy_and_sets_its_bit(flags, compiler, tmp_path) -> None:
    block = bench()
    assert {a.name for a in block.arrays} == {"F", "k"}
    program = OneProgram([block], tmp_path, compiler, flags=flags.split())
    inputs = np.array([given for given, _, _ in STEPS.values()])
    parameters = np.array(
        [[own.get(v.name, v.start) for v in block.parameters] for _, own, _ in STEPS.values()]
    )
    (c,) = program.run([(0, inputs, parameters)])
    status = [Names(Status.__members__).value(text or "0") for _, _, text in STEPS.values()]
    assert c[:, -1].astype(int).tolist() == status
    wanted = run_vm(program.several[0], inputs, parameters=parameters)
    assert np.allclose(c, wanted, rtol=0.0 if flags == "-O0" else 1e-12, atol=0.0)
    rows = dict(zip(STEPS, c, strict=True))
    F, big, y = slice(0, 8), 8, 9
    assert rows["no voltage"][y] == rows["step size"][y] == 2.0 / 0.25  # other numbers are kept
    assert rows["force"][4] > 1e10
    assert not rows["lost"][F].any()
    assert rows["still"][big] > 1e12
    assert rows["no result"].tolist() == [*[0.0] * 8, 1e4, 0.0, Status.OUTPUT]
    assert rows["again"][big] == 1e4


def mass() -> Block:
    """Semi-implicit Euler of a spring-mass with a force: a plant, not a law."""
    x, v, u = Variable("x", "m"), Variable("v", "m/s"), Variable("u", "N")
    m, k, h = (Variable(n, "1", start=s) for n, s in (("m", 0.8), ("k", 2.1), ("h", 0.01)))
    after = v.symbol + h.symbol / m.symbol * (u.symbol - k.symbol * x.symbol)
    energy = (m.symbol * v.symbol**2 + k.symbol * x.symbol**2) / 2
    return Block(
        "mass",
        states=(x, v),
        inputs=(u,),
        parameters=(m, k, h),
        next=ca.vertcat(x.symbol + h.symbol * after, after),
        outputs={"energy": Output(energy, "J"), "spring": Output(k.symbol * x.symbol, "N")},
        resets={"init_balance": (ca.vertcat(u.symbol / k.symbol, 0.0), "Rest under u.")},
    )


U = Variable("u", "1")
PAIR = Block(
    "pair",
    inputs=(U,),
    outputs={"sum": Output(U.symbol + 1, "1"), "product": Output(2 * U.symbol, "1")},
)


def test_blocks_of_every_shape_have_the_bits_of_casadi(compiler, tmp_path):
    x, y, p = (Variable(n, "1", start=s) for n, s in (("x", 1.0), ("y", 2.0), ("p", 3.0)))
    swap = Block("swap", states=(x, y), next=ca.vertcat(y.symbol, x.symbol))
    constant = Block("constant", parameters=(p,), outputs={"y": Output(p.symbol / 7, "1")})
    blocks = [swap, mass(), PAIR, constant]
    program = OneProgram(blocks, tmp_path, compiler)
    random = np.random.default_rng(0)
    inputs = [random.standard_normal((50, len(block.inputs))) for block in blocks]
    found = program.run([*enumerate(inputs)])
    for c, given, rows in zip(program.several, inputs, found, strict=True):
        assert rows.shape == (50, len(c.signals))
        assert np.array_equal(rows, run_vm(c, given))
    assert found[0][:3, :2].tolist() == [[2, 1], [1, 2], [2, 1]]
    names = ["x", "v", "energy", "spring", "init_balance.x", "init_balance.v", "status"]
    assert CBlock(mass(), DOUBLE).signals == names
    rows = run_vm(CBlock(mass(), DOUBLE), np.array([[1.0], [0.0]]))
    v_1 = 0.01 / 0.8
    assert rows[0] == pytest.approx([0.01 * v_1, v_1, 0.0, 0.0, 1 / 2.1, 0.0, 0.0])
    assert rows[1, 2] == pytest.approx((0.8 * v_1**2 + 2.1 * (0.01 * v_1) ** 2) / 2)


def test_programs_that_do_not_run_stop_early_or_hang_are_errors(compiler, tmp_path, monkeypatch):
    (tmp_path / "main").write_bytes(b"\x7fELF of another machine")
    (tmp_path / "main").chmod(0o755)
    of_pair, of_mass = CBlock(PAIR, DOUBLE), CBlock(mass(), DOUBLE)
    with pytest.raises(CompileError, match="that was compiled does not start: Exec format"):
        run_c(of_pair, tmp_path / "main", np.zeros((1, 1)))
    made = generate(PAIR, tmp_path, real="double", kit=False)
    executable = compiled(of_pair, [made.source("double")], tmp_path, compiler)
    assert run_c(of_pair, executable, np.ones((2, 1))).tolist() == [[2.0, 2.0, 0.0]] * 2
    with pytest.raises(CompileError, match="ended too early"):
        run_c(of_mass, executable, np.zeros((1, 1)))
    (tmp_path / "main.c").write_text("int main(void) { for (;;) { } }\n")
    compiler.run(str(tmp_path / "main.c"), "-o", str(tmp_path / "main"))
    monkeypatch.setattr(runner, "PATIENCE", 0.3)
    with pytest.raises(CompileError, match="did not end"):
        run_c(of_mass, tmp_path / "main", np.ones((2, 2)))


def test_objects_report_warnings_errors_and_the_symbols_they_need(compiler, tmp_path, monkeypatch):
    source, target = tmp_path / "a.c", tmp_path / "a.o"
    source.write_text("float f(double x) { return x; }\n")
    warnings = compile_object(compiler, source, target)
    for words in (("prototype",), ("conver", "loses")):
        assert any(word in warning for warning in warnings for word in words)
    source.write_text("int f(void) { return nothing; }\n")
    with pytest.raises(CompileError, match="nothing"):
        compile_object(compiler, source, target)
    source.write_text("float tanhf(float); float g(float); float g(float x) { return tanhf(x); }\n")
    compile_object(compiler, source, target)
    assert needed_symbols(target) in ({"tanhf"}, None)
    monkeypatch.setenv("PATH", "")
    assert needed_symbols(target) is None
