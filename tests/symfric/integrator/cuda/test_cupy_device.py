"""What is asked of CuPy, by a module that takes its place; and what is said where it is missing."""

import sys

import numpy as np
import pytest
from differentiable import oscillator
from ensembles import assert_same
from fake_cupy import FakeCupy

from symfric import Ensemble, simulate_many
from symfric.integrator.cuda.device import CupyDevice, DeviceError
from symfric.integrator.cuda.kernel import BLOCK


@pytest.fixture
def cupy(monkeypatch: pytest.MonkeyPatch) -> FakeCupy:
    module = FakeCupy()
    monkeypatch.setitem(sys.modules, "cupy", module)
    return module


def members(backend: str = "cuda") -> Ensemble:
    x0 = {"x": np.linspace(0.5, 2.0, 100)}
    return simulate_many(oscillator(), 1.0, x0=x0, t_eval=[0.0, 0.5, 1.0], backend=backend)


def test_it_compiles_launches_waits_and_copies(cupy: FakeCupy) -> None:
    assert_same(members(), members("vm"))
    (asked, *others) = cupy.modules
    assert set(asked) == {"code", "options", "backend"}
    assert asked["backend"] == "nvrtc"
    assert "--fmad=false" in asked["options"]
    assert "__global__ void symfric_launch(const Many *all)" in asked["code"]
    assert "#include" not in asked["code"]
    assert all(other == asked for other in others)
    assert cupy.launches[0] == ((2,), (BLOCK,))  # 100 members
    assert cupy.waited == len(cupy.launches)


def test_threads_are_those_that_registers_let_run_at_once(cupy: FakeCupy) -> None:
    device = CupyDevice.found()
    assert device.name == "Fake 100"
    # 94 registers of 32 threads are 3072 of 65536: 21 warps, 10 blocks of 64 threads
    assert device._threads(94) == 3 * 640
    assert device._threads(0) == device._threads(8) == 3 * 2048
    assert device._threads(255) == 3 * 256


def test_without_cupy_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(DeviceError, match=r"needs CuPy .*; pip install 'symfric\[cuda\]', or use"):
        members()


@pytest.mark.parametrize(
    ("devices", "why"), [(0, "no device found"), (-1, "CUDA driver version is insufficient")]
)
def test_without_a_device_it_says_so(
    devices: int, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "cupy", FakeCupy(devices))
    with pytest.raises(DeviceError, match=rf"needs a graphics processor of NVIDIA.*{why}.*nvidia-"):
        members()


def test_a_refused_kernel_and_a_launch_that_breaks_are_sentences(cupy: FakeCupy) -> None:
    cupy.refuses = True
    with pytest.raises(DeviceError, match=r"NVRTC did not compile.*identifier is undefined\)"):
        members()
    cupy.refuses, cupy.broken = False, True
    with pytest.raises(DeviceError, match=r"processor stopped \(cudaErrorLaunchTimeout"):
        members()


def test_memory_that_is_short_is_shared(cupy: FakeCupy) -> None:
    cupy.room = 4000
    assert_same(members(), members("vm"))
    assert len(cupy.launches) > 4


def test_no_other_backend_asks_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cupy", None)
    for backend in ("auto", "vm"):
        assert not members(backend).failed
