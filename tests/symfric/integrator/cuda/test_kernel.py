"""The text of the kernel: C and C++ without a warning, and nothing in it that is not needed."""

import shutil
import subprocess

import pytest
from differentiable import oscillator, root, switched

from symfric import BrownMcPhee, Model, rabinowicz
from symfric.emitter.c99 import REALS
from symfric.integrator.cuda.kernel import kernel_of
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator

STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror")
COMPILERS = {
    "gcc": ("-std=c99", "-x", "c"),
    "clang": ("-std=c99", "-x", "c"),
    "g++": ("-std=c++17", "-x", "c++"),
}


def integrator(model: Model) -> Integrator:
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("real", REALS)
def test_it_is_c_and_cpp_without_a_warning(compiler: str, real: str) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    for model in (root(), switched()):
        kernel = kernel_of(integrator(model), model.name == "switched", REALS[real])
        subprocess.run(
            [compiler, *COMPILERS[compiler], *STRICT, "-fsyntax-only", "-"],
            input=kernel.on_host, text=True, check=True,
        )  # fmt: skip


def test_a_kernel_is_written_once_for_an_integrator() -> None:
    own = integrator(oscillator())
    assert kernel_of(own) is kernel_of(own)
    assert kernel_of(own) is not kernel_of(own, real=REALS["float"])


def test_dense_output_and_jumps_are_there_only_where_they_are_needed() -> None:
    own = integrator(rabinowicz(BrownMcPhee()))
    between, ends = kernel_of(own), kernel_of(own, between=False)
    assert ends.operations < between.operations
    assert "real *D)" not in ends.text
    for kernel in (between, ends):
        assert "symfric_round(const" not in kernel.text
        assert "#define FOLLOWS 0" in kernel.text
    follows = kernel_of(integrator(switched()))
    assert "symfric_round(const" in follows.text
    assert "#define FOLLOWS 2" in follows.text


def test_single_precision_has_no_constant_of_double() -> None:
    kernel = kernel_of(integrator(rabinowicz(BrownMcPhee())), real=REALS["float"])
    attempt = kernel.text[kernel.text.index("symfric_attempt(") : kernel.text.index("#define N ")]
    assert "double" not in attempt
    assert "1.1754944e-38f" in attempt
    assert "#define SF_POWF powf" in kernel.text
