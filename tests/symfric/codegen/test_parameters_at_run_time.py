"""Every parameter is changed in compiled C, between steps, and C stays CasADi to the bit."""

from pathlib import Path

import numpy as np
import pytest
from law_cases import CASES, NO_STEP

from symfric import BrownMcPhee, LuGre
from symfric.codegen import Block, generate, law_block, plant_block
from symfric.codegen.runner import link_program, program, run_c, run_vm
from symfric.codegen.vectors import changed_value, excitation
from symfric.emitter.c99 import DOUBLE
from symfric.foundation.files import write_text
from symfric.foundation.programs import Compiler
from symfric.laws import GMS
from symfric.scenes import ALL_SCENES, Drive, Rabinowicz

pytestmark = pytest.mark.heavy

LAWS = {name: law for name, law in CASES.items() if name not in NO_STEP}
EACH = 20
"""Steps with one parameter changed, before the next one is."""


def followed(block: Block, compiler: Compiler, folder: Path) -> None:
    """C and virtual machine through a run in which one parameter after the other changes."""
    count = len(block.parameters)
    defaults = np.array([float(v.start) for v in block.parameters])
    parameters = np.tile(defaults, (EACH * (count + 1), 1))
    for i, v in enumerate(block.parameters):
        parameters[EACH * (i + 1) : EACH * (i + 2), i] = changed_value(v)
    inputs = np.resize(excitation(block), (len(parameters), len(block.inputs)))
    made = generate(block, folder, real="double", kit=False)
    write_text(folder / "main.c", program(block, DOUBLE))
    link_program(compiler, [folder / "main.c", made.source("double")], folder, folder / "main")
    c = run_c(block, DOUBLE, folder / "main", inputs, parameters)
    vm = run_vm(block, DOUBLE, inputs, parameters=parameters)
    assert np.array_equal(c, vm, equal_nan=True)
    assert np.array_equal(c[:, -1], np.zeros(len(c)))  # no guard speaks
    plain = run_vm(block, DOUBLE, inputs)
    first = EACH  # of the run, from which parameters differ
    assert not np.array_equal(vm[first:], plain[first:])


@pytest.mark.parametrize(
    "block",
    [
        law_block(LuGre()), plant_block(Drive(LuGre())),
        pytest.param(law_block(GMS(form="event")), marks=pytest.mark.slow),
        pytest.param(plant_block(Rabinowicz(BrownMcPhee())), marks=pytest.mark.slow),
    ],
    ids=lambda block: block.name,
)  # fmt: skip
def test_c_follows_the_virtual_machine(block: Block, compiler: Compiler, tmp_path: Path) -> None:
    followed(block, compiler, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_of_every_law(name: str, compiler: Compiler, tmp_path: Path) -> None:
    block = law_block(LAWS[name])
    if not block.parameters:
        pytest.skip("no parameter")
    followed(block, compiler, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=["brown_mcphee", "lugre"])
@pytest.mark.parametrize("name", [name for name in ALL_SCENES if name != "arm"])
def test_of_every_scene(name: str, law: LuGre, compiler: Compiler, tmp_path: Path) -> None:
    followed(plant_block(ALL_SCENES[name](law)), compiler, tmp_path)
