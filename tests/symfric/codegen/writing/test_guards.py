"""What guards do with single numbers, also where a compiler believes that NaN does not exist."""

from pathlib import Path

import numpy as np
import pytest

from symfric import BrownMcPhee, Law, LuGre, Variable
from symfric.codegen import generate, law_block
from symfric.codegen.running.guarded import Model
from symfric.codegen.running.runner import program, run_c, signals
from symfric.codegen.writing.guards import (
    Status,
    parameter_range,
    range_of,
    state_limit,
)
from symfric.codegen.writing.header import header
from symfric.codegen.writing.source import source
from symfric.emitter.c99 import DOUBLE, FLOAT
from symfric.foundation.compiler import Compiler

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
    block, made = law_block(law), generate(law, tmp_path, real="float")
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
    inputs, said = Model(law_block(LuGre()), DOUBLE).inputs(np.array([[np.nan, N], [2e-3, N]]))
    assert inputs.tolist() == [[0.0, N], [2e-3, N]]
    assert said.tolist() == [Status.NOT_FINITE, 0]


def test_ranges_are_the_bounds_or_a_million_times_the_nominal_value() -> None:
    load = range_of(Variable("N", "N", nominal=10.0, lower=0.0))
    assert (load.low, load.high, load.safe) == (0.0, 1e7, 0.0)
    valve = range_of(Variable("u", "V", start=2.0, lower=1.0, upper=5.0))
    assert (valve.low, valve.high, valve.safe) == (1.0, 5.0, 2.0)
    small = parameter_range(Variable("v_eps", "m/s", start=1e-15, nominal=1e-15, lower=0.0))
    assert small.low == 0.0
    assert small.high == pytest.approx(1e6)
    step = parameter_range(Variable("h", "s", start=1e-3, lower=0.0))
    assert (step.low, step.high) == (1e-9, 1e3)
    assert parameter_range(Variable("h", "s", start=1e-10)).low == 1e-10
    assert state_limit(Variable("z", "m", nominal=1e-5)) == pytest.approx(1e5)


def test_parameters_out_of_range_give_way_to_the_defaults() -> None:
    block = law_block(LuGre())
    model = Model(block, DOUBLE)
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
