"""Stand-in for CuPy: arrays in the memory of this machine, kernels compiled by its compiler."""

import ctypes
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symfric.integrator.compiled.compiler import load
from symfric.integrator.cuda.device import AFTER, BEFORE, NAME

ON_HOST = """#include <math.h>
#include <stdbool.h>
#define DEVICE inline
#define BESIDE
#define TICKET(count) ((*(count))++)
"""
LAUNCH_ON_HOST = f"""
/* Runs the threads one after another. */
void {NAME}(const Many *all, long long threads)
{{
    for (long long i = 0; i < threads; ++i) symfric_thread(all);
}}
"""
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


class FakeCupy:
    """As far as needed, the module `cupy`; it records its calls.

    `most` limits the threads of a launch, which a device takes from its properties.
    """

    class CompileException(Exception):  # noqa: N818
        """As CuPy's, not a RuntimeError."""

    def __init__(self, devices: int = 1, free: int = 2**30, most: int | None = None) -> None:
        self.modules: list[dict[str, Any]] = []
        self.launches: list[tuple[tuple[int], tuple[int]]] = []
        self.todo: list[int] = []
        self.room, self.largest, self.most = free, free, most
        self.broken, self.refuses, self.waited = False, False, 0
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
        if array.nbytes > self.largest:
            raise MemoryError("out of memory")
        if array.dtype == np.int32:
            self.todo.append(array.size)
        return FakeArray(np.array(array, order="C"))

    def full(self, shape: tuple[int, ...], value: float, dtype: Any) -> FakeArray:
        return FakeArray(np.full(shape, value, dtype))

    def RawModule(self, **given: Any) -> Any:
        self.modules.append(given)
        return SimpleNamespace(get_function=self._function)

    def _function(self, name: str) -> Any:
        assert name == NAME
        if self.refuses:
            raise self.CompileException("symfric.cu(1): error: identifier is undefined\nmore")
        code = self.modules[-1]["code"]
        assert code.startswith(BEFORE) and code.endswith(AFTER)
        text = code.removeprefix(BEFORE).removesuffix(AFTER)
        library = load(f"{ON_HOST}{text}{LAUNCH_ON_HOST}", NAME)

        def launch(grid: tuple[int], block: tuple[int], arguments: tuple[FakeArray]) -> None:
            self.launches.append((grid, block))
            if self.broken:
                raise RuntimeError("cudaErrorLaunchTimeout: the launch timed out")
            threads = min(self.most or 2**60, grid[0] * block[0])
            library.symfric_launch(
                ctypes.c_void_p(arguments[0].data.ptr), ctypes.c_longlong(threads)
            )

        launch.num_regs = 94  # type: ignore[attr-defined]
        return launch
