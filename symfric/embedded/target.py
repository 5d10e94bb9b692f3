"""Cortex-M cores, the tools that compile and run code for them, and programs under QEMU.

The main program calls a block step by step and reports cost and results of each step by
semihosting: a line with a name, then lines with one number each, a word of eight hexadecimal
digits. SysTick measures the steps; under QEMU's -icount it counts only instructions. Start-up code,
linker script and main programs are files in `sources`.
"""

import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from re import fullmatch
from typing import NamedTuple, final

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from symfric.codegen.blocks.block import Block, CBlock
from symfric.codegen.source import header, source
from symfric.emitter.c99 import FUNCTIONS
from symfric.foundation.files import write_text
from symfric.foundation.programs import CompileError, Compiler, ProgramError, finished

BY = ("symfric", "casadi", "casadi, functions of float")
"""Authors of the C: symfric; CasADi, whose code for float calls tanh, exp, fmax for double; CasADi
with a header that replaces these functions by those for float."""

Subject = tuple[Path, dict[str, str]]
"""File with one step of a block, and values of the placeholders of `sources/measured.c`."""


def of_c(c: CBlock, folder: Path) -> Subject:
    """Write the C of a block into `folder`."""
    name, block, guards = c.name, c.block, c.guards
    write_text(folder / f"{name}.h", header(c))
    write_text(folder / f"{name}.c", source(c))
    pointers = {
        "state": "&state",
        "param": f"&{name}_default",
        "in": f"(const {name}_in_t *)U[k]",
        "out": f"({name}_out_t *)(Y[k] + {len(block.states)})",
    }
    step = c.call(pointers, [f"U[k][{i}]" for i in range(len(block.inputs))])
    declarations, start, keep = ["unsigned int status;"], "status = 0u;", "(void)k;"
    if block.states:
        declarations.append(f"{name}_state_t state;")
        start += f" {name}_init(&state, &{name}_start);"
        keep = "memcpy(Y[k], &state, sizeof state);"
    sizes = [f"sizeof({name}_{group}_t)" for group in ("state", "param") if group in block.members]
    return folder / f"{name}.c", {
        "include": f'#include "{name}.h"',
        "declarations": "\n".join(f"static {line}" for line in declarations),
        "start": start,
        "step": f"{'Y[k][0] = ' if block.is_function else 'status |= ' * guards}{step};",
        "keep": keep,
        "data": " + ".join(sizes) or "0u",
    }


def by_casadi(block: Block, real: str, folder: Path, *, functions_of_float: bool) -> Subject:
    """Write the C of CasADi for a step of `block` into `folder`."""
    options = {"casadi_real": real, "casadi_int": "int", "static_aux": True,
               "include_math": not functions_of_float}  # fmt: skip
    generator = ca.CodeGenerator("casadi_step", options)
    generator.add(block.step)
    text = generator.dump()
    if functions_of_float:
        names = sorted({*FUNCTIONS.values(), "fmin", "fmax"})
        renamed = "".join(f"#define {name} {name}f\n" for name in names)
        text = f"#include <math.h>\n{renamed}\n{text}"
    write_text(folder / "casadi_step.c", text)
    f, n = block.step, len(block.states)
    p, x = (literals([float(v.start) for v in group] or [0.0], real)
            for group in (block.parameters, block.states))  # fmt: skip
    static = [
        f"const {real} X0[] = {{{x}}}, P[] = {{{p}}};",
        f"{real} X[{n + 1}], XN[{n + 1}], W[{f.sz_w() + 1}];",
        f"int IW[{f.sz_iw() + 1}];",
        f"const {real} *ARG[{f.sz_arg()}];",
        f"{real} *RES[{f.sz_res()}];",
    ]
    prototype = f"int step(const {real} **arg, {real} **res, int *iw, {real} *w, int mem);\n"
    return folder / "casadi_step.c", {
        "include": "",
        "declarations": prototype + "\n".join(f"static {line}" for line in static),
        "start": "memcpy(X, X0, sizeof X0);",
        "step": f"ARG[0] = X; ARG[1] = P; ARG[2] = U[k]; RES[0] = XN; RES[1] = Y[k] + {n}; "
        f"step(ARG, RES, IW, W, 0); memcpy(X, XN, {n} * sizeof X[0]);",
        "keep": f"memcpy(Y[k], X, {n} * sizeof X[0]);",
        "data": "sizeof X + sizeof XN + sizeof W + sizeof IW + sizeof ARG + sizeof RES + sizeof P",
    }


def literals(values: Sequence[float], real: str) -> str:
    """Return numbers as C constants, separated by commas."""
    form = "{:.9e}f" if real == "float" else "{:.17e}"
    return ", ".join(form.format(value) for value in values)


class Core(NamedTuple):
    """Cortex-M core.

    Attributes:
        name: short name.
        title: full name with the floating-point unit.
        options: options of gcc.
        machine: QEMU's board whose core runs the code.
    """

    name: str
    title: str
    options: tuple[str, ...]
    machine: str


_SOFT, _HARD = "-mfloat-abi=soft", "-mfloat-abi=hard"
_M4, _M7 = ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"), ("-mcpu=cortex-m7", "-mfpu=fpv5-d16")

