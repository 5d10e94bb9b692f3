"""What is asked of a compiler of the C that is given away."""

import pytest

from symfric.codegen.runner import compile_object, needed_symbols
from symfric.foundation.programs import CompileError


def test_warnings_are_returned(compiler, tmp_path):
    (tmp_path / "a.c").write_text("float f(double x) { return x; }\n")
    warnings = compile_object(compiler, tmp_path / "a.c", tmp_path / "a.o")
    assert len(warnings) == 2
    assert any("prototype" in warning for warning in warnings)
    assert any("conver" in warning or "loses" in warning for warning in warnings)


def test_what_does_not_compile_says_why(compiler, tmp_path):
    (tmp_path / "a.c").write_text("int f(void) { return nothing; }\n")
    with pytest.raises(CompileError, match="nothing"):
        compile_object(compiler, tmp_path / "a.c", tmp_path / "a.o")


def test_needed_symbols_are_those_from_elsewhere(compiler, tmp_path):
    text = "float tanhf(float); float g(float); float g(float x) { return tanhf(x); }\n"
    (tmp_path / "a.c").write_text(text)
    compile_object(compiler, tmp_path / "a.c", tmp_path / "a.o")
    found = needed_symbols(tmp_path / "a.o")
    if found is None:
        pytest.skip("no nm on this machine")
    assert found == {"tanhf"}


def test_without_nm_symbols_are_unknown(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", "")
    assert needed_symbols(tmp_path / "a.o") is None
