"""What `simulate_many` needs for backend="cuda": the job of its chunks, and who runs them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from symfric.emitter.c99 import REALS
from symfric.integrator.cuda.cupy_device import CupyDevice
from symfric.integrator.cuda.device import Device
from symfric.integrator.cuda.kernel import Kernel, kernel_of
from symfric.integrator.cuda.members import DeviceMembers
from symfric.integrator.many.chunk import Job
from symfric.integrator.many.program import program
from symfric.integrator.running.integrator import Integrator
from symfric.model import Model

Array = NDArray[np.float64]
WHERE = "simulate_many: backend='cuda'"
OPERATIONS, BYTES = 2**30, 2**30
"""Of one attempt of all members of a chunk, and of their results and data: enough members for all
threads of the largest devices several times over where they are small, and where they are large few
enough to keep what is done after an interrupt."""
LOOSEST = 1e-5
"""Smallest relative tolerance that single precision meets."""


def find_device() -> Device:
    """The graphics processor of this machine.

    Raises:
        DeviceError: none, or no CuPy.
    """
    return CupyDevice.found()


def check(model: Model, executor: object, workers: object, rtol: float, real: str) -> None:
    """Refuse what a device cannot do, or has no use for.

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
        raise ValueError(
            f"{WHERE}: expected no executor and no workers, which are for processors, got {given}"
        )
    if real == "float" and rtol < LOOSEST:
        raise ValueError(
            f"{WHERE}: rtol: expected at least {LOOSEST:g} with real='float', got {rtol:g}; use "
            "real='double'"
        )


@final
@dataclass(frozen=True, eq=False)
class OnDevice:
    """An ensemble on a device.

    Attributes:
        job: what all chunks share.
        members: who runs them.
    """

    job: Job
    members: DeviceMembers

    @classmethod
    def of(
        cls, integrator: Integrator, breaks: Array, times: Array, max_steps: int, real: str
    ) -> "OnDevice":
        """Of an integrator; `times` are those of the results [s], as in `Job`.

        Raises:
            DeviceError: there is none, or it refuses the kernel.
            ValueError: an operation that C does not have.
        """
        device = find_device()
        between = not np.isin(times, breaks).all()
        kernel = kernel_of(integrator, between, REALS[real])
        # the kernel is the code that the results depend on
        own = replace(program(integrator, False), code=kernel.text)
        return cls(Job(own, breaks, times, max_steps), DeviceMembers.of(kernel, device))

    def chunk(self, own_data: int) -> int:
        """How many members a chunk has whose own input data are so many numbers each."""
        return chunk_of(self.members.kernel, max(1, self.job.times.size), own_data)

    def report(self, progress: Callable[[float], None], done: Callable[[], int], of: int) -> None:
        """Tell `progress` of members between launches, of whom `done()` are in finished chunks."""
        most = 0.0

        def tell(now: int) -> None:
            nonlocal most
            fraction = min(1.0, (done() + now) / of)
            if fraction > most:  # those that are run again do not count back
                most = fraction
                progress(fraction)

        self.members.tell = tell


def chunk_of(kernel: Kernel, times: int, own_data: int) -> int:
    """Members of a chunk; the same on every device, so that a folder of results is found again."""
    size = kernel.real.size * (kernel.rows + kernel.given + times * kernel.signals + own_data)
    return max(1, min(OPERATIONS // kernel.operations, BYTES // size))
