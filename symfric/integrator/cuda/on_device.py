"""Members of an ensemble on a graphics processor: the job of their chunks, and their launches."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from symfric.emitter.c99 import REALS
from symfric.integrator.cuda.device import CupyDevice, Device, Held, Loaded
from symfric.integrator.cuda.kernel import Kernel, kernel_of
from symfric.integrator.many.chunk import Job
from symfric.integrator.many.members import Advanced, Counts, Stretch
from symfric.integrator.many.program import program
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.integrator.step.layout import State
from symfric.model import Model

Array = NDArray[np.float64]
FRESH = 8
"""Reason of a member that was not started (`members.h`)."""
FIRST, LAUNCH = 32, 0.25
"""Attempts in the first launch of a thread, and intended duration [s] of later ones: far below the
seconds after which a system resets a graphics processor, and short enough for interrupts.
"""
FASTER = 4.0
"""Largest ratio of the budget of a launch to the one before."""
SHARE = 0.8
"""Fraction of the free memory of a device that members may take."""

_POINTER, _COUNT = ctypes.c_void_p, ctypes.c_longlong


class Many(ctypes.Structure):
    """Struct `Many` of members.h."""

    _fields_ = (
        ("S", _POINTER), ("R", _POINTER), ("t", _POINTER), ("members", _COUNT),
        ("breaks", _POINTER), ("intervals", _COUNT),
        ("data", _POINTER), ("n_data", _COUNT), ("data_step", _COUNT),
        ("ends", _POINTER), ("h_min", _POINTER),
        ("times", _POINTER), ("n_times", _COUNT), ("times_step", _COUNT), ("max_attempts", _COUNT),
        ("follow", _COUNT),
        ("out", _POINTER), ("reason", _POINTER), ("made", _POINTER), ("reach", _POINTER),
        ("interval", _POINTER), ("next", _POINTER),
        ("todo", _POINTER), ("n_todo", _COUNT), ("budget", _COUNT), ("ticket", _POINTER),
    )  # fmt: skip


@final
@dataclass(eq=False)
class DeviceMembers:
    """Members on a device, one per thread; see `symfric.integrator.many.members.Members`.

    Mutable in its counters, for reports and tests.

    Attributes:
        kernel: source and sizes.
        device: that runs it.
        loaded: the kernel on the device.
        tell: called between launches with the number of finished members of this call.
        launches: number of launches.
        budget: attempts of a thread in the next launch.
    """

    kernel: Kernel
    device: Device
    loaded: Loaded
    tell: Callable[[int], None] | None = None
    launches: int = 0
    budget: int = FIRST

    @classmethod
    def of(cls, kernel: Kernel, device: Device) -> "DeviceMembers":
        """Compile a kernel for its members; raises as `Device.load`."""
        return cls(kernel, device, device.load(kernel))

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch, as many at once as fit in the device memory.

        Raises:
            DeviceError: an error of the device.
            MemoryError: not enough memory for a single member.
            KeyboardInterrupt: Ctrl-C, between two launches.
        """
        count = S.shape[0]
        shape = (count, stretch.times.shape[1], self.kernel.signals)
        found, reason = np.empty(shape), np.empty(count, dtype=np.int64)
        reach = np.stack([S[:, State.Y]] * 2, axis=1)
        first, most = 0, self._most(stretch)
        while first < count:
            pick = slice(first, min(first + most, count))
            try:
                part = _Part.of(self, pick, (S, R, made, reach), stretch)
            except MemoryError:
                if most == 1:
                    raise
                most = (most + 1) // 2  # another process took some memory
                continue
            part.whole()
            found[pick], reason[pick] = part.results(S[pick], made[pick], reach[pick])
            first = pick.stop
        return found, reason, reach

    def _most(self, stretch: Stretch) -> int:
        """Return the number of members that fit in memory."""
        return max(1, int(SHARE * self.device.free / member_bytes(self.kernel, stretch)))

    def launched(self, spent: float) -> None:
        """Count a launch that took `spent` seconds, and set the budget of the next one."""
        self.launches += 1
        factor = LAUNCH / max(spent, LAUNCH / FASTER)
        self.budget = max(1, int(self.budget * min(factor, FASTER)))


