"""Kernel of a graphics processor, one member per thread, and the functions of CuPy that it needs.

The source is valid as C and as CUDA C++. For a graphics processor and for a host compiler only the
lines before and after it differ, so the arithmetic is tested without a graphics processor.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, final

import numpy as np

from symfric.emitter.c99 import DOUBLE, Real
from symfric.integrator.compiled.columns import densified
from symfric.integrator.equations.blocks import DONE, ROUNDS
from symfric.integrator.many.members import defined, loop_sizes
from symfric.integrator.methods.pieces import in_c, macros
from symfric.integrator.running.integrator import Integrator

NAME = "symfric_launch"
DONE_IN_SINGLE = 1e-5
"""Value of `blocks.DONE` in single precision; smaller changes are rounding errors."""

BEFORE = """#define HUGE_VAL __longlong_as_double(0x7ff0000000000000LL)
#define HUGE_VALF __int_as_float(0x7f800000)
#define DEVICE __device__
#define BESIDE __device__ __noinline__
#define TICKET(count) atomicAdd(count, 1)
"""
"""Lines for NVRTC before the source; NVRTC has no headers, functions of math.h are built in."""

AFTER = f"""
extern "C" __global__ void {NAME}(const Many *all)
{{
    symfric_thread(all);
}}
"""
"""Launch, without `__launch_bounds__`: with it, the assembler assigned only 32 of 255 registers to
a six-joint arm.
"""


@final
@dataclass(frozen=True, eq=False)
class Kernel:
    """Source of a kernel and the sizes of its data.

    Attributes:
        text: source of functions and loop, without the machine-dependent part.
        real: floating point type of all data except times.
        rows: number of rows of S.
        given: number of rows of R.
        states: number of states whose least and greatest values are kept.
        signals: number of signals of a result.
        operations: number of operations of an attempt.
    """

    text: str
    real: Real
    rows: int
    given: int
    states: int
    signals: int
    operations: int


def kernel_of(integrator: Integrator, between: bool = True, real: Real = DOUBLE) -> Kernel:
    """Return the kernel of an integrator's attempt; written once, then cached in the integrator.

    Args:
        integrator: integrator of a model without events.
        between: True if there are results between the ends of steps.
        real: floating point type.

    Raises:
        ValueError: an operation that does not exist in C.
    """
    known: dict[tuple[bool, str], Kernel] = integrator.memory.setdefault("kernels", {})
    key = between, real.name
    if key not in known:
        known[key] = _written(integrator, between, real)
    return known[key]


def _written(integrator: Integrator, between: bool, real: Real) -> Kernel:
    step, signals, system = integrator.step, densified(integrator.signals), integrator.system
    follow, head = integrator.follow if integrator.follows else None, "static DEVICE "
    names = ("next", "D" if between else "")
    functions = [
        in_c(step, "symfric_attempt", ("S", "R"), names, real, head),
        in_c(signals, "symfric_values", ("t", "y", "d"), ("out",), real, head),
    ]
    sizes = loop_sizes(step, signals, integrator.follows, follow)
    sizes |= {"NX": system.nx, "OWN_TIME": int(real.size < 8), "TIMED": int(system.timed)}
    sizes |= {} if between else {"ROWS": 0}
    if follow is not None:
        done = DONE if real.size == 8 else DONE_IN_SINGLE
        sizes |= {
            "ROUNDS": ROUNDS, "DONE": real.literal(done),
            "CONTRACTION": real.literal(follow.contraction),
        }  # fmt: skip
        places = ("y", "d"), ("after", "look")
        functions.append(in_c(follow.round, "symfric_round", *places, real, head))
    written = "\n".join(one.text for one in functions)
    loop = Path(__file__).with_name("members.h").read_text(encoding="utf-8")
    # define sizes after the written functions, whose arguments may have the same names
    text = f"typedef {real.name} real;\n{macros(functions, real)}\n{written}\n"
    numbers = step.numel_in(0), step.numel_in(1), system.nx, signals.numel_out(0)
    return Kernel(f"{text}{defined(sizes)}\n{loop}", real, *numbers, functions[0].operations)


BLOCK = 64
"""Number of threads of a block; small, since each thread holds hundreds of numbers."""
OPTIONS = ("--fmad=false",)
"""Compiler options. Every operation is rounded separately, as on the CPU, so tests on the CPU are
valid for the device up to the last digits of exp, sin, pow and similar functions.
"""
WARP, GRAIN = 32, 256
"""Number of threads of a warp, and the unit in which registers are allocated to a warp."""
MEANWHILE = "use backend='auto' meanwhile"
Launch = Callable[[bytes, int], None]
"""Function that runs up to a number of threads on the data of a struct `Many` and waits for them.

It raises a `DeviceError` if the device fails, for example by the time limit of a device that also
drives a screen.
"""


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

    def load(self, kernel: Kernel) -> Launch:
        """Compile a kernel, or load it from CuPy's cache.

        Raises:
            DeviceError: NVRTC is missing or rejects the kernel.
        """
        code, cupy = f"{BEFORE}{kernel.text}{AFTER}", self.cupy
        module = cupy.RawModule(code=code, options=OPTIONS, backend="nvrtc")
        try:
            function = module.get_function(NAME)
        except (cupy.cuda.compiler.CompileException, RuntimeError, OSError) as error:
            reason = (str(error).strip() or type(error).__name__).splitlines()[0]
            raise DeviceError(
                f"simulate_many: backend='cuda': NVRTC did not compile the kernel ({reason}); "
                f"pip install 'symfric[cuda]' installs a matching version, or {MEANWHILE}"
            ) from None
        most = self.threads(int(function.num_regs))

        def launch(many: bytes, threads: int) -> None:
            held = cupy.asarray(np.frombuffer(many, dtype=np.uint8))
            try:
                function((-(-min(threads, most) // BLOCK),), (BLOCK,), (held,))
                cupy.cuda.get_current_stream().synchronize()
            except RuntimeError as error:  # base class of CuPy's errors
                raise DeviceError(
                    f"simulate_many: the graphics processor stopped ({error}); complete chunks "
                    "are in the folder `out`, if given"
                ) from None

        return launch

    def threads(self, registers: int) -> int:
        """Return the number of threads that run at once if each uses this number of registers."""
        p = self.properties
        of_warp = -(-max(1, registers) * WARP // GRAIN) * GRAIN
        warps = int(p["regsPerMultiprocessor"]) // of_warp
        threads = min(warps * WARP, int(p["maxThreadsPerMultiProcessor"])) // BLOCK * BLOCK
        return int(p["multiProcessorCount"]) * max(BLOCK, threads)
