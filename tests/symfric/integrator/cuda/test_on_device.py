"""Ensembles on a device: the bits of the CPU, also of counts and failures.

A module in the place of CuPy compiles the same text of the kernel for the processor.
"""

import shutil
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from device_cases import ALIKE, CASES, VELOCITIES
from differentiable import oscillator, root, switched
from ensembles import after, assert_same, with_functions_of_libm
from fake_cupy import LAUNCH_ON_HOST, ON_HOST, FakeCupy

from symfric import BrownMcPhee, Law, LuGre, Model, Status, rabinowicz, simulate_many
from symfric.emitter.c99 import DOUBLE, REALS
from symfric.integrator.cuda.device import BLOCK, Device, DeviceError, Kernel, kernel_of
from symfric.integrator.cuda.on_device import OnDevice, member_bytes
from symfric.integrator.equations.inputs import input_data
from symfric.integrator.methods.tableaux import METHODS
from symfric.integrator.running.integrator import Integrator
from symfric.scenes.catalogue import ALL_SCENES

TWENTY: dict[str, Any] = {"x0": {"x": np.linspace(0.5, 2.0, 20)}, "backend": "cuda"}


@pytest.fixture(autouse=True)
def cupy(monkeypatch: pytest.MonkeyPatch) -> FakeCupy:
    with_functions_of_libm(monkeypatch)
    module = FakeCupy()
    monkeypatch.setitem(sys.modules, "cupy", module)
    return module


def integrator(model: Model) -> Integrator:
    return Integrator(model, input_data(model, None, 0.0, 1.0), METHODS["rodas5p"])


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=pytest.mark.slow) if c in ALIKE else c for c in CASES]
)
def test_members_are_those_of_the_cpu(case: str) -> None:
    make, t_end, arguments = CASES[case]
    model = make()
    ours = simulate_many(model, t_end, backend="cuda", **arguments)
    assert_same(ours, simulate_many(model, t_end, backend="compiled", **arguments))
    one_fails = {"jams": "friction jams", "too many": Status.MAX_STEPS.value}
    for word, message in one_fails.items():
        if word in case:
            assert list(ours.failed) == [1]
            assert message in ours.failed[1]
    if not any(word in case for word in ("fail", "assembled", "unknowns start", *one_fails)):
        assert not ours.failed
        assert ours.attempts.min() > 0


@cache
def belt() -> Model:
    return rabinowicz(LuGre())


@cache
def swing() -> Model:
    return oscillator()


def members(backend: str = "cuda") -> Any:
    return simulate_many(
        belt(), 9.0, x0={"v": VELOCITIES}, t_eval=[0.0, 2.71, 9.0], backend=backend
    )


