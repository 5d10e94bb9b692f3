"""The tools that cross-compile and run code for Cortex-M, or what to say where they are absent."""

import shutil
from dataclasses import dataclass
from typing import final

from symfric.foundation.compiler import Compiler
from symfric.foundation.programs import ProgramError, finished

GCC, QEMU, NEWLIB = "arm-none-eabi-gcc", "qemu-system-arm", "newlib for arm-none-eabi"

PACKAGES = {
    GCC: "gcc-arm-none-eabi",
    NEWLIB: "libnewlib-arm-none-eabi",
    QEMU: "qemu-system-arm",
}
"""Tool -> package of Debian and Ubuntu."""

PATIENCE = 10.0
"""Seconds in which a compiler says where its library is."""


@final
@dataclass(frozen=True)
class Tools:
    """The cross compiler, and the path of the emulator."""

    gcc: Compiler
    qemu: str


@final
@dataclass(frozen=True)
class Absent:
    """Names of the tools that are missing."""

    names: tuple[str, ...]

    @property
    def advice(self) -> str:
        """What is absent and how to get it, in a sentence."""
        packages = " ".join(PACKAGES[name] for name in self.names)
        return (
            f"{', '.join(self.names)} not found; on Debian and Ubuntu: "
            f"apt-get install --no-install-recommends {packages}"
        )


def find_tools() -> Tools | Absent:
    """The tools in PATH, or which of them are not there."""
    gcc, qemu = shutil.which(GCC), shutil.which(QEMU)
    if gcc is not None and qemu is not None and _has_library(gcc):
        return Tools(Compiler((gcc,)), qemu)
    missing = [name for name, path in ((GCC, gcc), (QEMU, qemu)) if path is None]
    if gcc is None or not _has_library(gcc):
        missing.insert(1 if gcc is None else 0, NEWLIB)
    return Absent(tuple(missing))


def _has_library(gcc: str) -> bool:
    """Whether the compiler finds the mathematical library: asked, it says a path, not a name."""
    try:
        said = finished((gcc, "-print-file-name=libm.a"), limit=PATIENCE).output.strip()
    except ProgramError:
        return False
    return said not in (b"", b"libm.a")
