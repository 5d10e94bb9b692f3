"""Deviations of generated C from MISRA C:2012, as far as cppcheck finds them."""

import re
import shutil
import subprocess

import pytest

from symfric import BrownMcPhee
from symfric.codegen import generate, inverse_dynamics_block, law_block, plant_block
from symfric.compensation import compensator
from symfric.laws import GMS, LuGre
from symfric.scenes import DoublePendulum, Drive

BLOCKS = {
    "function": lambda: law_block(BrownMcPhee()),
    "arrays": lambda: law_block(GMS(form="event")),
    "compensator": lambda: compensator(LuGre(), N=100.0, limit=60.0, slew=1e4),
    "plant": lambda: plant_block(Drive(LuGre())),
    "inverse dynamics": lambda: inverse_dynamics_block(DoublePendulum(BrownMcPhee()).mechanism()),
}


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="cppcheck is not installed")
@pytest.mark.parametrize(
    "name", [n if n in ("arrays", "compensator") else pytest.param(n, marks=pytest.mark.slow)
             for n in BLOCKS],
)  # fmt: skip
def test_the_manifest_names_all_deviations(name, tmp_path):
    """The types differ in their names and literals; one block is enough for the other type."""
    real = "double" if name == "arrays" else "float"
    made = generate(BLOCKS[name](), tmp_path, real=real, kit=False)
    command = ["cppcheck", "--addon=misra", "--enable=style", "--std=c99", f"-I{tmp_path}"]
    source = str(made.source(real))
    shown = subprocess.run([*command, source], capture_output=True, text=True, check=True).stderr
    found = set(re.findall(r"\[misra-c2012-([\d.]+)\]", shown))
    assert "12.1" in found
    assert found <= {*made.manifest["misra_c_2012_deviations"]}
