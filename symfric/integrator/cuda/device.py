"""Graphics processors: the interface a run needs, its implementation with CuPy, and NVRTC.

NVRTC is in the package nvidia-cuda-nvrtc-cu12 (extra 'cuda-check') and needs neither driver nor
device. For an architecture such as compute_80 it generates PTX, for sm_80 machine code, whose
assembler reports registers and spills.
"""

import ctypes
import re
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from symfric.integrator.compiled.compiler import load
from symfric.integrator.cuda.kernel import BLOCK, NAME, Kernel

Numbers = NDArray[Any]


class DeviceError(RuntimeError):
    """Missing or unusable graphics processor, or an error of the device."""


class Held(Protocol):
    """Array in the memory of a device."""

    @property
    def address(self) -> int:
        """Address of the array on the device."""
        ...

    def get(self) -> Numbers:
        """Return a copy on the host."""
        ...


class Loaded(Protocol):
    """Kernel that is ready to run."""

    @property
    def threads(self) -> int:
        """Number of threads that run at once."""
        ...

    def __call__(self, many: bytes, threads: int) -> None:
        """Run `threads` threads on the data of the struct `many`, and wait for them."""
        ...


class Device(Protocol):
    """Device that loads kernels and stores arrays."""

    @property
    def name(self) -> str:
        """Name of the device."""
        ...

    @property
    def free(self) -> int:
        """Free memory [bytes]."""
        ...

    def load(self, kernel: Kernel) -> Loaded:
        """Compile a kernel, or load it from a cache."""
        ...

    def put(self, array: Numbers) -> Held:
        """Return a copy of the array on the device.

        Raises:
            MemoryError: there is not enough memory.
        """
        ...

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> Held:
        """Return an array with one value everywhere; raises as `put` does."""
        ...


@final
@dataclass(frozen=True, eq=False)
class HostArray:
    """Array on this machine."""

    array: Numbers

    @property
    def address(self) -> int:
        """Address of the array."""
        return int(self.array.ctypes.data)

    def get(self) -> Numbers:
        """Return a copy."""
        return self.array.copy()


@final
@dataclass(frozen=True, eq=False)
class HostLoaded:
    """Kernel compiled for this machine."""

    library: ctypes.CDLL
    threads: int

    def __call__(self, many: bytes, threads: int) -> None:
        """Run the threads one after another."""
        held = ctypes.create_string_buffer(many, len(many))
        self.library.symfric_launch(held, threads)


@final
@dataclass(frozen=True, eq=False)
class HostDevice:
    """Processor in place of a graphics processor, for tests: the same text, thread by thread.

    Attributes:
        threads: simulated number of threads that run at once.
        free: simulated free memory [bytes].
    """

    threads: int = 64
    free: int = 2**30
    name: str = "this machine, in place of a graphics processor"

    def load(self, kernel: Kernel) -> HostLoaded:
        """Compile a kernel, or load it from the cache.

        Raises:
            CompileError: no compiler, or it failed.
        """
        library = load(kernel.on_host, NAME)
        library.symfric_launch.argtypes = [ctypes.c_void_p, ctypes.c_longlong]
        library.symfric_launch.restype = None
        return HostLoaded(library, self.threads)

    def put(self, array: Numbers) -> HostArray:
        """Return a copy."""
        return HostArray(np.array(array, order="C"))

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> HostArray:
        """Return an array with one value everywhere."""
        return HostArray(np.full(shape, value, kind))


OPTIONS = ("--fmad=false",)
"""Compiler options: as on the CPU every operation is rounded separately, so tests on the CPU cover
the device up to the last digits of exp, sin, pow and the like.
"""
WARP, GRAIN = 32, 256
"""Threads of a warp; registers are allocated to a warp in multiples of this."""
MEANWHILE = "use backend='auto' meanwhile"


@final
@dataclass(frozen=True, eq=False)
class CupyArray:
    """Array in the memory of the device."""

    array: Any

    @property
    def address(self) -> int:
        """Address of the array on the device."""
        return int(self.array.data.ptr)

    def get(self) -> Numbers:
        """Return a copy on the host."""
        return np.asarray(self.array.get())


