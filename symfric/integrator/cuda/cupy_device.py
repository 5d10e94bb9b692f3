"""A graphics processor by CuPy, which compiles kernels through NVRTC and keeps what it made."""

from dataclasses import dataclass
from importlib import import_module
from typing import Any, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from symfric.integrator.cuda.device import DeviceError
from symfric.integrator.cuda.kernel import BLOCK, NAME, Kernel

Numbers = NDArray[Any]
OPTIONS = ("--fmad=false",)
"""As on the CPU every operation is rounded on its own: what the tests see there runs here, but for
the last digits of exp, sin, pow and the like."""
WARP, GRAIN = 32, 256
"""Threads of a warp; registers are given to a warp in multiples of this."""
MEANWHILE = "use backend='auto' meanwhile"


@final
@dataclass(frozen=True, eq=False)
class CupyArray:
    """An array in the memory of the device."""

    array: Any

    @property
    def address(self) -> int:
        """Where it begins there."""
        return int(self.array.data.ptr)

    def get(self) -> Numbers:
        """A copy here."""
        return np.asarray(self.array.get())


@final
@dataclass(frozen=True, eq=False)
class CupyLoaded:
    """A kernel on the device.

    Attributes:
        cupy: the module.
        function: its `RawKernel`.
        threads: how many run at once.
    """

    cupy: Any
    function: Any
    threads: int

    def __call__(self, many: bytes, threads: int) -> None:
        """Run the threads and wait for them.

        Raises:
            DeviceError: the device gave up, as after seconds where it draws a screen, too.
        """
        held = self.cupy.asarray(np.frombuffer(many, dtype=np.uint8))
        try:
            self.function((-(-threads // BLOCK),), (BLOCK,), (held,))
            self.cupy.cuda.get_current_stream().synchronize()
        except RuntimeError as error:  # CuPy's own are
            raise DeviceError(
                f"simulate_many: the graphics processor stopped ({error}); chunks that were "
                "complete are in the folder `out`, where one was given"
            ) from None


@final
@dataclass(frozen=True, eq=False)
class CupyDevice:
    """The current device of CuPy.

    Attributes:
        cupy: the module.
        name: of the device.
        properties: as `cudaGetDeviceProperties` gives them.
    """

    cupy: Any
    name: str
    properties: dict[str, Any]

    @classmethod
    def found(cls) -> "CupyDevice":
        """The device that is there.

        Raises:
            DeviceError: no CuPy, no driver, or no device; it says which.
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
            count = int(runtime.getDeviceCount())
            if not count:
                raise RuntimeError("it counts none")
            number = int(runtime.getDevice())
            properties = dict(runtime.getDeviceProperties(number))
        except RuntimeError as error:
            raise DeviceError(
                f"simulate_many: backend='cuda' needs a graphics processor of NVIDIA and its "
                f"driver, CuPy finds none ({error}); see what nvidia-smi says, or {MEANWHILE}"
            ) from None
        name = properties["name"]
        return cls(cupy, name.decode() if isinstance(name, bytes) else str(name), properties)

    @property
    def free(self) -> int:
        """Bytes that are free, those that CuPy keeps for later among them."""
        self.cupy.get_default_memory_pool().free_all_blocks()
        return int(self.cupy.cuda.runtime.memGetInfo()[0])

    def load(self, kernel: Kernel) -> CupyLoaded:
        """Compile a kernel, or take it from CuPy's cache.

        Raises:
            DeviceError: NVRTC is missing or refuses it.
        """
        module = self.cupy.RawModule(code=kernel.on_device, options=OPTIONS, backend="nvrtc")
        try:
            function = module.get_function(NAME)
        except (self.cupy.cuda.compiler.CompileException, RuntimeError, OSError) as error:
            said = (str(error).strip() or type(error).__name__).splitlines()
            raise DeviceError(
                f"simulate_many: backend='cuda': NVRTC did not compile the kernel ({said[0]}); "
                f"pip install 'symfric[cuda]' brings one that fits, or {MEANWHILE}"
            ) from None
        return CupyLoaded(self.cupy, function, self._threads(int(function.num_regs)))

    def _threads(self, registers: int) -> int:
        """How many threads with so many registers run at once."""
        p = self.properties
        of_warp = -(-max(1, registers) * WARP // GRAIN) * GRAIN
        warps = int(p["regsPerMultiprocessor"]) // of_warp
        threads = min(warps * WARP, int(p["maxThreadsPerMultiProcessor"])) // BLOCK * BLOCK
        return int(p["multiProcessorCount"]) * max(BLOCK, threads)

    def put(self, array: Numbers) -> CupyArray:
        """A copy on the device; raises MemoryError."""
        return CupyArray(self.cupy.asarray(array))

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> CupyArray:
        """An array with one value everywhere; raises MemoryError."""
        return CupyArray(self.cupy.full(shape, value, kind))
