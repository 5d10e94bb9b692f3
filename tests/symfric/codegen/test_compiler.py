"""Finding and calling a compiler."""

import sys

import pytest

from symfric.codegen.compiler import CompileError, Compiler, find_compiler, needed_symbols


def test_without_any_there_is_none(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    assert find_compiler() is None


def test_cc_with_options_comes_first(monkeypatch):
    monkeypatch.setenv("CC", f"{sys.executable} -m whatever")
    assert find_compiler() == Compiler((sys.executable, "-m", "whatever"))


def test_a_cc_that_does_not_exist_is_passed_over(monkeypatch, compiler):
    monkeypatch.setenv("CC", "no-such-compiler")
    found = find_compiler()
    assert found is not None
    assert found.command[0] in ("gcc", "clang")


def test_an_explicit_compiler_must_exist():
    with pytest.raises(ValueError, match="expected a C compiler, got 'no-such-compiler'"):
        find_compiler("no-such-compiler")


def test_warnings_are_returned(compiler, tmp_path):
    (tmp_path / "a.c").write_text("float f(double x) { return x; }\n")
    warnings = compiler.object(tmp_path / "a.c", tmp_path / "a.o")
    assert len(warnings) == 2
    assert any("prototype" in warning for warning in warnings)
    assert any("conver" in warning or "loses" in warning for warning in warnings)


def test_what_does_not_compile_says_why(compiler, tmp_path):
    (tmp_path / "a.c").write_text("int f(void) { return nothing; }\n")
    with pytest.raises(CompileError, match="nothing"):
        compiler.object(tmp_path / "a.c", tmp_path / "a.o")


def test_needed_symbols_are_those_from_elsewhere(compiler, tmp_path):
    text = "float tanhf(float); float g(float); float g(float x) { return tanhf(x); }\n"
    (tmp_path / "a.c").write_text(text)
    compiler.object(tmp_path / "a.c", tmp_path / "a.o")
    found = needed_symbols(tmp_path / "a.o")
    if found is None:
        pytest.skip("no nm on this machine")
    assert found == {"tanhf"}


def test_without_nm_symbols_are_unknown(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", "")
    assert needed_symbols(tmp_path / "a.o") is None