@final
@dataclass(frozen=True, eq=False)
class CupyLoaded:
    """Kernel on the device.

    Attributes:
        cupy: the module.
        function: its `RawKernel`.
        threads: number that run at once.
    """

    cupy: Any
    function: Any
    threads: int

    def __call__(self, many: bytes, threads: int) -> None:
        """Run the threads and wait for them.

        Raises:
            DeviceError: the device failed, for example by a time limit on one that also drives a
            screen.
        """
        held = self.cupy.asarray(np.frombuffer(many, dtype=np.uint8))
        try:
            self.function((-(-threads // BLOCK),), (BLOCK,), (held,))
            self.cupy.cuda.get_current_stream().synchronize()
        except RuntimeError as error:  # base class of CuPy's errors
            raise DeviceError(
                f"simulate_many: the graphics processor stopped ({error}); complete chunks "
                "are in the folder `out`, if given"
            ) from None


@final
@dataclass(frozen=True, eq=False)
class CupyDevice:
    """Current device of CuPy.

    Attributes:
        cupy: the module.
        name: of the device.
        properties: as returned by `cudaGetDeviceProperties`.
    """

    cupy: Any
    name: str
    properties: dict[str, Any]

    @classmethod
    def found(cls) -> "CupyDevice":
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
            count = int(runtime.getDeviceCount())
            if not count:
                raise RuntimeError("no device found")
            number = int(runtime.getDevice())
            properties = dict(runtime.getDeviceProperties(number))
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

    def load(self, kernel: Kernel) -> CupyLoaded:
        """Compile a kernel, or load it from CuPy's cache.

        Raises:
            DeviceError: NVRTC is missing or rejects it.
        """
        module = self.cupy.RawModule(code=kernel.on_device, options=OPTIONS, backend="nvrtc")
        try:
            function = module.get_function(NAME)
        except (self.cupy.cuda.compiler.CompileException, RuntimeError, OSError) as error:
            said = (str(error).strip() or type(error).__name__).splitlines()
            raise DeviceError(
                f"simulate_many: backend='cuda': NVRTC did not compile the kernel ({said[0]}); "
                f"pip install 'symfric[cuda]' installs a matching version, or {MEANWHILE}"
            ) from None
        return CupyLoaded(self.cupy, function, self._threads(int(function.num_regs)))

    def _threads(self, registers: int) -> int:
        """Return the number of threads that run at once with this number of registers."""
        p = self.properties
        of_warp = -(-max(1, registers) * WARP // GRAIN) * GRAIN
        warps = int(p["regsPerMultiprocessor"]) // of_warp
        threads = min(warps * WARP, int(p["maxThreadsPerMultiProcessor"])) // BLOCK * BLOCK
        return int(p["multiProcessorCount"]) * max(BLOCK, threads)

    def put(self, array: Numbers) -> CupyArray:
        """Return a copy on the device; raises MemoryError."""
        return CupyArray(self.cupy.asarray(array))

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> CupyArray:
        """Return an array with one value everywhere; raises MemoryError."""
        return CupyArray(self.cupy.full(shape, value, kind))


ARCHITECTURE = "compute_80"
"""Architecture of the first devices whose double precision is half as fast as single (A100)."""


STANDARD = "--std=c++14"
"""Language standard, the default of CuPy."""


@final
@dataclass(frozen=True)
class Built:
    """Output of NVRTC for a kernel.

    Attributes:
        text: PTX; "" for machine code.
        log: warnings and assembler output.
        registers: of a thread; 0 for PTX.
        stack: bytes of local memory of a thread for arrays and spills; 0 for PTX.
        spilled: bytes written to local memory because registers were too few.
    """

    text: str
    log: str
    registers: int = 0
    stack: int = 0
    spilled: int = 0


@cache
def library() -> ctypes.CDLL | None:
    """Return NVRTC if it is installed, else None."""
    found = find_spec("nvidia")
    places = [] if found is None else list(found.submodule_search_locations or [])
    for place in places:
        for path in sorted(Path(place).glob("*/lib/libnvrtc.so*")):
            return ctypes.CDLL(str(path))
    return None


def build(source: str, architecture: str = ARCHITECTURE) -> Built:
    """Compile CUDA C++.

    Args:
        source: without a header.
        architecture: compute_80 and the like for PTX, sm_80 for machine code and its registers.

    Raises:
        DeviceError: NVRTC is not installed, or rejects the source; its first error is quoted.
    """
    nvrtc = library()
    if nvrtc is None:
        raise DeviceError("nvrtc: expected NVRTC, found none; pip install 'symfric[cuda-check]'")
    handle = ctypes.c_void_p()
    _check(nvrtc.nvrtcCreateProgram(
        ctypes.byref(handle), source.encode(), b"symfric.cu", 0, None, None
    ))  # fmt: skip
    try:
        options = [f"--gpu-architecture={architecture}", STANDARD, *OPTIONS]
        machine = architecture.startswith("sm_")
        if machine:
            options.append("--ptxas-options=-v")
        every = (ctypes.c_char_p * len(options))(*(o.encode() for o in options))
        status = nvrtc.nvrtcCompileProgram(handle, len(options), every)
        log = _text(nvrtc, handle, "ProgramLog")
        if status:
            errors = [line for line in log.splitlines() if "error" in line] or [f"status {status}"]
            raise DeviceError(f"nvrtc: rejected the kernel: {errors[0].strip()}")
        if machine:
            return _measured(log)
        return Built(_text(nvrtc, handle, "PTX"), log)
    finally:
        nvrtc.nvrtcDestroyProgram(ctypes.byref(handle))


def _check(status: int) -> None:
    if status:
        raise DeviceError(f"nvrtc: status {status}")


def _text(nvrtc: ctypes.CDLL, handle: ctypes.c_void_p, what: str) -> str:
    size = ctypes.c_size_t()
    _check(getattr(nvrtc, f"nvrtcGet{what}Size")(handle, ctypes.byref(size)))
    room = ctypes.create_string_buffer(max(1, size.value))
    _check(getattr(nvrtc, f"nvrtcGet{what}")(handle, room))
    return room.value.decode(errors="replace")


def _measured(log: str) -> Built:
    """Read the assembler's report on the kernel and the functions that it calls."""

    def most(pattern: str) -> int:
        return max(map(int, re.findall(pattern, log)), default=0)

    return Built(
        "",
        log,
        most(r"Used (\d+) registers"),
        most(r"(\d+) bytes cumulative stack size"),
        most(r"(\d+) bytes spill stores"),
    )
