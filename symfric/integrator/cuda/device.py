"""Graphics processors: what a run needs of one, one by CuPy, and NVRTC without any device.

NVRTC is in the package nvidia-cuda-nvrtc-cu12 (extra 'cuda-check') and needs neither driver nor
device. For an architecture such as compute_80 it makes PTX, for sm_80 the machine code, of which
its assembler tells registers and spills.
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
    """There is no graphics processor that could be used, or it refused its work."""


class Held(Protocol):
    """An array in the memory of a device."""

    @property
    def address(self) -> int:
        """Where it begins there."""
        ...

    def get(self) -> Numbers:
        """A copy here."""
        ...


class Loaded(Protocol):
    """A kernel that is ready to run."""

    @property
    def threads(self) -> int:
        """How many threads run at once."""
        ...

    def __call__(self, many: bytes, threads: int) -> None:
        """Run `threads` threads on what the struct `many` says, and wait for them."""
        ...


class Device(Protocol):
    """Takes kernels and arrays."""

    @property
    def name(self) -> str:
        """What it is."""
        ...

    @property
    def free(self) -> int:
        """Bytes of memory that are free."""
        ...

    def load(self, kernel: Kernel) -> Loaded:
        """Compile a kernel, or take it from a cache."""
        ...

    def put(self, array: Numbers) -> Held:
        """An array of its own, a copy of this one.

        Raises:
            MemoryError: there is no room for it.
        """
        ...

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> Held:
        """An array with one value everywhere; raises as `put` does."""
        ...


@final
@dataclass(frozen=True, eq=False)
class HostArray:
    """An array of this machine."""

    array: Numbers

    @property
    def address(self) -> int:
        """Where it begins."""
        return int(self.array.ctypes.data)

    def get(self) -> Numbers:
        """A copy."""
        return self.array.copy()


@final
@dataclass(frozen=True, eq=False)
class HostLoaded:
    """A kernel compiled for this machine."""

    library: ctypes.CDLL
    threads: int

    def __call__(self, many: bytes, threads: int) -> None:
        """Run the threads one after another."""
        held = ctypes.create_string_buffer(many, len(many))
        self.library.symfric_launch(held, threads)


@final
@dataclass(frozen=True, eq=False)
class HostDevice:
    """The processor in place of a graphics processor, for tests: the same text, thread by thread.

    Attributes:
        threads: how many threads it pretends to run at once.
        free: how much memory it pretends to have [bytes].
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
        """A copy."""
        return HostArray(np.array(array, order="C"))

    def full(self, shape: tuple[int, ...], value: float, kind: DTypeLike) -> HostArray:
        """An array with one value everywhere."""
        return HostArray(np.full(shape, value, kind))


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


ARCHITECTURE = "compute_80"
"""Of the first devices whose double precision is half as fast as single (A100)."""


STANDARD = "--std=c++14"
"""As CuPy has it by default."""


@final
@dataclass(frozen=True)
class Built:
    """What NVRTC made of a kernel.

    Attributes:
        text: PTX; "" where it made machine code.
        log: warnings, and what the assembler tells.
        registers: of a thread; 0 where it made PTX.
        stack: bytes of local memory of a thread for arrays and spills; 0 where it made PTX.
        spilled: bytes written to local memory because registers were too few.
    """

    text: str
    log: str
    registers: int = 0
    stack: int = 0
    spilled: int = 0


@cache
def library() -> ctypes.CDLL | None:
    """NVRTC, if it is installed."""
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
        DeviceError: NVRTC is not installed, or refuses the source; its first error is quoted.
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
            raise DeviceError(f"nvrtc: refused the kernel: {errors[0].strip()}")
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
    """What the assembler says of the kernel and the functions that it calls."""

    def most(pattern: str) -> int:
        return max(map(int, re.findall(pattern, log)), default=0)

    return Built(
        "",
        log,
        most(r"Used (\d+) registers"),
        most(r"(\d+) bytes cumulative stack size"),
        most(r"(\d+) bytes spill stores"),
    )
