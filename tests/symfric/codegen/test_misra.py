"""Deviations of generated C from MISRA C:2012, as far as cppcheck finds them."""

import re
import shutil
import subprocess

import pytest

from symfric import BrownMcPhee
from symfric.codegen import generate, inverse_dynamics_block, law_block, plant_block
from symfric.compensation import compensator, disturbance_observer
from symfric.laws import GMS, LuGre
from symfric.scenes import Arm, Drive

BLOCKS = {
    "function": lambda: law_block(BrownMcPhee()),
    "states": lambda: law_block(LuGre()),
    "arrays": lambda: law_block(GMS(form="event")),
    "compensator": lambda: compensator(LuGre(), N=100.0, limit=60.0, slew=1e4),
    "observer": lambda: disturbance_observer(1.0, 100.0, limit=2.0),
    "plant": lambda: plant_block(Drive(LuGre())),
    "inverse dynamics": lambda: inverse_dynamics_block(Arm(BrownMcPhee()).mechanism()),
}


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="cppcheck is not installed")
@pytest.mark.parametrize("name", BLOCKS)
def test_the_manifest_names_all_deviations(name, tmp_path):
    made = generate(BLOCKS[name](), tmp_path, real=("float", "double"), kit=False)
    command = ["cppcheck", "--addon=misra", "--enable=style", "--std=c99", f"-I{tmp_path}"]
    sources = [str(made.source(real)) for real in made.reals]
    shown = subprocess.run([*command, *sources], capture_output=True, text=True, check=True).stderr
    found = set(re.findall(r"\[misra-c2012-([\d.]+)\]", shown))
    assert "12.1" in found
    assert found <= {*made.manifest["misra_c_2012_deviations"]}
