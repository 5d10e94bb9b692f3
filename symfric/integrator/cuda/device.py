"""What runs a kernel: a graphics processor, or this machine in its place."""

import ctypes
from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from symfric.integrator.compiled.compiler import load
from symfric.integrator.cuda.kernel import NAME, Kernel

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
