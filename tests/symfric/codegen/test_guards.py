"""What guards do with single numbers, also where a compiler believes that NaN does not exist."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from symfric import BrownMcPhee, Law, LuGre, Output, Variable
from symfric.codegen import Block, generate, law_block
from symfric.codegen.blocks.variables import arranged
from symfric.codegen.guards import Status, parameter_range, range_of, state_limit
from symfric.codegen.header import header
from symfric.codegen.routines import source
from symfric.codegen.runner import GuardModel, link_program, program, run_c, run_vm, signals
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.foundation.programs import Compiler

N = 10.0
GIVEN: dict[str, tuple[list[float], int]] = {
    "fine": ([1e-3, N], 0),
    "no load": ([1e-3, 0.0], 0),
    "minus zero": ([-0.0, -0.0], 0),
    "the ends": ([-1e6, 1e7], 0),
    "beyond": ([1.1e6, N], Status.CLAMPED),
    "negative load": ([1e-3, -1e-30], Status.CLAMPED),
    "NaN": ([np.nan, N], Status.NOT_FINITE),
    "infinite": ([1e-3, -np.inf], Status.NOT_FINITE),
    "both": ([np.nan, 1e30], Status.NOT_FINITE | Status.CLAMPED),
}


@pytest.mark.heavy
@pytest.mark.parametrize("flags", ["-O2", "-O2 -ffast-math", "-O0"])
@pytest.mark.parametrize("law", [LuGre(), BrownMcPhee()], ids=["lugre", "brown_mcphee"])
def test_every_repair_is_flagged(law: Law, flags: str, compiler: Compiler, tmp_path: Path) -> None:
    block, made = law_block(law), generate(law, tmp_path, real="float", kit=False)
    (tmp_path / "main.c").write_text(program(block, FLOAT))
    parts = map(str, (tmp_path / "main.c", made.source("float")))
    executable = tmp_path / "main"
    compiler.run("-std=c99", *flags.split(), f"-I{tmp_path}", *parts, "-o", str(executable), "-lm")
    rows = run_c(block, FLOAT, executable, np.array([given for given, _ in GIVEN.values()]))
    said = rows[:, signals(block).index("status")]
    assert said.astype(int).tolist() == [int(status) for _, status in GIVEN.values()]
    assert np.isfinite(rows).all()


def test_a_law_works_on_after_a_bad_sample() -> None:
    """A lost sample of v is rest: the bristle keeps its deflection."""
    inputs, said = GuardModel(law_block(LuGre()), DOUBLE).inputs(np.array([[np.nan, N], [2e-3, N]]))
    assert inputs.tolist() == [[0.0, N], [2e-3, N]]
    assert said.tolist() == [Status.NOT_FINITE, 0]


def test_ranges_are_the_bounds_or_a_million_times_the_nominal_value() -> None:
    load = range_of(Variable("N", "N", nominal=10.0, lower=0.0))
    assert (load.low, load.high, load.safe) == (0.0, 1e7, 0.0)
    valve = range_of(Variable("u", "V", start=2.0, lower=1.0, upper=5.0))
    assert (valve.low, valve.high, valve.safe) == (1.0, 5.0, 2.0)
    assert range_of(Variable("w", "m/s", nominal=1e28)).high == 1e30  # half of it has a square
    small = parameter_range(Variable("v_eps", "m/s", start=1e-15, nominal=1e-15, lower=0.0))
    assert small.low == 0.0
    assert small.high == pytest.approx(1e6)
    step = parameter_range(Variable("h", "s", start=1e-3, lower=0.0))
    assert (step.low, step.high) == (1e-9, 1e3)
    assert parameter_range(Variable("h", "s", start=1e-10)).low == 1e-10
    assert state_limit(Variable("z", "m", nominal=1e-5)) == pytest.approx(1e5)
    assert state_limit(Variable("z", "m", start=-1e4)) == pytest.approx(1e14)


def bench() -> Block:
    """Ranges of every shape, eight alike states and parameters, and a result that may have none."""
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


STEPS: dict[str, tuple[list[float], dict[str, float], int]] = {
    "fine": ([2.0, 0.0], {}, 0),
    "ends": ([5.0, -1.0], {"gain": 1.0}, 0),
    "other ends": ([1.0, 3.0], {"gain": -2.0}, 0),
    "within the wider end": ([2.0, -1.5], {}, Status.CLAMPED),
    "above": ([2.0, 3.5], {}, Status.CLAMPED),
    "below": ([0.5, 0.0], {}, Status.CLAMPED),
    "no voltage": ([np.nan, 0.0], {}, Status.NOT_FINITE),
    "minus zero": ([2.0, 0.0], {"bias": -0.0}, 0),
    "bias": ([2.0, 0.0], {"bias": -1e-300}, Status.PARAMETER),
    "gain": ([2.0, 0.0], {"gain": 1.5}, Status.PARAMETER),
    "an element": ([2.0, 0.0], {"k_5": np.nan}, Status.PARAMETER),
    "step size": ([2.0, 0.0], {"h": 1e4}, Status.PARAMETER),
    "force": ([2.0, 1.0], {"k_5": 1e6}, 0),
    "lost": ([2.0, 0.0], {}, Status.STATE),
    "big": ([2.0, 1.0], {}, 0),
    "still": ([2.0, 1.0], {}, 0),
    "no result": ([2.0, 1.0], {"gain": 0.25}, Status.OUTPUT),
    "again": ([2.0, 0.0], {}, 0),
}


def test_numbers_of_every_range_are_mended_in_c_as_beside_casadi(compiler, tmp_path) -> None:
    block = bench()
    assert {a.name for a in block.arrays} == {"F", "k"}
    made = generate(block, tmp_path, real="double", kit=False)
    (tmp_path / "main.c").write_text(program(block, DOUBLE))
    link_program(compiler, [tmp_path / "main.c", made.source("double")], tmp_path, tmp_path / "m")
    inputs = np.array([given for given, _, _ in STEPS.values()])
    parameters = np.array(
        [[own.get(v.name, v.start) for v in block.parameters] for _, own, _ in STEPS.values()]
    )
    c = run_c(block, DOUBLE, tmp_path / "m", inputs, parameters)
    assert c[:, -1].astype(int).tolist() == [int(status) for _, _, status in STEPS.values()]
    assert np.array_equal(c, run_vm(block, DOUBLE, inputs, parameters=parameters))
    rows = dict(zip(STEPS, c, strict=True))
    F, big, y = slice(0, 8), 8, 9
    assert rows["no voltage"][y] == 2.0 / 0.25
    assert rows["step size"][y] == 2.0 / 0.25  # the other parameters stay
    assert rows["force"][4] > 1e10
    assert not rows["lost"][F].any()
    assert rows["still"][big] > 1e12
    assert rows["no result"].tolist() == [*[0.0] * 8, 1e4, 0.0, Status.OUTPUT]
    assert rows["again"][big] == 1e4


def test_parameters_out_of_range_give_way_to_the_defaults() -> None:
    block = law_block(LuGre())
    model = GuardModel(block, DOUBLE)
    names = [v.name for v in block.parameters]
    values = model.default.copy()
    assert model.parameters(values)[1] == 0
    values[names.index("mu_s")] = np.nan
    values[names.index("h")] = 1e4
    found, said = model.parameters(values)
    assert said == Status.PARAMETER
    assert found[names.index("mu_s")] == 0.15
    assert found[names.index("h")] == 1e3


def test_without_guards_nothing_is_left_of_them() -> None:
    block = law_block(LuGre())
    for text in (header(block, FLOAT, guards=False), source(block, FLOAT, guards=False)):
        assert not any(word in text for word in ("status", "CLAMPED", "stdint", "memcpy"))
    assert "#define LUGRE_F32_NOT_FINITE 2u" in header(block, FLOAT)
    assert "_STATE" not in header(law_block(BrownMcPhee()), FLOAT)
