"""A module that is called like CuPy as far as symfric goes: arrays in the memory of this machine,
kernels compiled by its compiler; it records what is asked of it.
"""

import ctypes
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.compiler import load
from symfric.integrator.cuda import kernel

PROPERTIES = {
    "name": b"Fake 100", "multiProcessorCount": 3, "maxThreadsPerMultiProcessor": 2048,
    "regsPerMultiprocessor": 65536,
}  # fmt: skip


class FakeArray:
    """As far as needed, `cupy.ndarray`."""

    def __init__(self, array: NDArray[Any]) -> None:
        self._array = array
        self.data = SimpleNamespace(ptr=array.ctypes.data)

    def get(self) -> NDArray[Any]:
        return self._array.copy()


class FakeFunction:
    """As far as needed, `cupy.RawKernel`."""

    num_regs = 94

    def __init__(self, module: "FakeCupy", code: str) -> None:
        self.module = module
        begin, end = kernel.ON_DEVICE, code[code.index('\nextern "C" __global__') :]
        assert code.startswith(begin)
        text = code.removeprefix(begin).removesuffix(end)
        whole = f"{kernel.ON_HOST}{text}{kernel.LAUNCH_ON_HOST.substitute(name=kernel.NAME)}"
        self.library = load(whole, kernel.NAME)

    def __call__(self, grid: tuple[int], block: tuple[int], arguments: tuple[FakeArray]) -> None:
        self.module.launches.append((grid, block))
        if self.module.broken:
            raise RuntimeError("cudaErrorLaunchTimeout: the launch timed out")
        (held,) = arguments
        self.library.symfric_launch(
            ctypes.c_void_p(held.data.ptr), ctypes.c_longlong(grid[0] * block[0])
        )


class FakeCupy:
    """As far as needed, the module `cupy`."""

    class CompileException(Exception):  # noqa: N818
        """As CuPy's, not a RuntimeError."""

    def __init__(self, devices: int = 1, free: int = 2**30) -> None:
        self.modules: list[dict[str, Any]] = []
        self.launches: list[tuple[tuple[int], tuple[int]]] = []
        self.room, self.broken, self.refuses = free, False, False
        self.waited = 0
        runtime = SimpleNamespace(
            getDeviceCount=lambda: self._count(devices),
            getDevice=lambda: 0,
            getDeviceProperties=lambda _: PROPERTIES,
            memGetInfo=lambda: (self.room, 2 * self.room),
        )
        self.cuda = SimpleNamespace(
            runtime=runtime,
            compiler=SimpleNamespace(CompileException=self.CompileException),
            get_current_stream=lambda: SimpleNamespace(synchronize=self._wait),
        )

    def _count(self, devices: int) -> int:
        if devices < 0:
            raise RuntimeError("cudaErrorInsufficientDriver: CUDA driver version is insufficient")
        return devices

    def _wait(self) -> None:
        self.waited += 1

    def get_default_memory_pool(self) -> Any:
        return SimpleNamespace(free_all_blocks=lambda: None)

    def asarray(self, array: NDArray[Any]) -> FakeArray:
        if array.nbytes > self.room:
            raise MemoryError("out of memory")
        return FakeArray(np.array(array, order="C"))

    def full(self, shape: tuple[int, ...], value: float, dtype: Any) -> FakeArray:
        return FakeArray(np.full(shape, value, dtype))

    def RawModule(self, **asked: Any) -> Any:
        self.modules.append(asked)
        return SimpleNamespace(get_function=self._function)

    def _function(self, name: str) -> FakeFunction:
        assert name == kernel.NAME
        if self.refuses:
            raise self.CompileException("symfric.cu(1): error: identifier is undefined\nmore")
        return FakeFunction(self, self.modules[-1]["code"])
