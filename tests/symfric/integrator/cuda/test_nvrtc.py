"""Kernels compile by NVRTC, which needs neither driver nor device, and fit into registers."""

import ctypes
import re
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from differentiable import pendulum, switched

from symfric import BrownMcPhee, LuGre, Model, rabinowicz
from symfric.emitter.c99 import REALS
from symfric.integrator.cuda.device import AFTER, BEFORE, NAME, OPTIONS, kernel_of
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.scenes import SliderCrank

MODELS: dict[str, Callable[[], Model]] = {
    "brown_mcphee": lambda: rabinowicz(BrownMcPhee()),
    "lugre": lambda: rabinowicz(LuGre()),
    "algebraic unknowns": switched,
    "mechanism": pendulum,
    "slider-crank": lambda: SliderCrank(BrownMcPhee()).model(),
}


def found() -> Path | None:
    spec = find_spec("nvidia")
    places = [] if spec is None else list(spec.submodule_search_locations or [])
    every = (path for place in places for path in sorted(Path(place).glob("*/lib/libnvrtc.so*")))
    return next(every, None)


pytestmark = pytest.mark.skipif(
    found() is None, reason="needs NVRTC (extra 'cuda-check'); no GPU is needed"
)


def build(source: str, *options: str) -> tuple[str, str]:
    """PTX, or "" of machine code (sm_80), and the messages of NVRTC."""
    nvrtc, handle = ctypes.CDLL(str(found())), ctypes.c_void_p()
    assert not nvrtc.nvrtcCreateProgram(
        ctypes.byref(handle), source.encode(), b"symfric.cu", 0, None, None
    )

    def text(what: str) -> str:
        size = ctypes.c_size_t()
        assert not getattr(nvrtc, f"nvrtcGet{what}Size")(handle, ctypes.byref(size))
        content = ctypes.create_string_buffer(max(1, size.value))
        assert not getattr(nvrtc, f"nvrtcGet{what}")(handle, content)
        return content.value.decode(errors="replace")

    every = ["--std=c++14", *(options or ("--gpu-architecture=compute_80", *OPTIONS))]
    given = (ctypes.c_char_p * len(every))(*(word.encode() for word in every))
    status = nvrtc.nvrtcCompileProgram(handle, len(every), given)
    log = text("ProgramLog")
    assert not status, log
    return "" if any("sm_" in word for word in every) else text("PTX"), log


def code(name: str, between: bool = True, real: str = "double", scene: Any = None) -> str:
    model = MODELS[name]() if scene is None else scene
    own = Integrator(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])
    return f"{BEFORE}{kernel_of(own, between, REALS[real]).text}{AFTER}"


@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("name", ["brown_mcphee", "algebraic unknowns", "mechanism"])
def test_a_kernel_becomes_ptx_without_a_warning(name: str, real: str) -> None:
    for between in (True, False):
        text, log = build(code(name, between, real))
        assert f".visible .entry {NAME}(" in text
        assert not log.strip("\0\n ")
        doubles = len(re.findall(r"\b(?:add|mul|fma|div|sqrt)\S*\.f64", text))
        assert (doubles > 100) == (real == "double")


def test_no_product_goes_unrounded_into_a_sum() -> None:
    source = 'extern "C" __global__ void f(double *x) { x[0] = x[0] * x[1] + x[2]; }'
    text, _ = build(source)
    assert "mul" in text
    assert "fma" not in text
    assert "fma" in build(source, "--gpu-architecture=compute_80")[0]


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("brown_mcphee", 128),
        ("lugre", 168),
        pytest.param("slider-crank", 255, marks=pytest.mark.heavy),
    ],
)
def test_registers_are_few(name: str, most: int) -> None:
    """Small scenes spill nothing; a mechanism takes all registers."""
    _, log = build(code(name), "--gpu-architecture=sm_80", "--ptxas-options=-v", *OPTIONS)
    registers = max(map(int, re.findall(r"Used (\d+) registers", log)))
    spilled = max(map(int, re.findall(r"(\d+) bytes spill stores", log)), default=0)
    assert 32 <= registers <= most
    assert (spilled == 0) == (most < 255)
