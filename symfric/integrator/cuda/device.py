"""Graphics processor: the functions of CuPy that a run needs."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, final

import numpy as np

from symfric.integrator.cuda.kernel import AFTER, BEFORE, NAME, Kernel

BLOCK = 64
"""Number of threads of a block; small, since each thread holds hundreds of numbers."""
OPTIONS = ("--fmad=false",)
"""Compiler options. Every operation is rounded separately, as on the CPU, so tests on the CPU are
valid for the device up to the last digits of exp, sin, pow and similar functions.
"""
WARP, GRAIN = 32, 256
"""Number of threads of a warp, and the unit in which registers are allocated to a warp."""
MEANWHILE = "use backend='auto' meanwhile"


class DeviceError(RuntimeError):
    """Error for a missing or unusable graphics processor, or for a failure of the device."""


@final
@dataclass(frozen=True, eq=False)
class Device:
    """Current device of CuPy.

    Attributes:
        cupy: module `cupy`.
        name: name of the device.
        properties: properties as returned by `cudaGetDeviceProperties`.
    """

    cupy: Any
    name: str
    properties: dict[str, Any]

    @classmethod
    def found(cls) -> "Device":
        """Return the available device.

        Raises:
            DeviceError: no CuPy, no driver, or no device; the message names the cause.
        """
        try:
            cupy = import_module("cupy")
        except ImportError as error:
            raise DeviceError(
                f"simulate_many: backend='cuda' needs CuPy ({error}); pip install "
                f"'symfric[cuda]', or {MEANWHILE}"
            ) from None
        runtime = cupy.cuda.runtime
        try:
            if not int(runtime.getDeviceCount()):
                raise RuntimeError("no device found")
            properties = dict(runtime.getDeviceProperties(int(runtime.getDevice())))
        except RuntimeError as error:
            raise DeviceError(
                f"simulate_many: backend='cuda' needs a graphics processor of NVIDIA and its "
                f"driver, CuPy finds none ({error}); check the output of nvidia-smi, or {MEANWHILE}"
            ) from None
        name = properties["name"]
        return cls(cupy, name.decode() if isinstance(name, bytes) else str(name), properties)

    @property
    def free(self) -> int:
        """Free memory [bytes], including the pool of CuPy."""
        self.cupy.get_default_memory_pool().free_all_blocks()
        return int(self.cupy.cuda.runtime.memGetInfo()[0])

    def load(self, kernel: Kernel) -> "Loaded":
        """Compile a kernel, or load it from CuPy's cache.

        Raises:
            DeviceError: NVRTC is missing or rejects the kernel.
        """
        code = f"{BEFORE}{kernel.text}{AFTER}"
        module = self.cupy.RawModule(code=code, options=OPTIONS, backend="nvrtc")
        try:
            function = module.get_function(NAME)
        except (self.cupy.cuda.compiler.CompileException, RuntimeError, OSError) as error:
            reason = (str(error).strip() or type(error).__name__).splitlines()[0]
            raise DeviceError(
                f"simulate_many: backend='cuda': NVRTC did not compile the kernel ({reason}); "
                f"pip install 'symfric[cuda]' installs a matching version, or {MEANWHILE}"
            ) from None
        return Loaded(self.cupy, function, self.threads(int(function.num_regs)))

    def threads(self, registers: int) -> int:
        """Return the number of threads that run at once if each uses this number of registers."""
        p = self.properties
        of_warp = -(-max(1, registers) * WARP // GRAIN) * GRAIN
        warps = int(p["regsPerMultiprocessor"]) // of_warp
        threads = min(warps * WARP, int(p["maxThreadsPerMultiProcessor"])) // BLOCK * BLOCK
        return int(p["multiProcessorCount"]) * max(BLOCK, threads)


@final
@dataclass(frozen=True, eq=False)
class Loaded:
    """Kernel on the device.

    Attributes:
        cupy: module `cupy`.
        function: the kernel, a `RawKernel` of CuPy.
        threads: number of threads that run at once.
    """

    cupy: Any
    function: Any
    threads: int

    def __call__(self, many: bytes, threads: int) -> None:
        """Run up to `threads` threads on the data of the struct `many`, and wait for them.

        Raises:
            DeviceError: the device failed, for example by the time limit of a device that also
                drives a screen.
        """
        held = self.cupy.asarray(np.frombuffer(many, dtype=np.uint8))
        try:
            self.function((-(-min(threads, self.threads) // BLOCK),), (BLOCK,), (held,))
            self.cupy.cuda.get_current_stream().synchronize()
        except RuntimeError as error:  # base class of CuPy's errors
            raise DeviceError(
                f"simulate_many: the graphics processor stopped ({error}); complete chunks "
                "are in the folder `out`, if given"
            ) from None