def test_threads_launches_and_memory_change_nothing(
    cupy: FakeCupy, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = members("compiled")
    assert_same(members(), expected)
    assert cupy.launches[0] == ((1,), (BLOCK,))
    assert cupy.waited == len(cupy.launches)
    assert all(module == cupy.modules[0] for module in cupy.modules)
    assert (cupy.modules[0]["options"], cupy.modules[0]["backend"]) == (("--fmad=false",), "nvrtc")
    assert "#include" not in cupy.modules[0]["code"]
    for most in (1, 3):
        cupy.most = most
        assert_same(members(), expected)
    cupy.room = 1000  # members in parts
    assert_same(members(), expected)
    cupy.room, cupy.largest = 2**30, 300  # another process took the rest meanwhile
    before = len(cupy.launches)
    assert_same(members(), expected)
    assert len(cupy.launches) > before + 2
    cupy.largest = 10
    with pytest.raises(MemoryError):
        members()
    cupy.largest, cupy.most, cupy.todo = 2**30, 4, []
    monkeypatch.setattr(OnDevice, "launched", lambda self, spent: None)
    assert_same(members(), expected)
    assert cupy.todo[0] == 7
    assert cupy.todo == sorted(cupy.todo, reverse=True)  # finished members are left out
    assert len(cupy.todo) >= expected.attempts.sum() / 128  # four threads of 32 attempts


def test_the_budget_of_a_launch_approaches_its_time() -> None:
    own = integrator(swing())
    device = OnDevice.of(own, np.array([0.0, 1.0]), np.array([1.0]), 100, "double")
    budgets = [device.budget]
    for spent in (1e-9, 0.125, 0.5, 2.5):
        device.launched(spent)
        budgets.append(device.budget)
    assert budgets == [32, 128, 256, 128, 12]


def test_chunks_change_nothing_and_progress_rises_between_launches() -> None:
    reported: list[float] = []
    whole = simulate_many(swing(), 1.0, **TWENTY)
    for progress in (None, reported.append):
        assert_same(simulate_many(swing(), 1.0, chunk=6, progress=progress, **TWENTY), whole)
    assert reported == sorted(reported)
    assert set(reported) >= {0.3, 0.6, 0.9, 1.0}


def test_an_interrupt_keeps_finished_chunks_and_a_folder_continues(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = TWENTY | {"chunk": 4, "out": tmp_path}
    many = simulate_many(swing(), 1.0, progress=after(3), **given)
    assert many.status is Status.INTERRUPTED
    finished = np.isfinite(many["x"][:, 0])
    assert 4 <= finished.sum() < 20
    np.testing.assert_array_equal(finished, np.isfinite(many.reached))
    again = simulate_many(swing(), 1.0, **given)
    assert again.status is Status.SUCCESS
    assert_same(again, simulate_many(swing(), 1.0, **TWENTY | {"chunk": 4}))
    assert len(list(tmp_path.iterdir())) == 1
    monkeypatch.setattr(OnDevice, "launched", lambda self, spent: setattr(self, "budget", 5))
    many = simulate_many(swing(), 1.0, progress=after(1), **TWENTY)  # between two launches
    assert many.status is Status.INTERRUPTED
    assert np.isnan(many.reached).all()


def test_the_size_of_a_chunk_depends_on_its_work_and_its_results() -> None:
    own = integrator(swing())
    kernel = Kernel("", DOUBLE, rows=7, given=5, states=2, signals=4, operations=800)
    for times, real, size in (
        (1, "double", 2**30 // 800),
        (10_000, "double", 2**30 // (8 * 40_012)),
        (10_000, "float", 2**30 // (4 * 40_012)),
        (10**9, "double", 1),
    ):
        task = OnDevice.of(own, np.array([0.0, 1.0]), np.array([1.0]), 100, real)
        task.kernel = replace(kernel, real=REALS[real])
        task.job = replace(task.job, times=np.broadcast_to(1.0, (times,)))
        assert task.chunk(SimpleNamespace(own={})) == size  # type: ignore[arg-type]
    stretch: Any = SimpleNamespace(times=np.zeros((1, 3)), data=np.zeros((1, 5)))
    assert member_bytes(kernel, stretch) == 8 * (7 + 5 + 2 * 2 + 3 * 4) + 8 * 4 + 4 * 4


def test_the_device_of_cupy(cupy: FakeCupy, monkeypatch: pytest.MonkeyPatch) -> None:
    device = Device.found()
    assert device.name == "Fake 100"
    # 94 registers of 32 threads are 3072 of 65536: 21 warps, 10 blocks of 64 threads
    assert device.threads(94) == 3 * 640
    assert device.threads(0) == device.threads(8) == 3 * 2048
    assert device.threads(255) == 3 * 256
    cupy.refuses = True
    with pytest.raises(DeviceError, match=r"NVRTC did not compile.*identifier is undefined\)"):
        members()
    cupy.refuses, cupy.broken = False, True
    with pytest.raises(DeviceError, match=r"processor stopped \(cudaErrorLaunchTimeout"):
        members()
    driver = r"needs a graphics processor of NVIDIA.*{}.*nvidia-"
    for module, why in (
        (FakeCupy(0), driver.format("no device found")),
        (FakeCupy(-1), driver.format("CUDA driver version is insufficient")),
        (None, r"needs CuPy .*; pip install 'symfric\[cuda\]', or use"),
    ):
        monkeypatch.setitem(sys.modules, "cupy", module)
        with pytest.raises(DeviceError, match=why):
            members()
    assert not members("auto").failed  # which never uses it


STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror")
COMPILERS = {
    "gcc": ("-std=c99", "-x", "c"), "clang": ("-std=c99", "-x", "c"),
    "g++": ("-std=c++17", "-x", "c++"),
}  # fmt: skip


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_kernel_is_c_and_cpp_without_a_warning(compiler: str) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    for model, real in ((root(), "double"), (switched(), "float")):
        kernel = kernel_of(integrator(model), model.name == "switched", REALS[real])
        subprocess.run(
            [compiler, *COMPILERS[compiler], *STRICT, "-fsyntax-only", "-"],
            input=f"{ON_HOST}{kernel.text}{LAUNCH_ON_HOST}", text=True, check=True,
        )  # fmt: skip


def test_the_kernel_has_only_what_it_needs() -> None:
    own = integrator(rabinowicz(BrownMcPhee()))
    between, ends = kernel_of(own), kernel_of(own, between=False)
    assert between is kernel_of(own)
    assert ends.operations < between.operations
    assert "real *D)" not in ends.text
    for kernel in (between, ends):
        assert "symfric_round(const" not in kernel.text
        assert "#define FOLLOWS 0" in kernel.text
    follows = kernel_of(integrator(switched()))
    assert "symfric_round(const" in follows.text
    assert "#define FOLLOWS 2" in follows.text
    single = kernel_of(own, real=REALS["float"])
    attempt = single.text[single.text.index("symfric_attempt(") : single.text.index("#define N ")]
    assert "double" not in attempt
    assert "1.1754944e-38f" in attempt
    assert "#define SF_POWF powf" in single.text


@pytest.mark.slow
@pytest.mark.parametrize("law", [BrownMcPhee(), LuGre()], ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("name", ALL_SCENES)
def test_all_scenes_have_the_bits_of_the_cpu(name: str, law: Law) -> None:
    """The arm compiles for half a minute."""
    made = ALL_SCENES[name](law).model()
    x = made.x[0]
    x0 = {x.name: float(x.start) + np.array([-0.01, 0.0, 0.01])}
    arguments: dict[str, Any] = {"x0": x0, "t_eval": np.linspace(0.0, 0.3, 4)}
    ours = simulate_many(made, 0.3, backend="cuda", **arguments)
    assert_same(ours, simulate_many(made, 0.3, backend="compiled", **arguments))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["quarter_car", "pendulum_box", "slider_crank"])
def test_single_precision_follows_double(name: str) -> None:
    made = ALL_SCENES[name](BrownMcPhee()).model()
    x, t = made.x[0], np.linspace(0.0, 1.0, 5)
    x0 = {x.name: float(x.start) + np.array([-0.01, 0.0, 0.01])}
    exact = simulate_many(made, 1.0, x0=x0, t_eval=t, rtol=1e-9, backend="vm")
    with pytest.warns(UserWarning, match=r"rtol = 0\.0001 is above"):
        double, single = (
            simulate_many(made, 1.0, x0=x0, t_eval=t, rtol=1e-4, backend="cuda", real=real)
            for real in ("double", "float")
        )
    assert single.attempts == pytest.approx(double.attempts, rel=0.1)
    for v in made.x:
        scale = np.abs(exact[v.name]).max()
        error = [np.abs(found[v.name] - exact[v.name]).max() for found in (double, single)]
        assert error[1] < 2 * error[0] + 1e-4 * scale