def member_bytes(kernel: Kernel, stretch: Stretch) -> int:
    """Return the memory of a member on a device [bytes]."""
    numbers = kernel.rows + kernel.given + 2 * kernel.states
    numbers += stretch.times.shape[1] * kernel.signals
    numbers += stretch.data[0].size if stretch.data.shape[0] > 1 else 0
    doubles = 3 + (stretch.times.shape[1] if stretch.times.shape[0] > 1 else 0)
    return kernel.real.size * numbers + 8 * (doubles + 1) + 4 * 4


@final
@dataclass(frozen=True, eq=False)
class _Part:
    """Members that are on the device together.

    Attributes:
        of_all: runs them.
        count: number of members.
        held: their arrays there, by the names of the struct.
        numbers: its other fields.
    """

    of_all: DeviceMembers
    count: int
    held: dict[str, Held]
    numbers: dict[str, int]

    @classmethod
    def of(
        cls,
        members: DeviceMembers,
        pick: slice,
        columns: tuple[Array, Array, Counts, Array],
        stretch: Stretch,
    ) -> "_Part":
        """Copy members to the device; raises MemoryError."""
        device, kernel = members.device, members.kernel
        real: DTypeLike = np.float32 if kernel.real.size < 8 else np.float64
        S, R, made, reach = (column[pick] for column in columns)
        data = stretch.data[pick] if stretch.data.shape[0] > 1 else stretch.data
        times = stretch.times[pick] if stretch.times.shape[0] > 1 else stretch.times
        count = S.shape[0]
        given: dict[str, tuple[NDArray[Any], DTypeLike]] = {
            "S": (S.T, real), "R": (R.T, real), "t": (S[:, State.T], float),
            "breaks": (stretch.breaks, float), "data": (data, real),
            "ends": (stretch.ends[pick], float), "h_min": (stretch.h_min[pick], float),
            "times": (times, float), "made": (made, np.int64),
            "reach": (reach[:, :, : kernel.states].transpose(1, 2, 0), real),
        }  # fmt: skip
        held: dict[str, Held] = {
            name: device.put(np.ascontiguousarray(array, dtype=kind))
            for name, (array, kind) in given.items()
        }
        shape = (count, times.shape[1], kernel.signals)
        held["out"] = device.full(shape, np.nan, real)
        held["reason"] = device.full((count,), FRESH, np.int32)
        held["interval"] = device.full((count,), 0, np.int32)
        held["next"] = device.full((count,), 0, np.int32)
        numbers = {
            "members": count, "intervals": data.shape[2], "n_data": data.shape[1],
            "data_step": data[0].size if data.shape[0] > 1 else 0, "n_times": times.shape[1],
            "times_step": times.shape[1] if times.shape[0] > 1 else 0,
            "max_attempts": stretch.max_steps, "follow": int(stretch.follow),
        }  # fmt: skip
        return cls(members, count, held, numbers)

    def whole(self) -> None:
        """Launch until all members are finished.

        Unfinished members are regrouped: a warp with one member left would run for it alone.
        """
        all_, device, loaded = self.of_all, self.of_all.device, self.of_all.loaded
        todo = np.arange(self.count, dtype=np.int32)
        while todo.size:
            own = {"todo": device.put(todo), "ticket": device.full((1,), 0, np.int32)}
            many = Many(
                **{name: array.address for name, array in (self.held | own).items()},
                **self.numbers,
                n_todo=todo.size,
                budget=all_.budget,
            )
            began = perf_counter()
            loaded(bytes(many), min(todo.size, loaded.threads))
            all_.launched(perf_counter() - began)
            reason = self.held["reason"].get()
            begun, waiting = np.flatnonzero(reason == Stop.FULL), np.flatnonzero(reason == FRESH)
            todo = np.concatenate([begun, waiting]).astype(np.int32)
            if all_.tell is not None:
                all_.tell(self.count - todo.size)

    def results(self, S: Array, made: Counts, reach: Array) -> tuple[Array, Counts]:
        """Return signals and reasons; overwrite S, made and reach."""
        S[:] = self.held["S"].get().T
        S[:, State.T] = self.held["t"].get()
        made[:] = self.held["made"].get()
        kept = self.held["reach"].get().transpose(2, 0, 1)
        reach[:, :, : kept.shape[2]] = kept
        return self.held["out"].get(), self.held["reason"].get().astype(np.int64)


