"""Bytes and stack of generated C."""

import pytest

from symfric import BrownMcPhee, LuGre
from symfric.codegen import generate, law_block
from symfric.codegen.runner import footprint
from symfric.emitter.c99 import FLOAT
from symfric.foundation.programs import find_compiler


def test_text_and_stack_are_those_of_the_object_file(tmp_path):
    compiler = find_compiler("gcc") if __import__("shutil").which("gcc") else None
    if compiler is None:
        pytest.skip("needs gcc")
    sizes = {}
    for law in (BrownMcPhee(), LuGre()):
        made = generate(law, tmp_path, real="float", kit=False)
        sizes[made.block.name] = footprint(made.block, FLOAT, tmp_path, compiler)
    assert 0 < sizes["brown_mcphee"].text < sizes["lugre"].text < 10_000
    assert sizes["lugre"].data == 0
    assert set(sizes["lugre"].stack) >= {"lugre_f32_step", "lugre_f32_init"}
    assert all(0 <= n < 1000 for n in sizes["lugre"].stack.values())


def test_the_manifest_holds_them_and_without_a_compiler_none(tmp_path, monkeypatch):
    if find_compiler() is not None:
        found = generate(LuGre(), tmp_path / "a", real="float").manifest["real"]["float"]
        assert found["measured"]["text"] is None or found["measured"]["text"] > 100
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    bare = generate(law_block(LuGre()), tmp_path / "b", real="float")
    assert "measured" not in bare.manifest["real"]["float"]
