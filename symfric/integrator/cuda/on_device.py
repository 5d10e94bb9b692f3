"""Members of an ensemble on a graphics processor: the task of the chunks, and the launches."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from symfric.emitter.c99 import REALS
from symfric.foundation.numeric import Array
from symfric.integrator.cuda.device import Device, Kernel, Launch, kernel_of
from symfric.integrator.many.chunk import Chunk, Job, Solved
from symfric.integrator.many.member_data import MemberData
from symfric.integrator.many.members import Advanced, Counts, Program, Stretch, struct, with_code
from symfric.integrator.methods.attempt import SRow
from symfric.integrator.running.events import Stop
from symfric.integrator.running.integrator import Integrator
from symfric.model import Model

WHERE = "simulate_many: backend='cuda'"
FRESH = 8
"""Reason of a member that was not started (`members.h`)."""
FIRST, LAUNCH = 32, 0.25
"""Attempts of a thread in the first launch, and intended duration [s] of later launches: far below
the seconds after which a system resets a graphics processor, and short enough for interrupts.
"""
FASTER = 4.0
"""Largest ratio of the budget of a launch to that of the previous launch."""
SHARE = 0.8
"""Fraction of the free memory of a device that members may take."""
OPERATIONS, BYTES = 2**30, 2**30
"""Limits of a chunk: operations of one attempt of all members, and size of their results and data
[bytes]. Small members then fill all threads of the largest devices several times, and chunks of
large members are small enough to keep results after an interrupt.
"""
LOOSEST = 1e-5
"""Smallest relative tolerance that single precision meets."""
Many = struct(
    "S R t members breaks intervals data n_data data_step ends h_min times n_times times_step "
    "max_attempts follow out reason made reach interval next todo n_todo budget ticket"
)
"""Struct `Many` of members.h."""


def check(model: Model, executor: object, workers: object, rtol: float, real: str) -> None:
    """Check that a device supports the arguments.

    Raises:
        ValueError: a model with events, an executor or a number of workers, or a tolerance that is
            too tight for single precision.
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
@dataclass(eq=False)
class OnDevice:
    """Task on a device that runs one member per thread; only its progress is mutable.

    Attributes:
        job: data shared by all chunks.
        kernel: source and sizes of the kernel.
        device, launch: device that runs the members, and the kernel loaded on it.
        tell: function called between launches with the number of finished members of a chunk.
        budget: attempts of a thread in the next launch.
    """

    job: Job
    kernel: Kernel
    device: Device
    launch: Launch
    tell: Callable[[int], None] | None = None
    budget: int = FIRST

    @classmethod
    def of(
        cls, integrator: Integrator, breaks: Array, times: Array, max_steps: int, real: str
    ) -> "OnDevice":
        """Return the task of an integrator; `times` are the times of the results [s] as in `Job`.

        Raises:
            DeviceError: there is no device, or it rejects the kernel.
            ValueError: an operation that does not exist in C.
        """
        device = Device.found()
        between = not np.isin(times, breaks).all()
        kernel = kernel_of(integrator, between, REALS[real])
        job = Job(with_code(integrator, kernel.text), breaks, times, max_steps)
        return cls(job, kernel, device, device.load(kernel))

    @property
    def identity(self) -> Program:
        """Data that determine the results."""
        return self.job.program

    def solve(self, chunk: Chunk) -> Solved:
        """Integrate the members of a chunk."""
        return self.job.solve(chunk, self.run)

    def chunk(self, given: MemberData) -> int:
        """Return the number of members of a chunk.

        The number is equal on all devices, so that stored results are found again.
        """
        kernel, own = self.kernel, given.inputs.values.size if given.own else 0
        numbers = kernel.rows + kernel.given + max(1, self.job.times.size) * kernel.signals + own
        size = kernel.real.size * numbers
        return max(1, min(OPERATIONS // kernel.operations, BYTES // size))

    def report(self, progress: Callable[[float], None], done: Callable[[], int], of: int) -> None:
        """Report progress between launches; `done()` counts the members in finished chunks."""
        most = 0.0

        def tell(now: int) -> None:
            nonlocal most
            fraction = min(1.0, (done() + now) / of)
            if fraction > most:  # members may run again, but progress must not decrease
                most = fraction
                progress(fraction)

        self.tell = tell

    def run(self, S: Array, R: Array, made: Counts, stretch: Stretch) -> Advanced:
        """Advance members over a stretch, in groups that fit in the device memory.

        Raises:
            DeviceError: an error of the device.
            MemoryError: not enough memory for a single member.
            KeyboardInterrupt: Ctrl-C, between two launches.
        """
        count = S.shape[0]
        shape = (count, stretch.times.shape[1], self.kernel.signals)
        found, reason = np.empty(shape), np.empty(count, dtype=np.int64)
        reach = np.stack([S[:, SRow.Y]] * 2, axis=1)
        first, most = 0, max(1, int(SHARE * self.device.free / member_bytes(self.kernel, stretch)))
        while first < count:
            pick = slice(first, min(first + most, count))
            try:
                columns = S[pick], R[pick], made[pick], reach[pick]
                self._run(columns, part_of(stretch, pick), found[pick], reason[pick])
            except MemoryError:
                if most == 1:
                    raise
                most = (most + 1) // 2  # another process has taken some memory
                continue
            first = pick.stop
        return found, reason, reach

    def _run(
        self, columns: tuple[Array, Array, Counts, Array], stretch: Stretch, found: Array,
        reason: Counts,
    ) -> None:  # fmt: skip
        """Run a group of members on the device, and overwrite all arguments but the run data R.

        Raises:
            MemoryError: the members do not fit; the arguments are then unchanged.
        """
        (S, R, made, reach), cupy, states = columns, self.device.cupy, self.kernel.states
        real: DTypeLike = np.float32 if self.kernel.real.size < 8 else np.float64
        given: dict[str, tuple[NDArray[Any], DTypeLike]] = {
            "S": (S.T, real), "R": (R.T, real), "t": (S[:, SRow.T], float),
            "breaks": (stretch.breaks, float), "data": (stretch.data, real),
            "ends": (stretch.ends, float), "h_min": (stretch.h_min, float),
            "times": (stretch.times, float), "made": (made, np.int64),
            "reach": (reach[:, :, :states].transpose(1, 2, 0), real),
        }  # fmt: skip
        held: dict[str, Any] = {
            name: cupy.asarray(np.ascontiguousarray(array, dtype=kind))
            for name, (array, kind) in given.items()
        }
        held["out"] = cupy.full(found.shape, np.nan, real)
        held["reason"] = cupy.full(reason.shape, FRESH, np.int32)
        held |= {name: cupy.full(reason.shape, 0, np.int32) for name in ("interval", "next")}
        self._launch(held, stretch.numbers | {"members": reason.size})
        S[:] = held["S"].get().T
        S[:, SRow.T], made[:] = held["t"].get(), held["made"].get()
        reach[:, :, :states] = held["reach"].get().transpose(2, 0, 1)
        found[:], reason[:] = held["out"].get(), held["reason"].get()

    def _launch(self, held: dict[str, Any], numbers: dict[str, int]) -> None:
        """Launch the kernel until all members are finished.

        Unfinished members are regrouped, so that no warp runs for a single remaining member.
        """
        cupy, todo = self.device.cupy, np.arange(numbers["members"], dtype=np.int32)
        while todo.size:
            own = {"todo": cupy.asarray(todo), "ticket": cupy.full((1,), 0, np.int32)}
            addresses = {name: int(array.data.ptr) for name, array in (held | own).items()}
            many = Many(**addresses, **numbers, n_todo=todo.size, budget=self.budget)
            began = perf_counter()
            self.launch(bytes(many), todo.size)
            self.launched(perf_counter() - began)
            reason = held["reason"].get()
            begun, waiting = np.flatnonzero(reason == Stop.FULL), np.flatnonzero(reason == FRESH)
            todo = np.concatenate([begun, waiting]).astype(np.int32)
            if self.tell is not None:
                self.tell(numbers["members"] - todo.size)

    def launched(self, spent: float) -> None:
        """Set the budget of the next launch; the previous one took `spent` seconds."""
        factor = LAUNCH / max(spent, LAUNCH / FASTER)
        self.budget = max(1, int(self.budget * min(factor, FASTER)))


def part_of(stretch: Stretch, pick: slice) -> Stretch:
    """Return the stretch of some of its members."""
    data, times = (a[pick] if a.shape[0] > 1 else a for a in (stretch.data, stretch.times))
    ends, h_min = stretch.ends[pick], stretch.h_min[pick]
    return replace(stretch, data=data, times=times, ends=ends, h_min=h_min)


def member_bytes(kernel: Kernel, stretch: Stretch) -> int:
    """Return the memory of a member on a device [bytes]."""
    numbers = kernel.rows + kernel.given + 2 * kernel.states
    numbers += stretch.times.shape[1] * kernel.signals
    numbers += stretch.data[0].size if stretch.data.shape[0] > 1 else 0
    doubles = 3 + (stretch.times.shape[1] if stretch.times.shape[0] > 1 else 0)
    return kernel.real.size * numbers + 8 * (doubles + 1) + 4 * 4