WHERE = "simulate_many: backend='cuda'"
OPERATIONS, BYTES = 2**30, 2**30
"""Limits on the operations of one attempt of all members of a chunk, and on their results and data
[bytes]: small members fill all threads of the largest devices several times, and chunks of large
ones are small enough to keep results after an interrupt.
"""
LOOSEST = 1e-5
"""Smallest relative tolerance that single precision meets."""


def find_device() -> Device:
    """Return the graphics processor of this machine.

    Raises:
        DeviceError: no device, or no CuPy.
    """
    return CupyDevice.found()


def check(model: Model, executor: object, workers: object, rtol: float, real: str) -> None:
    """Check that a device supports the arguments.

    Raises:
        ValueError: a model with events, an executor, too tight a tolerance for single precision.
    """
    if model.events:
        names = ", ".join(event.name for event in model.events)
        raise ValueError(
            f"{WHERE}: expected a model without events, got '{model.name}' with {names}; use "
            "backend='compiled'"
        )
    if executor not in ("threads", "serial") or workers is not None:
        given = f"workers = {workers}" if workers is not None else f"executor = {executor!r}"
        raise ValueError(f"{WHERE}: expected no executor and no workers (CPU options), got {given}")
    if real == "float" and rtol < LOOSEST:
        raise ValueError(
            f"{WHERE}: rtol: expected at least {LOOSEST:g} with real='float', got {rtol:g}; use "
            "real='double'"
        )


@final
@dataclass(frozen=True, eq=False)
class OnDevice:
    """Ensemble on a device.

    Attributes:
        job: data shared by all chunks.
        members: that run them.
    """

    job: Job
    members: DeviceMembers

    @classmethod
    def of(
        cls, integrator: Integrator, breaks: Array, times: Array, max_steps: int, real: str
    ) -> "OnDevice":
        """Build from an integrator; `times` are those of the results [s], as in `Job`.

        Raises:
            DeviceError: there is no device, or it rejects the kernel.
            ValueError: an operation that C does not have.
        """
        device = find_device()
        between = not np.isin(times, breaks).all()
        kernel = kernel_of(integrator, between, REALS[real])
        # the results depend on the code of the kernel
        own = replace(program(integrator, False), code=kernel.text)
        return cls(Job(own, breaks, times, max_steps), DeviceMembers.of(kernel, device))

    def chunk(self, own_data: int) -> int:
        """Return the number of members of a chunk with this many input data per member."""
        return chunk_of(self.members.kernel, max(1, self.job.times.size), own_data)

    def report(self, progress: Callable[[float], None], done: Callable[[], int], of: int) -> None:
        """Report progress between launches; `done()` counts the members in finished chunks."""
        most = 0.0

        def tell(now: int) -> None:
            nonlocal most
            fraction = min(1.0, (done() + now) / of)
            if fraction > most:  # progress never goes back when members are run again
                most = fraction
                progress(fraction)

        self.members.tell = tell


def chunk_of(kernel: Kernel, times: int, own_data: int) -> int:
    """Return the members of a chunk; equal on all devices, so that stored results are found
    again.
    """
    size = kernel.real.size * (kernel.rows + kernel.given + times * kernel.signals + own_data)
    return max(1, min(OPERATIONS // kernel.operations, BYTES // size))
