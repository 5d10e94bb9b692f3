"""The cores that code is measured on: options of the compiler, machine of QEMU."""

from dataclasses import dataclass
from typing import final


@final
@dataclass(frozen=True)
class Core:
    """A Cortex-M core.

    Attributes:
        name: in short.
        title: in full, with its floating point unit.
        options: of gcc.
        machine: QEMU's board whose core runs this code.
    """

    name: str
    title: str
    options: tuple[str, ...]
    machine: str


_SOFT = "-mfloat-abi=soft"
_HARD = "-mfloat-abi=hard"

CORES = {
    core.name: core
    for core in (
        Core("m0plus", "Cortex-M0+, no FPU", ("-mcpu=cortex-m0plus", _SOFT), "mps2-an385"),
        Core("m3", "Cortex-M3, no FPU", ("-mcpu=cortex-m3", _SOFT), "mps2-an385"),
        Core(
            "m4f",
            "Cortex-M4F, FPU of float",
            ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", _HARD),
            "mps2-an386",
        ),
        Core(
            "m7",
            "Cortex-M7, FPU of double",
            ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", _HARD),
            "mps2-an500",
        ),
    )
}
"""By name. Code for the M0+ runs on QEMU's M3: ARMv6-M is a part of ARMv7-M, instruction by
instruction, so that the counts are the same; QEMU's one board with an M0 has 16 kB of RAM."""

CLOCK = 25e6
"""Of SysTick on the boards [Hz]."""
