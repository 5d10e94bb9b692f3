"""Kernels compiled by NVRTC without a graphics processor: what a machine without one can tell.

NVRTC is in the package nvidia-cuda-nvrtc-cu12 (extra 'cuda-check') and needs neither driver nor
device. For an architecture such as compute_80 it makes PTX, for sm_80 the machine code, of which
its assembler tells registers and spills.
"""

import ctypes
import re
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import final

from symfric.integrator.cuda.cupy_device import OPTIONS
from symfric.integrator.cuda.device import DeviceError

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