CORES = {
    core.name: core
    for core in (
        Core("m0plus", "Cortex-M0+, no FPU", ("-mcpu=cortex-m0plus", _SOFT), "mps2-an385"),
        Core("m3", "Cortex-M3, no FPU", ("-mcpu=cortex-m3", _SOFT), "mps2-an385"),
        Core("m4f", "Cortex-M4F, FPU of float", (*_M4, _HARD), "mps2-an386"),
        Core("m7", "Cortex-M7, FPU of double", (*_M7, _HARD), "mps2-an500"),
    )
}
"""Cores by name. Code for the M0+ runs on QEMU's M3 with the same counts: ARMv6-M is a subset of
ARMv7-M, and QEMU's only board with an M0 has 16 kB of RAM."""

CLOCK = 25e6
"""Frequency of SysTick on the boards [Hz]."""

GCC, NEWLIB, QEMU = "arm-none-eabi-gcc", "newlib for arm-none-eabi", "qemu-system-arm"

PACKAGES = {
    GCC: "gcc-arm-none-eabi",
    NEWLIB: "libnewlib-arm-none-eabi",
    QEMU: "qemu-system-arm",
}
"""Tool -> package of Debian and Ubuntu."""

LIBRARY_PATIENCE = 10.0
"""Time limit of a compiler to print the path of its library [s]."""


@final
@dataclass(frozen=True)
class Tools:
    """Cross compiler and path of the emulator."""

    gcc: Compiler
    qemu: str


@final
@dataclass(frozen=True)
class Absent:
    """Names of the tools that are missing."""

    names: tuple[str, ...]

    @property
    def advice(self) -> str:
        """Sentence with the absent tools and the command that installs them."""
        packages = " ".join(PACKAGES[name] for name in self.names)
        return (
            f"{', '.join(self.names)} not found; on Debian and Ubuntu: "
            f"apt-get install --no-install-recommends {packages}"
        )


def find_tools() -> Tools | Absent:
    """Return the tools in PATH, or the names of the missing ones."""
    gcc, qemu, has_library = shutil.which(GCC), shutil.which(QEMU), False
    if gcc is not None:
        with suppress(ProgramError):  # gcc prints the path of libm, or only its name if absent
            command = (gcc, "-print-file-name=libm.a")
            library = finished(command, limit=LIBRARY_PATIENCE).output.strip()
            has_library = library not in (b"", b"libm.a")
    if gcc and qemu and has_library:
        return Tools(Compiler((gcc,)), qemu)
    found = {GCC: gcc, NEWLIB: has_library, QEMU: qemu}
    return Absent(tuple(name for name, there in found.items() if not there))


SOURCES = Path(__file__).with_name("sources")
"""Folder of start-up code, linker script and main programs."""

FLAGS = ("-mthumb", "-std=gnu99", "-ffunction-sections", "-fdata-sections", "-ffp-contract=off")
"""Flags for all cores."""

SHIFT = 7
"""Binary logarithm of the time of an instruction [ns]: 2^7 ns are 3.2 ticks of SysTick, whose
24 bits count up to 5 million instructions."""

WORD = "[0-9a-f]{8}"

PATIENCE = 120.0
"""Time limit of a program [s]."""


@final
@dataclass(frozen=True, eq=False)
class Target:
    """Core with its tools and the flags of the compiler."""

    core: Core
    tools: Tools
    flags: Sequence[str]

    def linked(self, folder: Path, main: str, sources: Sequence[Path], *flags: str) -> Path:
        """Return an image of a main program and `sources`, the first of which is measured.

        Raises:
            CompileError: the compiler rejects the code.
        """
        write_text(folder / "target.c", main)
        gcc, options = self.tools.gcc, (*self.core.options, *FLAGS, *self.flags, *flags)
        names = ("block", *(f"more_{k}" for k in range(1, len(sources))), "startup", "target")
        objects = [str(folder / f"{name}.o") for name in names]
        files = (*sources, SOURCES / "startup.c", folder / "target.c")
        for file, item in zip(files, objects, strict=True):
            gcc.run(*options, f"-I{folder}", "-c", str(file), "-o", item)
        image = folder / "image.elf"
        linking = ("-nostartfiles", f"-T{SOURCES / 'memory.ld'}", "-Wl,--gc-sections")
        gcc.run(*options, *linking, "--specs=nosys.specs", *objects, "-lm", "-o", str(image))
        return image

    def heard(
        self, image: Path, *, shift: int = SHIFT, limit: float = PATIENCE
    ) -> dict[str, NDArray[np.uint32]]:
        """Run an image under QEMU; return the words that it reports after each name.

        Args:
            image: result of `linked`.
            shift: binary logarithm of the time of an instruction [ns], see `SHIFT`.
            limit: time limit [s].

        Raises:
            CompileError: the program does not start or end, or ends in a fault.
        """
        core = self.core
        command = (
            *(self.tools.qemu, "-M", core.machine, "-display", "none", "-monitor", "none"),
            *("-serial", "none", "-semihosting-config", "enable=on,target=native"),
            *("-icount", f"shift={shift}", "-kernel", str(image)),
        )
        try:
            done = finished(command, limit=limit, name=f"{core.title} under QEMU")
        except ProgramError as error:
            raise CompileError(str(error)) from None
        lines = (done.output.decode(errors="replace") + done.messages).split()
        if done.status or "end" not in lines:
            said = " ".join(lines[-8:])
            raise CompileError(f"{core.title}: QEMU ended with status {done.status}: {said}")
        found: dict[str, list[int]] = {}
        for line in lines[: lines.index("end")]:
            if fullmatch(WORD, line):
                found[next(reversed(found))].append(int(line, 16))
            else:
                found[line] = []
        return {name: np.array(words, dtype=np.uint32) for name, words in found.items()}
