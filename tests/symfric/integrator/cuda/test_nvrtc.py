"""Kernels compile by NVRTC, which needs no graphics processor, and fit into registers."""

import re

import pytest
from differentiable import pendulum, switched

from symfric import BrownMcPhee, LuGre, Model, rabinowicz
from symfric.emitter.c99 import REALS
from symfric.integrator.cuda import device
from symfric.integrator.cuda.device import DeviceError
from symfric.integrator.cuda.kernel import NAME, kernel_of
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.scenes import SliderCrank
from symfric.scenes.catalogue import ALL_SCENES

needs_nvrtc = pytest.mark.skipif(
    device.library() is None, reason="needs NVRTC (extra 'cuda-check'); no GPU is needed"
)


def integrator(model: Model) -> Integrator:
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])


MODELS = {
    "brown_mcphee": lambda: rabinowicz(BrownMcPhee()),
    "lugre": lambda: rabinowicz(LuGre()),
    "algebraic unknowns": switched,
    "mechanism": pendulum,
    "slider-crank": lambda: SliderCrank(BrownMcPhee()).model(),
}


@needs_nvrtc
@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("between", [True, False])
@pytest.mark.parametrize("name", ["brown_mcphee", "algebraic unknowns", "mechanism"])
def test_a_kernel_becomes_ptx_without_a_warning(name: str, between: bool, real: str) -> None:
    kernel = kernel_of(integrator(MODELS[name]()), between, REALS[real])
    built = device.build(kernel.on_device)
    assert f".visible .entry {NAME}(" in built.text
    assert not built.log.strip("\0\n ")
    doubles = len(re.findall(r"\b(?:add|mul|fma|div|sqrt)\S*\.f64", built.text))
    assert (doubles > 100) == (real == "double")


@needs_nvrtc
@pytest.mark.slow
@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("name", ALL_SCENES)
def test_all_scenes_become_ptx(name: str, real: str) -> None:
    """The arm takes a minute."""
    kernel = kernel_of(integrator(ALL_SCENES[name](LuGre()).model()), True, REALS[real])
    assert f".visible .entry {NAME}(" in device.build(kernel.on_device).text


@needs_nvrtc
def test_no_product_goes_unrounded_into_a_sum(monkeypatch: pytest.MonkeyPatch) -> None:
    source = 'extern "C" __global__ void f(double *x) { x[0] = x[0] * x[1] + x[2]; }'
    built = device.build(source)
    assert "mul" in built.text
    assert "fma" not in built.text
    monkeypatch.setattr(device, "OPTIONS", ())
    assert "fma" in device.build(source).text


@needs_nvrtc
@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("brown_mcphee", 128),
        ("lugre", 168),
        pytest.param("slider-crank", 255, marks=pytest.mark.heavy),
    ],
)
def test_registers_are_few(name: str, most: int) -> None:
    """Small scenes spill nothing; those of a mechanism are as many as there are."""
    built = device.build(kernel_of(integrator(MODELS[name]())).on_device, "sm_80")
    assert 32 <= built.registers <= most
    assert (built.spilled == 0) == (most < 255)


@needs_nvrtc
def test_what_is_no_cuda_is_refused_with_its_first_error() -> None:
    with pytest.raises(DeviceError, match=r"rejected the kernel: .*error: .*nonsense"):
        device.build("nonsense x;")


def test_without_nvrtc_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "library", lambda: None)
    with pytest.raises(DeviceError, match=r"pip install 'symfric\[cuda-check\]'"):
        device.build("")
