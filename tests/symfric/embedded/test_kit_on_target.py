"""The unit test of a kit passes on the cores it is made for, and finds what is wrong."""

import pytest
from cortex import on_target

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate
from symfric.embedded import Absent, wrong_on_target
from symfric.foundation.programs import CompileError


@on_target
@pytest.mark.heavy
@pytest.mark.parametrize(
    ("real", "core"), [("float", "m0plus"), ("float", "m4f"), ("double", "m7"), ("double", "m3")]
)
def test_a_kit_passes_its_own_test(real, core, tmp_path):
    assert wrong_on_target(generate(LuGre(), tmp_path, real=real), real, core) == 0


@on_target
@pytest.mark.heavy
def test_what_is_wrong_is_counted(tmp_path):
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
