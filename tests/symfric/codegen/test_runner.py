"""Blocks of every shape run as C and in CasADi's virtual machine."""

import casadi as ca
import numpy as np
import pytest

from symfric import Output, Variable
from symfric.codegen import Block, generate, runner
from symfric.codegen.runner import link_program, program, run_c, run_vm, signals
from symfric.emitter.c99 import DOUBLE
from symfric.foundation.programs import CompileError


def swap() -> Block:
    x, y = Variable("x", "1", start=1.0), Variable("y", "1", start=2.0)
    return Block(
        "swap",
        states=(x, y),
        next=ca.vertcat(y.symbol, x.symbol),
        outputs={"old": Output(x.symbol, "1")},
    )


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


def pair() -> Block:
    u = Variable("u", "1")
    outputs = {"sum": Output(u.symbol + 1, "1"), "product": Output(2 * u.symbol, "1")}
    return Block("pair", inputs=(u,), outputs=outputs)


def constant() -> Block:
    p = Variable("p", "1", start=3.0)
    return Block("constant", parameters=(p,), outputs={"y": Output(p.symbol / 7, "1")})


BLOCKS = {"swap": swap, "mass": mass, "pair": pair, "constant": constant}


def built(block, compiler, folder):
    made = generate(block, folder, real="double")
    (folder / "main.c").write_text(program(block, DOUBLE))
    link_program(compiler, [folder / "main.c", made.source("double")], folder, folder / "main")
    return folder / "main"


@pytest.mark.parametrize("name", list(BLOCKS))
def test_both_give_the_same_bits(name, compiler, tmp_path):
    block = BLOCKS[name]()
    inputs = np.random.default_rng(0).standard_normal((50, len(block.inputs)))
    c = run_c(block, DOUBLE, built(block, compiler, tmp_path), inputs)
    assert c.shape == (50, len(signals(block)))
    assert np.array_equal(c, run_vm(block, DOUBLE, inputs))


def test_states_that_only_change_places_do(compiler, tmp_path):
    block = swap()
    c = run_c(block, DOUBLE, built(block, compiler, tmp_path), np.zeros((3, 0)))
    assert c[:, :3].tolist() == [[2, 1, 1], [1, 2, 2], [2, 1, 1]]


def test_the_virtual_machine_does_the_steps_of_the_block():
    rows = run_vm(mass(), DOUBLE, np.array([[1.0], [0.0]]))
    v_1 = 0.01 / 0.8
    assert rows[0] == pytest.approx([0.01 * v_1, v_1, 0.0, 0.0, 1 / 2.1, 0.0, 0.0])
    assert rows[1, 2] == pytest.approx((0.8 * v_1**2 + 2.1 * (0.01 * v_1) ** 2) / 2)


def test_signals_name_the_columns():
    names = ["x", "v", "energy", "spring", "init_balance.x", "init_balance.v"]
    assert signals(mass(), guards=False) == names
    assert signals(mass()) == [*names, "status"]


def test_a_program_that_cannot_run_is_an_error(tmp_path):
    (tmp_path / "main").write_bytes(b"\x7fELF of another machine")
    (tmp_path / "main").chmod(0o755)
    with pytest.raises(CompileError, match="that was compiled does not start: Exec format"):
        run_c(pair(), DOUBLE, tmp_path / "main", np.zeros((1, 1)))


def test_a_program_that_stops_early_is_an_error(compiler, tmp_path):
    executable = built(pair(), compiler, tmp_path)
    with pytest.raises(CompileError, match="ended too early"):
        run_c(mass(), DOUBLE, executable, np.zeros((1, 1)))


def test_a_program_that_comes_to_no_end_is_stopped(compiler, tmp_path, monkeypatch):
    (tmp_path / "main.c").write_text("int main(void) { for (;;) { } }\n")
    link_program(compiler, [tmp_path / "main.c"], tmp_path, tmp_path / "main")
    monkeypatch.setattr(runner, "PATIENCE", 0.5)
    with pytest.raises(CompileError, match="did not end"):
        run_c(mass(), DOUBLE, tmp_path / "main", np.ones((2, 2)))
